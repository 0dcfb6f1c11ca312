"""Where the robot may stand in what its map shows, and how far it is to each such place.

R1  A cell is open where the map shows it free. Unknown cells, obstacles and all cells on the rim of the grid are not.
R2  Cells that the robot covers are open whatever the map shows of them: it stands there.
R3  The robot may stand in the middle of a cell where its disc meets no cell that is not open.
R4  It goes from one standing cell to the next of eight; across a corner only where it may stand in both cells beside.
R5  Ways are whole numbers: 70 straight on and 99 across, so that they are exact, and the square root of 2 is met by
    0.005%. A way begins where the robot is: with the straight line to the middle of its cell, or of one beside it (R4).

Only the rows and columns are looked at in which something is known.
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
    """Find where the robot may stand by its map, and the ways there from where it is.

    Parameters
    ----------
    known
        (rows, cols) the map: 0 unknown, 127 free, 255 obstacle.
    x, y
        Where the robot is, or believes to be, pixels.
    until
        Flat index of a cell: ways are found until its own is known; longer ones may be too long then, or ``NO_WAY``.
        -1: all are found.
    """
    _clear(found)
    find_box(known, x, y, radius_px, found.box)
    close_cells(known, x, y, radius_px, found)
    find_standing_cells(radius_px, found)
    _find_lengths(known.shape[0], x, y, radius_px, until, found)


@njit(cache=True, nogil=True)
def trace(found: KnownWays, goal: int, path: Cells) -> int:
    """Write the flat indices of the cells on the shortest way to a cell, from the robot on; return how many.

    Of ways equally long it is always the same one. 0 where there is no way, or ``path`` is too short.
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
    """Forget the last ways."""
    box, ways = found.box, found.ways
    for row in range(box[TOP], box[BOTTOM]):
        for cell in range(np.uint64(row * box[COLS] + box[LEFT]), np.uint64(row * box[COLS] + box[RIGHT])):
            ways[cell] = NO_STAND


@njit(cache=True, nogil=True)
def _start(rows: int, x: float, y: float, radius_px: float, found: KnownWays, starts: Cells) -> int:
    """Write the standing cells that a way begins with (R5), and their ways; return how many.

    They are the robot's own and those of its eight neighbours where it may stand, those across a corner by R4; where
    there is none, the nearest within its radius and two cells.
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
                    n, best = 0, -1.0  # none further off counts
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
    """Write the lengths of the ways (Dijkstra, with buckets of 70: no way within one is a part of another in it).

    A cell's neighbours are in the two buckets after its own, so three are enough, in turns. A cell is at most once in
    a bucket; where a shorter way was found meanwhile, it has had its turn in an earlier one.
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
