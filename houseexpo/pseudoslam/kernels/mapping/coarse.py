"""Draw maps at any scale, and marks on them.

R1  A pixel shows the block of cells that contains its centre: an obstacle if one of the cells is one, else free if one
    is free, else unknown. The width of blocks is that of a pixel in cells, rounded up; they are side by side from the
    map's corner. Therefore no wall disappears in a coarse picture, but it may look one block thicker.
R2  Outside the map, everything is unknown.

Positions are fixed-point numbers, whose lower bits are fractions of a block, so that sums are exact and fast.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import UNKNOWN
from houseexpo.pseudoslam.kernels.types import Grid

_EPS = 1e-9
_BITS = 32  # for fractions of a block, in a signed word of 64


@njit(cache=True, nogil=True)
def draw_coarse(known: Grid, x: float, y: float, cos: float, sin: float, pixel: float, out: Grid) -> None:
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
    size = max(math.ceil(pixel - _EPS), 1)
    if size == 1:
        draw_nearest(known, x, y, cos, sin, pixel, out)
    else:
        draw_nearest(most_of_blocks(known, size), x / size, y / size, cos, sin, pixel / size, out)


@njit(cache=True, nogil=True)
def draw_nearest(grid: Grid, x: float, y: float, cos: float, sin: float, pixel: float, out: Grid) -> None:
    """Draw the same square of a grid of numbers: a pixel shows the cell at its centre, 0 outside the grid."""
    rows, cols = grid.shape
    flat, view, side = grid.ravel(), out.ravel(), len(out)
    middle, one = (side - 1) / 2, pixel * float(1 << _BITS)
    left = math.floor(x * float(1 << _BITS) + one * middle * (cos - sin))
    top = math.floor(y * float(1 << _BITS) - one * middle * (cos + sin))
    right, down = math.floor(one * sin), math.floor(one * cos)  # a pixel to the right, on the map
    for i in range(side):
        across, along = left - i * down, top + i * right
        for j in range(side):
            col, row = across >> _BITS, along >> _BITS
            inside = (col >= 0) & (col < cols) & (row >= 0) & (row < rows)
            view[np.uint64(i * side + j)] = flat[np.uint64(row * cols + col)] if inside else 0
            across += right
            along += down


@njit(cache=True, nogil=True)
def most_of_blocks(known: Grid, size: int) -> Grid:
    """Return the highest value of each block of ``size`` x ``size`` cells; the last ones may have fewer cells.

    The maximum over the rows of a block is computed for all columns at once, and then the maximum of each cell and
    a growing number of cells to its right, in loops that the compiler can vectorise.
    """
    rows, cols = known.shape
    high, wide = (rows + size - 1) // size, (cols + size - 1) // size
    out, flat, lines = np.empty((high, wide), np.uint8), known.ravel(), np.zeros((2, (wide + 1) * size), np.uint8)
    for i in range(high):
        most, other = lines[0], lines[1]
        most[:] = UNKNOWN
        for row in range(i * size, min((i + 1) * size, rows)):
            first = row * cols
            for col in range(cols):
                most[np.uint64(col)] = max(most[np.uint64(col)], flat[np.uint64(first + col)])
        span = 1
        while span < size:
            more = min(span, size - span)
            for col in range(wide * size):
                other[np.uint64(col)] = max(most[np.uint64(col)], most[np.uint64(col + more)])
            most, other = other, most
            span += more
        for j in range(wide):
            out[i, j] = most[np.uint64(j * size)]
    return out


@njit(cache=True, nogil=True)
def mark(picture: Grid, x: float, y: float, radius: float, value: int) -> None:
    """Draw a disc; if its centre lies outside the picture, it is drawn at the nearest place of the border."""
    side = len(picture)
    x, y = min(max(x, 0.5), side - 0.5), min(max(y, 0.5), side - 0.5)
    for row in range(max(math.floor(y - radius), 0), min(math.ceil(y + radius), side)):
        for col in range(max(math.floor(x - radius), 0), min(math.ceil(x + radius), side)):
            if (col + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2 <= radius**2:
                picture[row, col] = value
