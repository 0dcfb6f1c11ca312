"""Places from which a cell of the map can be seen: rule R3 of ``frontiers``."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import NO_WAY, Grid, KnownWays, Offsets, Scratch

_LINES = 32  # largest number of standing cells whose lines to a middle are checked


@njit(cache=True, nogil=True)
def goal_near(known: Grid, middle: int, near: Offsets, found: KnownWays) -> int:
    """Return the nearest standing cell with a path and a clear line to a cell (R3), -1 if none of the first few has."""
    rows, cols = known.shape
    row, col = middle // cols, middle % cols
    lines = 0
    for k in range(len(near)):
        r, c = row + np.int64(near[k, 0]), col + np.int64(near[k, 1])
        if not (0 <= r < rows and 0 <= c < cols):
            continue
        way = found.ways[r * cols + c]
        if way < 0 or way == NO_WAY:
            continue
        if is_clear(known, r, c, row, col):
            return int(r * cols + c)
        lines += 1
        if lines >= _LINES:
            break
    return -1


@njit(cache=True, nogil=True)
def is_clear(known: Grid, row: int, col: int, to_row: int, to_col: int) -> bool:
    """Return whether the line between the centres of two cells crosses only free cells, not counting these two.

    A line through a corner is clear if one of the two squares beside it is free.
    """
    down, right = abs(to_row - row), abs(to_col - col)
    step_row, step_col = (1 if to_row > row else -1), (1 if to_col > col else -1)
    i, j = 0, 0
    while i < down or j < right:
        turn = (1 + 2 * j) * down - (1 + 2 * i) * right  # below 0: the next border that is crossed is between columns
        if turn == 0:
            beside, above = known[row, col + step_col], known[row + step_row, col]
            if FREE not in (beside, above):
                return False
        if turn <= 0:
            j, col = j + 1, col + step_col
        if turn >= 0:
            i, row = i + 1, row + step_row
        if (row != to_row or col != to_col) and known[row, col] != FREE:
            return False
    return True


@njit(cache=True, nogil=True)
def open_unknown(known: Grid, found: KnownWays) -> None:
    """Open unknown cells, so that only obstacles and the box's rim are closed."""
    flat, closed, box = known.ravel(), found.closed, found.box
    for row in range(box[0] + 1, box[1] - 1):
        line = row * known.shape[1]
        for cell in range(np.uint64(line + box[2] + 1), np.uint64(max(line + box[3] - 1, 0))):
            closed[cell] &= flat[cell] != UNKNOWN


@njit(cache=True, nogil=True)
def goal_in_sight(known: Grid, middle: int, range_px: float, scratch: Scratch) -> int:
    """Return the nearest standing cell with a path that sees a cell (R3), -1 if there is none."""
    found, (rows, cols) = scratch.ways, known.shape
    closed = found.closed[: rows * cols].reshape((rows, cols))
    row, col = middle // cols, middle % cols
    before, closed[row, col] = closed[row, col], 0
    n_runs, _ = sector_scan(
        closed, col + 0.5, row + 0.5, 0.0, math.pi, range_px, scratch.runs, scratch.hit, scratch.slopes
    )
    closed[row, col] = before
    best, least = -1, 0
    for k in range(n_runs):
        for cell in range(scratch.runs[k, 0], scratch.runs[k, 1] + 1):
            way = found.ways[cell]
            if way >= 0 and way != NO_WAY:
                off = (cell // cols - row) ** 2 + (cell % cols - col) ** 2
                if best < 0 or off < least or (off == least and cell < best):
                    best, least = cell, off
    return best
