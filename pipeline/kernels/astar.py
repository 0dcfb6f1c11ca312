"""A* on a grid of free cells (Algorithm 1, line 13)."""

from __future__ import annotations

import heapq

import numpy as np
import numpy.typing as npt
from numba import njit

DIAGONAL = 2.0**0.5


@njit(cache=True)
def octile(rows: int, cols: int) -> float:
    """Length of the shortest 8-connected path over so many rows and columns where nothing stands, in cells."""
    low, high = min(abs(rows), abs(cols)), max(abs(rows), abs(cols))
    return high - low + DIAGONAL * low


@njit(cache=True)
def shortest_path(
    free: npt.NDArray[np.bool_], start_row: int, start_col: int, goal_row: int, goal_col: int
) -> npt.NDArray[np.int64]:
    """Cells of a shortest 8-connected path that cuts no corner: a diagonal step needs both cells beside it free.

    Parameters
    ----------
    free
        (rows, cols) bool.
    start_row, start_col, goal_row, goal_col
        Free cells of the grid.

    Returns
    -------
    (n, 2) int64 cells (row, col) from start to goal, (0, 2) where there is no path.
    """
    rows, cols = free.shape
    start, goal = start_row * cols + start_col, goal_row * cols + goal_col
    length = np.full(rows * cols, np.inf)
    before = np.full(rows * cols, -1, np.int64)
    closed = np.zeros(rows * cols, np.bool_)
    length[start] = 0.0
    heap = [(octile(goal_row - start_row, goal_col - start_col), start)]
    while len(heap) > 0 and not closed[goal]:
        here = heapq.heappop(heap)[1]
        if closed[here]:
            continue
        closed[here] = True
        row, col = here // cols, here % cols
        for down in range(-1, 2):
            for right in range(-1, 2):
                r, c = row + down, col + right
                if not (0 <= r < rows and 0 <= c < cols) or not (free[r, c] and free[row, c] and free[r, col]):
                    continue
                there = r * cols + c
                longer = length[here] + (DIAGONAL if down != 0 and right != 0 else 1.0)
                if not closed[there] and longer < length[there]:
                    length[there], before[there] = longer, here
                    heapq.heappush(heap, (longer + octile(goal_row - r, goal_col - c), there))
    if not closed[goal]:
        return np.empty((0, 2), np.int64)
    steps = 1
    at = goal
    while at != start:
        at = before[at]
        steps += 1
    path = np.empty((steps, 2), np.int64)
    at = goal
    for k in range(steps - 1, -1, -1):
        path[k, 0], path[k, 1] = at // cols, at % cols
        at = before[at]
    return path
