"""Measure the length of a line inside walls; mark the cells that a disc sweeps where no wall is between; for teams."""

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


@njit(cache=True, nogil=True)
def mark_swept_cells(
    walls: Grid, x: float, y: float, to_x: float, to_y: float, radius: float, wanted: Grid, under: Grid
) -> None:
    """Mark the cells that a disc sweeps on a straight way, in ``under``, which is 0 before.

    A cell is swept if it is ``wanted``, its centre is within ``radius`` of the way, and no wall is between it and the
    nearest place of the way. All are (rows, cols) or pixels.
    """
    rows, cols = walls.shape
    right, down = to_x - x, to_y - y
    square = right * right + down * down
    top, bottom = max(int(min(y, to_y) - radius), 0), min(int(max(y, to_y) + radius) + 1, rows)
    left, last = max(int(min(x, to_x) - radius), 0), min(int(max(x, to_x) + radius) + 1, cols)
    for row in range(top, bottom):
        for col in range(left, last):
            if wanted[row, col] == 0:
                continue
            off_x, off_y = col + 0.5 - x, row + 0.5 - y
            along = 0.0
            if square > 0.0:
                along = min(max((off_x * right + off_y * down) / square, 0.0), 1.0)
            near_x, near_y = x + along * right, y + along * down
            if (col + 0.5 - near_x) ** 2 + (row + 0.5 - near_y) ** 2 > radius * radius:
                continue
            if length_in_walls(walls, near_x, near_y, col + 0.5, row + 0.5) == 0.0:
                under[row, col] = 1


@njit(cache=True, nogil=True)
def mark_sweepable_cells(walls: Grid, standing: Grid, radius: float, wanted: Grid, found: Grid) -> None:
    """Mark the ``wanted`` cells that a disc of ``radius`` pixels sweeps from the centre of some ``standing`` cell."""
    rows, cols = walls.shape
    reach = math.ceil(radius)
    for row in range(rows):
        for col in range(cols):
            if wanted[row, col] == 0:
                continue
            if standing[row, col] != 0:
                found[row, col] = 1
                continue
            for i in range(max(row - reach, 0), min(row + reach + 1, rows)):
                for j in range(max(col - reach, 0), min(col + reach + 1, cols)):
                    if standing[i, j] == 0 or found[row, col] != 0 or (i - row) ** 2 + (j - col) ** 2 > radius**2:
                        continue
                    if length_in_walls(walls, j + 0.5, i + 0.5, col + 0.5, row + 0.5) == 0.0:
                        found[row, col] = 1
