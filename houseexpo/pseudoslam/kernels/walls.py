"""Measure the length of a line inside walls, in compiled loops: how radio between robots of a team fades."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.types import Grid


@njit(cache=True, nogil=True)
def length_in_walls(occupied: Grid, x: float, y: float, to_x: float, to_y: float) -> float:
    """Return how much of the straight line between two points, which are on the grid, lies in occupied cells, pixels.

    The line is followed from cell to cell (Amanatides and Woo, 1987).
    """
    rows, cols = occupied.shape
    way = math.hypot(to_x - x, to_y - y)
    if way == 0.0:
        return 0.0
    right, down = (to_x - x) / way, (to_y - y) / way
    row, col = int(y), int(x)
    next_x = math.inf if right == 0.0 else ((col + 1 - x) if right > 0.0 else (col - x)) / right
    next_y = math.inf if down == 0.0 else ((row + 1 - y) if down > 0.0 else (row - y)) / down
    step_x = math.inf if right == 0.0 else abs(1.0 / right)
    step_y = math.inf if down == 0.0 else abs(1.0 / down)
    gone, found = 0.0, 0.0
    while gone < way and 0 <= row < rows and 0 <= col < cols:
        until = min(next_x, next_y, way)
        if occupied[row, col] != 0:
            found += until - gone
        gone = until
        if next_x <= next_y:
            col += 1 if right > 0.0 else -1
            next_x += step_x
        else:
            row += 1 if down > 0.0 else -1
            next_y += step_y
    return found
