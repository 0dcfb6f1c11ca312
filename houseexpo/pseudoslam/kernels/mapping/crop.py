"""Crop the robot's view of the map: a square around it, with its heading up.

Rotating a picture by nearest cells accesses each cell in an order that is slow for a processor. But large areas of a
map are uniform, unknown or free. Therefore the square is drawn in tiles of 8 x 8. A tile whose cells all lie in 16 x 16
equal cells of the map is filled at once; the others, one in five in a house, are drawn cell by cell.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import UNKNOWN
from houseexpo.pseudoslam.kernels.types import Grid, Kinds

_BITS = 16  # for fractions of a cell, in a signed word of 32 for positions in a view of up to 20,000 cells
_TILE, _CELLS = 8, 64  # a tile's side and its cells
_BLOCK, _BLOCK_BITS = 4, 2  # a block's side; a rotated tile is less than 13 cells wide: it lies within 4 x 4 blocks


@njit(cache=True, nogil=True)
def crop(known: Grid, x: float, y: float, heading: float, out: Grid) -> None:
    """Write the square of the map around a position, heading up, by nearest cells; outside the map it is unknown.

    ``out`` is (side, side), with the position at its centre, which is between cells if the side is even. Positions are
    fixed-point numbers, whose lower bits are fractions of a cell, with an error of less than 1e-4 of one.
    """
    side, view = out.shape[0], out.ravel()
    cos, sin = math.cos(heading), math.sin(heading)
    middle = (side - 1) / 2
    spread = middle * (abs(cos) + abs(sin)) + 1.0
    from_col, from_row = math.floor(x - spread), math.floor(y - spread)  # no visible cell is left of or above it
    blocks = math.floor(2.0 * spread) // _BLOCK + 5
    window, kinds = np.empty((blocks * _BLOCK) ** 2, np.uint8), np.empty(blocks**2, np.uint16)
    _cut(known, from_row, from_col, blocks, window, kinds)
    one = float(1 << _BITS)
    left, top = (x - from_col + middle * (cos - sin)) * one, (y - from_row - middle * (cos + sin)) * one
    right, down = cos * one, sin * one  # a column on: down to the right in the map; a row on: down to the left
    width = np.int32(blocks * _BLOCK)
    if side < _TILE:
        for i in range(side):
            for j in range(side):
                across, along = math.floor(left + j * down - i * right), math.floor(top + j * right + i * down)
                out[i, j] = window[(along >> _BITS) * width + (across >> _BITS)]
        return
    in_x, in_y = np.empty(_CELLS, np.int32), np.empty(_CELLS, np.int32)  # a tile's cells from its first
    for k in range(_CELLS):
        i, j = k // _TILE, k % _TILE
        in_x[k], in_y[k] = math.floor(j * down - i * right), math.floor(j * right + i * down)
    low_x, low_y = min(0, in_x[7], in_x[56], in_x[63]), min(0, in_y[7], in_y[56], in_y[63])
    tiles = (side + _TILE - 1) // _TILE
    to, from_x, from_y = np.empty((3, tiles), np.int32)  # of the tiles of a row that are not uniform
    cells, found = np.empty(tiles * _CELLS, np.int32), np.empty(tiles * _CELLS, np.uint8)
    lines = found.view(np.uint64)  # of eight cells each: a tile's row
    for tile_row in range(tiles):
        i = min(tile_row * _TILE, side - _TILE)
        mixed = 0
        for tile_col in range(tiles):
            j = min(tile_col * _TILE, side - _TILE)
            at_x, at_y = int(left + j * down - i * right), int(top + j * right + i * down)
            col, row = (at_x + low_x) >> (_BITS + _BLOCK_BITS), (at_y + low_y) >> (_BITS + _BLOCK_BITS)
            kind = kinds[np.uint64(row * blocks + col)]
            first = i * side + j
            for a in range(_TILE):
                for b in range(_TILE):
                    view[np.uint64(first + a * side + b)] = kind & 255
            to[mixed], from_x[mixed], from_y[mixed] = first, at_x, at_y
            mixed += (kind & 255) + (kind >> 8) != 255
        for t in range(mixed):
            at_x, at_y = from_x[t], from_y[t]
            for k in range(_CELLS):
                across = np.int32(np.int32(at_x + in_x[np.uint64(k)]) >> np.int32(_BITS))
                along = np.int32(np.int32(at_y + in_y[np.uint64(k)]) >> np.int32(_BITS))
                cells[np.uint64(t * _CELLS + k)] = np.int32(along * width) + across
        for k in range(mixed * _CELLS):
            found[np.uint64(k)] = window[np.uint32(cells[np.uint64(k)])]
        for t in range(mixed):
            for a in range(_TILE):
                line, first = lines[np.uint64(t * _TILE + a)], np.uint64(to[t] + a * side)
                for b in range(_TILE):  # one store, for the compiler sees that it is the line
                    view[first + np.uint64(b)] = np.uint8(line >> np.uint64(8 * b))


@njit(cache=True, nogil=True)
def _cut(known: Grid, from_row: int, from_col: int, blocks: int, window: Grid, kinds: Kinds) -> None:
    """Copy a square of the map, unknown outside it, and summarise for each block the 4 x 4 blocks starting at it.

    Parameters
    ----------
    window
        (blocks * 4, blocks * 4), flat.
    kinds
        (blocks, blocks), flat: all bits that are set in some cell and, times 256, those that are not set in some cell.
        They add up to 255 if all cells are equal; their value is then the lower eight bits. The last three rows and
        columns must not be read.
    """
    rows, cols = known.shape
    flat, words, wide = known.ravel(), window.view(np.uint32), blocks * _BLOCK
    first, last = min(max(-from_col, 0), wide), max(min(cols - from_col, wide), 0)
    top, bottom = min(max(-from_row, 0), wide), max(min(rows - from_row, wide), 0)
    if min(last - first, bottom - top) < wide:
        for k in range(wide * wide):
            window[np.uint64(k)] = UNKNOWN
    for i in range(top, bottom):
        line, at = i * wide, (from_row + i) * cols + from_col
        for j in range(first, last):
            window[np.uint64(line + j)] = flat[np.uint64(at + j)]
    down = np.empty(blocks**2, np.uint16)
    for block in range(blocks):
        for col in range(blocks):
            k = block * _BLOCK * blocks + col
            one, two = words[np.uint64(k)], words[np.uint64(k + blocks)]
            three, four = words[np.uint64(k + 2 * blocks)], words[np.uint64(k + 3 * blocks)]
            some, lacking = np.uint32(one | two | three | four), np.uint32(~(one & two & three & four))
            some, lacking = np.uint32(some | some >> np.uint32(16)), np.uint32(lacking | lacking >> np.uint32(16))
            some, lacking = np.uint32(some | some >> np.uint32(8)), np.uint32(lacking | lacking >> np.uint32(8))
            kinds[np.uint64(block * blocks + col)] = np.uint16(
                np.uint32(some & np.uint32(255)) | lacking << np.uint32(8)
            )
    for k in range((blocks - 3) * blocks):
        one, two = kinds[np.uint64(k)], kinds[np.uint64(k + blocks)]
        down[np.uint64(k)] = one | two | kinds[np.uint64(k + 2 * blocks)] | kinds[np.uint64(k + 3 * blocks)]
    for k in range((blocks - 3) * blocks - 3):
        one, two = down[np.uint64(k)], down[np.uint64(k + 1)]
        kinds[np.uint64(k)] = one | two | down[np.uint64(k + 2)] | down[np.uint64(k + 3)]
