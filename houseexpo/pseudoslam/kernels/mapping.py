"""Merge scans into the robot's map (0 unknown, 127 free, 255 obstacle), crop its view, and draw it at coarser scales.

The *view* is a square around the robot with its heading up (``crop_view``). Rotating a picture by nearest cells
accesses each cell in an order that is slow for a processor. But large areas of a map are uniform, unknown or free.
Therefore the square is drawn in tiles of 8 x 8. A tile whose cells all lie in 16 x 16 equal cells of the map is filled
at once; the others, one in five in a house, are drawn cell by cell.

A map at any other scale (``draw_coarse_view``) follows two rules:

R1  A pixel shows the block of cells that contains its centre: an obstacle if one of the cells is one, else free if one
    is free, else unknown. The width of blocks is that of a pixel in cells, rounded up; they are side by side from the
    map's corner. Therefore no wall disappears in a coarse picture, but it may look one block thicker.
R2  Outside the map, everything is unknown.

The cost of a picture does not depend on the size of the map: blocks are computed where the picture shows them
(``draw_coarse_view``) or, if they are kept from step to step, where scans have changed cells (``max_of_blocks``).

Positions in pictures are fixed-point numbers, whose lower bits are fractions of a cell or block, so that sums are exact
and fast.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.tolerances import WHOLE_PX
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Grid, Kinds, Runs

UNKNOWN, FREE, OBSTACLE = 0, 127, 255
"""The values of a map: black, gray and white in the paper's figure."""
CHUNK_BITS = 6
CHUNK = 1 << CHUNK_BITS
"""Number of cells, one after the other in a flat map, that share a flag (``Episode.fresh``)."""


@njit(cache=True, nogil=True)
def merge_cells(known: Grid, observable: Grid, cells: Cells, n_cells: int, value: int, fresh: Grid) -> tuple[int, int]:
    """Set cells of the map to ``value``; return how many were unknown before, and how many of those count.

    Parameters
    ----------
    known, observable
        (rows, cols); the latter is 1 for cells that count for coverage, else 0.
    cells
        Flat indices, of which the first ``n_cells`` are used; a cell may occur several times.
    fresh
        (chunks,), set to 1 for chunks in which a cell was unknown before; (0,) if nobody asks.
    """
    flat, counts = known.ravel(), observable.ravel()
    new, covered = 0, 0
    for i in range(n_cells):
        cell = np.uint64(cells[np.uint64(i)])
        if flat[cell] == UNKNOWN:
            new += 1
            covered += int(counts[cell])
            if len(fresh) > 0:
                fresh[np.uint64(int(cell) >> CHUNK_BITS)] = 1
        flat[cell] = value
    return new, covered


@njit(cache=True, nogil=True)
def merge_runs(known: Grid, observable: Grid, runs: Runs, n_runs: int, value: int, fresh: Grid) -> tuple[int, int]:
    """Do the same as ``merge_cells`` with the first ``n_runs`` runs of cells."""
    flat, counts = known.ravel(), observable.ravel()
    new, covered = 0, 0
    for i in range(n_runs):
        first, stop = runs[i, 0], runs[i, 1] + 1
        least = np.uint8(OBSTACLE)
        for cell in range(first, stop):
            least = min(least, flat[np.uint64(cell)])
        if least == UNKNOWN:  # most runs are already known
            for cell in range(first, stop):
                if flat[np.uint64(cell)] == UNKNOWN:
                    new += 1
                    covered += int(counts[np.uint64(cell)])
            if len(fresh) > 0:
                for chunk in range(first >> CHUNK_BITS, ((stop - 1) >> CHUNK_BITS) + 1):
                    fresh[np.uint64(chunk)] = 1
        for cell in range(first, stop):
            flat[np.uint64(cell)] = value
    return new, covered


