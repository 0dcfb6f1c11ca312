"""The cells where the robot can stand according to its map, and the distances to them.

R1  A cell is open if the map shows it free. Unknown cells, obstacles and all cells on the border of the grid are not.
R2  Cells that the robot covers are open whatever the map shows, since the robot is there.
R3  The robot can stand at the centre of a cell if its disc touches only open cells.
R4  It goes from a standing cell to one of its eight neighbours, diagonally only if it can stand in both cells beside.
R5  Distances are whole numbers, 70 for a straight step and 99 for a diagonal one, so that they are exact and the square
    root of 2 has an error of 0.005%. A path starts at the robot, with the straight line to the centre of its cell, or
    of one beside it (R4).

Only rows and columns with known cells are processed.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.planning.plan import ACROSS, STRAIGHT
from houseexpo.pseudoslam.kernels.planning.standing import (
    BOTTOM,
    COLS,
    LEFT,
    RIGHT,
    TOP,
    close_cells,
    find_box,
    find_standing_cells,
)
from houseexpo.pseudoslam.kernels.types import NO_STAND, NO_WAY, Cells, Grid, KnownWays


@njit(cache=True, nogil=True)
def find_ways(known: Grid, x: float, y: float, radius_px: float, until: int, found: KnownWays) -> None:
    """Find the cells where the robot can stand by its map, and the distances to them.

    Parameters
    ----------
    known
        (rows, cols), the map: 0 unknown, 127 free, 255 obstacle.
    x, y
        The robot's true or believed position, pixels.
    until
        Flat index of a cell: the search ends when its distance is known; larger distances may then be too large, or
        ``NO_WAY``. With -1, all are computed.
    """
    _clear(found)
    find_box(known, x, y, radius_px, found.box)
    close_cells(known, x, y, radius_px, found)
    find_standing_cells(radius_px, found)
    _find_lengths(known.shape[0], x, y, radius_px, until, found)


@njit(cache=True, nogil=True)
def trace(found: KnownWays, goal: int, path: Cells) -> int:
    """Write the flat indices of the cells on the shortest path from the robot to a cell; return their number.

    Of equally short paths, always the same one is used. The result is 0 if there is no path or ``path`` is too short.
    """
    ways, cols = found.ways, found.box[COLS]
    if goal < 0 or goal >= len(ways) or ways[goal] < 0 or ways[goal] == NO_WAY:
        return 0
    steps = (1, -1, cols, -cols)
    cell, n = goal, 0
    while n < len(path):
        path[n] = cell
        n += 1
        before = -1
        for k in range(4):
            beside = cell + steps[k]
            if ways[beside] >= 0 and ways[beside] == ways[cell] - STRAIGHT:
                before = beside
        for k in range(4):
            one, other = steps[k // 2], steps[2 + k % 2]
            beside = cell + one + other
            corner = ways[cell + one] >= 0 and ways[cell + other] >= 0  # R4
            if before < 0 and corner and ways[beside] >= 0 and ways[beside] == ways[cell] - ACROSS:
                before = beside
        if before < 0:
            for k in range(n // 2):  # from the robot on
                path[k], path[n - 1 - k] = path[n - 1 - k], path[k]
            return n
        cell = before
    return 0


@njit(cache=True, nogil=True)
def _clear(found: KnownWays) -> None:
    """Clear the last distances."""
    box, ways = found.box, found.ways
    for row in range(box[TOP], box[BOTTOM]):
        for cell in range(np.uint64(row * box[COLS] + box[LEFT]), np.uint64(row * box[COLS] + box[RIGHT])):
            ways[cell] = NO_STAND


@njit(cache=True, nogil=True)
def _start(rows: int, x: float, y: float, radius_px: float, found: KnownWays, starts: Cells) -> int:
    """Write the standing cells at which paths start (R5), and their distances; return their number.

    They are the robot's own cell and its eight neighbours, as far as it can stand there, diagonal ones by R4; if there
    are none, the nearest cell within its radius plus two cells.
    """
    ways, cols = found.ways, found.box[COLS]
    col, row = math.floor(x), math.floor(y)
    n, reach, best = 0, math.ceil(radius_px) + 2, math.inf
    for r in range(max(row - reach, 1), min(row + reach + 1, rows - 1)):
        for c in range(max(col - reach, 1), min(col + reach + 1, cols - 1)):
            cell = r * cols + c
            if ways[cell] != NO_STAND:
                off = math.hypot(c + 0.5 - x, r + 0.5 - y)
                is_near = max(abs(r - row), abs(c - col)) <= 1
                if is_near and r != row and c != col:
                    is_near = ways[r * cols + col] != NO_STAND and ways[row * cols + c] != NO_STAND
                if is_near and best >= 0.0:
                    n, best = 0, -1.0  # farther ones do not count
                if is_near or off < best:
                    starts[n if is_near else 0] = cell
                    n = n + 1 if is_near else 1
                    best = best if is_near else off
    for i in range(n):
        cell = starts[i]
        ways[cell] = round(STRAIGHT * math.hypot(cell % cols + 0.5 - x, cell // cols + 0.5 - y))
    return n


@njit(cache=True, nogil=True)
def _find_lengths(rows: int, x: float, y: float, radius_px: float, until: int, found: KnownWays) -> None:
    """Compute the distances by Dijkstra's algorithm with buckets of 70, in which no path is a part of another one.

    A cell's neighbours are in the two buckets after its own, so that three buckets are enough, used in turn. A cell is
    at most once in a bucket; if a shorter path was found meanwhile, it was already processed in an earlier one.
    """
    ways, queue, cols = found.ways, found.queue, found.box[COLS]
    starts = np.empty(9, np.int32)
    n = _start(rows, x, y, radius_px, found, starts)
    if n == 0:
        return
    low = np.int32(NO_WAY)
    for i in range(n):
        low = min(low, ways[starts[i]])
    low = np.int32(low // STRAIGHT * STRAIGHT)
    now, waiting = 0, np.zeros(3, np.int64)
    for i in range(n):
        bucket = (ways[starts[i]] - low) // STRAIGHT
        queue[bucket, waiting[bucket]] = starts[i]
        waiting[bucket] += 1
    one, two, three = waiting[0], waiting[1], waiting[2]
    while one + two + three > 0:
        this, after, last = queue[now], queue[(now + 1) % 3], queue[(now + 2) % 3]
        first, second = np.int32(low + STRAIGHT), np.int32(low + 2 * STRAIGHT)
        for i in range(one):
            cell = np.int64(this[i])
            way = ways[cell]
            if way < low:
                continue
            east, west = ways[cell + 1] >= 0, ways[cell - 1] >= 0
            south, north = ways[cell + cols] >= 0, ways[cell - cols] >= 0
            for k in range(8):
                if k < 4:
                    beside = cell + (1 if k == 0 else -1 if k == 1 else cols if k == 2 else -cols)
                    longer = np.int32(way + STRAIGHT)
                else:  # R4
                    if not ((east if k < 6 else west) and (south if k % 2 == 0 else north)):
                        continue
                    beside = cell + (1 if k < 6 else -1) + (cols if k % 2 == 0 else -cols)
                    longer = np.int32(way + ACROSS)
                before = ways[beside]
                if before <= longer:
                    continue
                ways[beside] = longer
                if longer < second:
                    if before >= second:
                        after[two] = beside
                        two += 1
                elif before >= second + STRAIGHT:
                    last[three] = beside
                    three += 1
        if until >= 0 and ways[until] < first:
            return
        now, low = (now + 1) % 3, first
        one, two, three = two, three, 0
