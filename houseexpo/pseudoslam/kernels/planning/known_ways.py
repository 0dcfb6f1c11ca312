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

from houseexpo.pseudoslam.kernels.mapping.merge import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.motion.bodies import cell_meets_disc
from houseexpo.pseudoslam.kernels.planning.plan import ACROSS, STRAIGHT
from houseexpo.pseudoslam.kernels.types import NO_STAND, NO_WAY, Cells, Counts, Grid, KnownWays

_EPS = 1e-9  # pixels
_TOP, _BOTTOM, _LEFT, _RIGHT, _COLS = range(5)


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
    _find_box(known, x, y, radius_px, found.box)
    _close(known, x, y, radius_px, found)
    _find_standing(radius_px, found)
    _find_lengths(known.shape[0], x, y, radius_px, until, found)


@njit(cache=True, nogil=True)
def trace(found: KnownWays, goal: int, path: Cells) -> int:
    """Write the flat indices of the cells on the shortest way to a cell, from the robot on; return how many.

    Of ways equally long it is always the same one. 0 where there is no way, or ``path`` is too short.
    """
    ways, cols = found.ways, found.box[_COLS]
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
            path[:n] = path[:n][::-1].copy()
            return n
        cell = before
    return 0


@njit(cache=True, nogil=True)
def _clear(found: KnownWays) -> None:
    """Forget the last ways."""
    box, ways = found.box, found.ways
    for row in range(box[_TOP], box[_BOTTOM]):
        ways[row * box[_COLS] + box[_LEFT] : row * box[_COLS] + box[_RIGHT]] = NO_STAND


@njit(cache=True, nogil=True)
def _find_box(known: Grid, x: float, y: float, radius_px: float, box: Counts) -> None:
    """Write the rows and columns in which something is known or the robot stands, and one more on each side."""
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
    box[_TOP], box[_LEFT] = min(max(top - 1, 0), rows), min(max(left - 1, 0), cols)
    box[_BOTTOM], box[_RIGHT] = max(min(bottom + 1, rows), box[_TOP]), max(min(right + 1, cols), box[_LEFT])
    box[_COLS] = cols


@njit(cache=True, nogil=True)
def _close(known: Grid, x: float, y: float, radius_px: float, found: KnownWays) -> None:
    """Say which cells are not open (R1, R2); those on the box's rim are not, for they are unknown or on the grid's."""
    rows, cols = known.shape
    flat, closed, box = known.ravel(), found.closed, found.box
    for row in range(box[_TOP], box[_BOTTOM]):
        for cell in range(np.uint64(row * cols + box[_LEFT]), np.uint64(row * cols + box[_RIGHT])):
            closed[cell] = flat[cell] != FREE
    for row in range(max(math.floor(y - radius_px), 1), min(math.floor(y + radius_px) + 1, rows - 1)):
        for col in range(max(math.floor(x - radius_px), 1), min(math.floor(x + radius_px) + 1, cols - 1)):
            if cell_meets_disc(row, col, x, y, radius_px):
                closed[row * cols + col] = 0
    if box[_BOTTOM] > box[_TOP] and box[_RIGHT] > box[_LEFT]:
        for row in range(box[_TOP], box[_BOTTOM]):
            closed[row * cols + box[_LEFT]], closed[row * cols + box[_RIGHT] - 1] = 1, 1
        for col in range(box[_LEFT], box[_RIGHT]):
            closed[box[_TOP] * cols + col], closed[(box[_BOTTOM] - 1) * cols + col] = 1, 1


@njit(cache=True, nogil=True)
def _find_standing(radius_px: float, found: KnownWays) -> None:
    """Set ``ways`` to ``NO_WAY`` in standing cells (R3): column by column how far closed cells are, then along rows.

    Columns and rows are taken many cells at a time: each inner loop runs over cells side by side in memory.
    """
    closed, ways, box = found.closed, found.ways, found.box
    cols, left, wide = box[_COLS], box[_LEFT], box[_RIGHT] - box[_LEFT]
    high = box[_BOTTOM] - box[_TOP]
    reach = math.ceil(radius_px + 0.5)
    far = np.int16(reach + 2)
    within = np.empty(reach + 1, np.int64)  # rows up or down within which a closed cell so many columns off is met
    for across in range(reach + 1):
        within[across] = -1
        for down in range(reach + 1):
            if math.hypot(max(across - 0.5, 0.0), max(down - 0.5, 0.0)) < radius_px - _EPS:
                within[across] = down
    above = np.zeros((high + 2, wide), np.int16)  # rows to the next closed cell; the first and last stand for outside
    for i in range(high):
        line = (box[_TOP] + i) * cols + left
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
        line = np.uint64((box[_TOP] + i) * cols + left)
        for j in range(np.uint64(wide)):
            ways[line + j] = np.int32(NO_STAND) if met[j] != 0 else np.int32(NO_WAY)


@njit(cache=True, nogil=True)
def _start(rows: int, x: float, y: float, radius_px: float, found: KnownWays, starts: Cells) -> int:
    """Write the standing cells that a way begins with (R5), and their ways; return how many.

    They are the robot's own and those of its eight neighbours where it may stand, those across a corner by R4; where
    there is none, the nearest within its radius and two cells.
    """
    ways, cols = found.ways, found.box[_COLS]
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
    ways, queue, cols = found.ways, found.queue, found.box[_COLS]
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