@njit(cache=True, nogil=True)
def draw_overview(known: Grid, middle_x: float, middle_y: float, side_px: float, changed: Counts, out: Grid) -> None:
    """Draw the overview of the map (cells, cells) around a centre, row 0 on top, where cells have ``changed``.

    A coarse cell, ``side_px`` wide, is an obstacle if one of its cells is one, else free if one is free, else unknown.
    Its cells are those that start in it, at least one. ``changed`` is a row of ``Episode.changed``.
    """
    cells, (rows, cols) = len(out), known.shape
    left, top = middle_x - cells / 2 * side_px, middle_y - cells / 2 * side_px
    first, last = _coarse_cells(changed[0], changed[1], top, side_px, cells)
    first_col, last_col = _coarse_cells(changed[2], changed[3], left, side_px, cells)
    if first >= last or first_col >= last_col:
        return
    begin = min(max(math.floor(left + first_col * side_px), 0), cols)
    end = max(min(math.floor(left + last_col * side_px) + 1, cols), begin)
    flat, most = known.ravel(), np.empty(end - begin, np.uint8)
    for i in range(first, last):
        one = math.floor(top + i * side_px)
        other = max(math.floor(top + (i + 1) * side_px), one + 1)
        most[:] = UNKNOWN
        for row in range(max(one, 0), min(other, rows)):
            start = row * cols + begin
            for k in range(len(most)):
                most[np.uint64(k)] = max(most[np.uint64(k)], flat[np.uint64(start + k)])
        for j in range(first_col, last_col):
            col = math.floor(left + j * side_px)
            stop = max(math.floor(left + (j + 1) * side_px), col + 1)
            value = np.uint8(UNKNOWN)
            for k in range(max(col, begin) - begin, min(stop, end) - begin):
                value = max(value, most[k])
            out[i, j] = value


@njit(cache=True, nogil=True)
def _coarse_cells(first: int, end: int, start: float, side_px: float, cells: int) -> tuple[int, int]:
    """Return the first and the last (excluded) coarse cell with cells from ``first`` to ``end``, or slightly more."""
    if first >= end:
        return 0, 0
    return max(math.floor((first - start) / side_px) - 1, 0), min(math.ceil((end - start) / side_px) + 1, cells)


_CELL_BITS = 16  # for fractions of a cell, in a signed word of 32 for positions in a view of up to 20,000 cells
_TILE, _CELLS = 8, 64  # a tile's side and its cells
_BLOCK, _BLOCK_BITS = 4, 2  # a block's side; a rotated tile is less than 13 cells wide: it lies within 4 x 4 blocks


@njit(cache=True, nogil=True)
def crop_view(known: Grid, x: float, y: float, heading: float, out: Grid) -> None:
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
    one = float(1 << _CELL_BITS)
    left, top = (x - from_col + middle * (cos - sin)) * one, (y - from_row - middle * (cos + sin)) * one
    right, down = cos * one, sin * one  # a column on: down to the right in the map; a row on: down to the left
    width = np.int32(blocks * _BLOCK)
    if side < _TILE:
        for i in range(side):
            for j in range(side):
                across, along = math.floor(left + j * down - i * right), math.floor(top + j * right + i * down)
                out[i, j] = window[(along >> _CELL_BITS) * width + (across >> _CELL_BITS)]
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
            col, row = (at_x + low_x) >> (_CELL_BITS + _BLOCK_BITS), (at_y + low_y) >> (_CELL_BITS + _BLOCK_BITS)
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
                across = np.int32(np.int32(at_x + in_x[np.uint64(k)]) >> np.int32(_CELL_BITS))
                along = np.int32(np.int32(at_y + in_y[np.uint64(k)]) >> np.int32(_CELL_BITS))
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


_PICTURE_BITS = 32  # for fractions of a block, in a signed word of 64


