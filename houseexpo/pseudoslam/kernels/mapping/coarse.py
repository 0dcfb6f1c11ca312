"""Maps drawn at any scale, and marks on them.

R1  A pixel shows the most that is known of the cells that hold its sample points, at most a cell apart: an obstacle
    where one of them is, else free, else unknown. So no wall vanishes, however coarse the picture is.
R2  Where a pixel is two cells wide or more, blocks of as many whole cells as it is wide stand for the cells, each the
    most of its own. A wall may look a block thicker than it is.
R3  Off the map nothing is known.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import UNKNOWN
from houseexpo.pseudoslam.kernels.types import Grid

_EPS = 1e-9


@njit(cache=True, nogil=True)
def draw_coarse(known: Grid, x: float, y: float, cos: float, sin: float, pixel: float, out: Grid) -> None:
    """Draw the square of the map round a position, in pixels of so many cells, by R1 to R3.

    Parameters
    ----------
    x, y
        The middle of the picture, cells.
    cos, sin
        Of the direction that is up, counter-clockwise from the map's right.
    out
        (side, side).
    """
    size = max(int(pixel + _EPS), 1)
    parts = math.ceil(pixel / size - _EPS)
    blocks = known if size == 1 else most_of_blocks(known, size)
    rows, cols = blocks.shape
    side, step = len(out), pixel / (parts * size)  # in blocks
    middle = (side * parts - 1) / 2
    left, top = x / size + step * middle * (cos - sin), y / size - step * middle * (cos + sin)
    for i in range(side):
        for j in range(side):
            most = UNKNOWN
            for a in range(parts):
                for b in range(parts):
                    back, right = step * (i * parts + a), step * (j * parts + b)
                    row = math.floor(top + right * cos + back * sin)
                    col = math.floor(left + right * sin - back * cos)
                    if 0 <= row < rows and 0 <= col < cols:
                        most = max(most, blocks[row, col])
            out[i, j] = most


@njit(cache=True, nogil=True)
def draw_nearest(grid: Grid, x: float, y: float, cos: float, sin: float, pixel: float, out: Grid) -> None:
    """Draw the same square of a grid of numbers: a pixel is the cell that holds its middle, 0 off the grid."""
    rows, cols = grid.shape
    side = len(out)
    middle = (side - 1) / 2
    for i in range(side):
        for j in range(side):
            up, right = (middle - i) * pixel, (j - middle) * pixel
            row, col = math.floor(y - up * sin + right * cos), math.floor(x + up * cos + right * sin)
            out[i, j] = grid[row, col] if 0 <= row < rows and 0 <= col < cols else 0


@njit(cache=True, nogil=True)
def most_of_blocks(known: Grid, size: int) -> Grid:
    """Return the highest value of each block of ``size`` x ``size`` cells; the last ones may hold fewer."""
    rows, cols = known.shape
    out = np.zeros(((rows + size - 1) // size, (cols + size - 1) // size), np.uint8)
    most = np.empty(cols, np.uint8)
    for row in range(len(out)):
        most[:] = UNKNOWN
        for r in range(row * size, min((row + 1) * size, rows)):
            for col in range(cols):
                most[col] = max(most[col], known[r, col])
        for col in range(cols):
            out[row, col // size] = max(out[row, col // size], most[col])
    return out


@njit(cache=True, nogil=True)
def mark(picture: Grid, x: float, y: float, radius: float, value: int) -> None:
    """Draw a disc; one whose middle lies off the picture is drawn at its rim, in the nearest place."""
    side = len(picture)
    x, y = min(max(x, 0.5), side - 0.5), min(max(y, 0.5), side - 0.5)
    for row in range(max(math.floor(y - radius), 0), min(math.ceil(y + radius), side)):
        for col in range(max(math.floor(x - radius), 0), min(math.ceil(x + radius), side)):
            if (col + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2 <= radius**2:
                picture[row, col] = value
