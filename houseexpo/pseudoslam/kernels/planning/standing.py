"""The cells where the robot can stand according to its map: rules R1 to R3 of ``known_ways``."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.motion.bodies import cell_meets_disc
from houseexpo.pseudoslam.kernels.types import NO_STAND, NO_WAY, Counts, Grid, KnownWays

_EPS = 1e-9  # pixels
TOP, BOTTOM, LEFT, RIGHT, COLS = range(5)
"""In ``KnownWays.box``."""


@njit(cache=True, nogil=True)
def find_box(known: Grid, x: float, y: float, radius_px: float, box: Counts) -> None:
    """Write the rows and columns with known cells or the robot, plus one more on each side."""
    rows, cols = known.shape
    flat = known.ravel()
    by_col = np.zeros(cols, np.uint8)
    top, bottom = rows, 0
    for row in range(rows):
        some, first = np.uint8(0), np.uint64(row * cols)
        for col in range(np.uint64(cols)):
            some |= flat[first + col]
            by_col[col] |= flat[first + col]
        if some != UNKNOWN:
            top, bottom = min(top, row), row + 1
    left, right = cols, 0
    for col in range(cols):
        if by_col[col] != UNKNOWN:
            left, right = min(left, col), col + 1
    reach = radius_px + 1.0
    top, bottom = min(top, math.floor(y - reach)), max(bottom, math.floor(y + reach) + 1)
    left, right = min(left, math.floor(x - reach)), max(right, math.floor(x + reach) + 1)
    box[TOP], box[LEFT] = min(max(top - 1, 0), rows), min(max(left - 1, 0), cols)
    box[BOTTOM], box[RIGHT] = max(min(bottom + 1, rows), box[TOP]), max(min(right + 1, cols), box[LEFT])
    box[COLS] = cols


@njit(cache=True, nogil=True)
def close_cells(known: Grid, x: float, y: float, radius_px: float, found: KnownWays) -> None:
    """Mark the cells that are not open (R1, R2), including the box's rim, which is unknown or the grid's border."""
    rows, cols = known.shape
    flat, closed, box = known.ravel(), found.closed, found.box
    for row in range(box[TOP], box[BOTTOM]):
        for cell in range(np.uint64(row * cols + box[LEFT]), np.uint64(row * cols + box[RIGHT])):
            closed[cell] = flat[cell] != FREE
    for row in range(max(math.floor(y - radius_px), 1), min(math.floor(y + radius_px) + 1, rows - 1)):
        for col in range(max(math.floor(x - radius_px), 1), min(math.floor(x + radius_px) + 1, cols - 1)):
            if cell_meets_disc(row, col, x, y, radius_px):
                closed[row * cols + col] = 0
    if box[BOTTOM] > box[TOP] and box[RIGHT] > box[LEFT]:
        for row in range(box[TOP], box[BOTTOM]):
            closed[row * cols + box[LEFT]], closed[row * cols + box[RIGHT] - 1] = 1, 1
        for col in range(box[LEFT], box[RIGHT]):
            closed[box[TOP] * cols + col], closed[(box[BOTTOM] - 1) * cols + col] = 1, 1


@njit(cache=True, nogil=True)
def find_standing_cells(radius_px: float, found: KnownWays) -> None:
    """Set ``ways`` to ``NO_WAY`` in standing cells (R3), from distances to closed cells in columns and then along rows.

    Each inner loop runs over cells that are adjacent in memory, so that many cells are processed at a time.
    """
    closed, ways, box = found.closed, found.ways, found.box
    cols, left, wide = box[COLS], box[LEFT], box[RIGHT] - box[LEFT]
    high = box[BOTTOM] - box[TOP]
    reach = math.ceil(radius_px + 0.5)
    far = np.int16(reach + 2)
    within = np.empty(reach + 1, np.int64)  # rows within which a closed cell so many columns away is touched
    for across in range(reach + 1):
        within[across] = -1
        for down in range(reach + 1):
            if math.hypot(max(across - 0.5, 0.0), max(down - 0.5, 0.0)) < radius_px - _EPS:
                within[across] = down
    above = np.zeros((high + 2, wide), np.int16)  # rows to the next closed cell; the first and last are outside
    for i in range(high):
        line = (box[TOP] + i) * cols + left
        for j in range(np.uint64(wide)):
            nearer = min(np.int16(above[i, j] + np.int16(1)), far)
            above[i + 1, j] = np.int16(0) if closed[np.uint64(line) + j] != 0 else nearer
    for i in range(high, 0, -1):
        for j in range(np.uint64(wide)):
            above[i, j] = min(above[i, j], np.int16(above[i + 1, j] + np.int16(1)))
    met = np.empty(wide, np.uint8)
    for i in range(high):
        near = above[i + 1]
        met[:] = 0
        for across in range(-reach, reach + 1):
            rows_off = within[abs(across)]
            if rows_off >= 0:
                least = np.int16(rows_off)
                for j in range(np.uint64(max(0, -across)), np.uint64(max(min(wide, wide - across), 0))):
                    met[j] |= near[np.uint64(np.int64(j) + across)] <= least
        line = np.uint64((box[TOP] + i) * cols + left)
        for j in range(np.uint64(wide)):
            ways[line + j] = np.int32(NO_STAND) if met[j] != 0 else np.int32(NO_WAY)