@njit(cache=True, nogil=True)
def draw_coarse_view(known: Grid, x: float, y: float, cos: float, sin: float, pixel: float, out: Grid) -> None:
    """Draw the square of the map around a position by R1 and R2; ``pixel`` is the width of a pixel in cells.

    Parameters
    ----------
    x, y
        The centre of the picture, cells.
    cos, sin
        Cosine and sine of the direction that is up, counter-clockwise from the map's right.
    out
        (side, side).
    """
    size, (rows, cols) = side_of_block(pixel), known.shape
    if size == 1:
        draw_nearest_cells(known, x, y, cos, sin, pixel, out)
        return
    spread = pixel * len(out) / 2 * (abs(cos) + abs(sin)) + size
    shown = np.empty(4, np.int64)
    shown[0], shown[1] = max(math.floor(y - spread), 0), min(math.ceil(y + spread), rows)
    shown[2], shown[3] = max(math.floor(x - spread), 0), min(math.ceil(x + spread), cols)
    coarse = np.empty(((rows + size - 1) // size, (cols + size - 1) // size), np.uint8)
    max_of_blocks(known, size, shown, coarse)
    draw_nearest_cells(coarse, x / size, y / size, cos, sin, pixel / size, out)


@njit(cache=True, nogil=True)
def side_of_block(pixel: float) -> int:
    """Return the width of the blocks that a pixel ``pixel`` cells wide shows, in cells (R1)."""
    return max(math.ceil(pixel - WHOLE_PX), 1)


@njit(cache=True, nogil=True)
def draw_nearest_cells(grid: Grid, x: float, y: float, cos: float, sin: float, pixel: float, out: Grid) -> None:
    """Draw the same square of a grid of numbers: a pixel shows the cell at its centre, 0 outside the grid."""
    rows, cols = grid.shape
    flat, view, side = grid.ravel(), out.ravel(), len(out)
    middle, one = (side - 1) / 2, pixel * float(1 << _PICTURE_BITS)
    left = math.floor(x * float(1 << _PICTURE_BITS) + one * middle * (cos - sin))
    top = math.floor(y * float(1 << _PICTURE_BITS) - one * middle * (cos + sin))
    right, down = math.floor(one * sin), math.floor(one * cos)  # a pixel to the right, on the map
    for i in range(side):
        across, along = left - i * down, top + i * right
        for j in range(side):
            col, row = across >> _PICTURE_BITS, along >> _PICTURE_BITS
            inside = (col >= 0) & (col < cols) & (row >= 0) & (row < rows)
            view[np.uint64(i * side + j)] = flat[np.uint64(row * cols + col)] if inside else 0
            across += right
            along += down


@njit(cache=True, nogil=True)
def max_of_blocks(known: Grid, size: int, changed: Counts, out: Grid) -> None:
    """Write the highest value of each block of ``size`` x ``size`` cells; the last ones may have fewer cells.

    The maximum over the rows of a block is computed for all columns at once, and then the maximum of each cell and
    a growing number of cells to its right, in loops that the compiler can vectorise.

    Parameters
    ----------
    changed
        (4,) the first row, the row after the last, the first column and the column after the last of the cells whose
        blocks are computed; none if the first is not below the last.
    out
        (blocks down, blocks across).
    """
    rows, cols = known.shape
    first, left = changed[0] // size, changed[2] // size
    last, right = (min(changed[1], rows) + size - 1) // size, (min(changed[3], cols) + size - 1) // size
    if changed[0] >= changed[1] or first >= last or left >= right:
        return
    begin, wide = left * size, right - left
    length = min(wide * size, cols - begin)
    flat, lines = known.ravel(), np.zeros((2, (wide + 1) * size), np.uint8)
    for i in range(first, last):
        most, other = lines[0], lines[1]
        most[:] = UNKNOWN
        for row in range(i * size, min((i + 1) * size, rows)):
            start = row * cols + begin
            for k in range(length):
                most[np.uint64(k)] = max(most[np.uint64(k)], flat[np.uint64(start + k)])
        span = 1
        while span < size:
            more = min(span, size - span)
            for k in range(wide * size):
                other[np.uint64(k)] = max(most[np.uint64(k)], most[np.uint64(k + more)])
            most, other = other, most
            span += more
        for j in range(wide):
            out[i, left + j] = most[np.uint64(j * size)]


@njit(cache=True, nogil=True)
def draw_disc(picture: Grid, x: float, y: float, radius: float, value: int) -> None:
    """Draw a disc; if its centre lies outside the picture, it is drawn at the nearest place of the border."""
    side = len(picture)
    x, y = min(max(x, 0.5), side - 0.5), min(max(y, 0.5), side - 0.5)
    for row in range(max(math.floor(y - radius), 0), min(math.ceil(y + radius), side)):
        for col in range(max(math.floor(x - radius), 0), min(math.ceil(x + radius), side)):
            if (col + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2 <= radius**2:
                picture[row, col] = value
