"""Find frontiers, clusters of unknown cells beside free ones on the robot's map, and a place that sees each of them.

R1  A frontier's cell is unknown and shares a side with a free cell. Cells close to one that was given up are ignored.
R2  Cells that share a side or a corner are one cluster, up to ``reach`` rows and columns from its first cell in row
    order. Cells beyond that start another cluster, since the middle of a long cluster says little about its cells. The
    middle is the cell closest to the mean of the cells that can be seen (R3); of several, the first in row order.
R3  The goal is the nearest standing cell, within ``near``, with a path to it and a clear line to the cluster's middle,
    which crosses only free cells. If there is none, it is the nearest cell within the laser's range from which no
    obstacle hides the middle (``sector_scan``); unknown cells do not hide it, since they will be seen first. Of equally
    near cells, the first in row order is used.
R4  A cluster is ignored if none of its cells can be seen from anywhere. A cluster behind a doorway, beside a beam that
    went through it, has cells in front of and behind the wall, so that its mean may not be visible from anywhere.
R5  Clusters of at least ``large`` cells come first, sorted by the distance to their goals; then the smaller ones,
    sorted likewise. Of equal distances, the first middle in row order comes first.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import FrontierRules
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.tolerances import MOST_LINES
from houseexpo.pseudoslam.kernels.types import (
    NO_WAY,
    Cells,
    Floats,
    Grid,
    Offsets,
    PathScratch,
    Rows,
    Scratch,
    as_bool,
    as_int64,
)


@njit(cache=True, nogil=True)
def find_frontiers(
    known: Grid,
    x: float,
    y: float,
    rules: FrontierRules,
    given_up: Cells,
    scratch: Scratch,
    frontiers: Rows,
) -> int:
    """Compute all distances (``find_distances``), and find the frontiers; return the number of frontiers written.

    Parameters
    ----------
    known
        (rows, cols), the map: 0 unknown, 127 free, 255 obstacle.
    x, y
        The robot's true or believed position, pixels.
    given_up
        Flat indices of cells that remained unknown after the robot looked at them (R1).
    scratch
        Working memory for a full scan within ``rules.range_px``; its ``ways`` are output.
    frontiers
        (n,) ``FRONTIER``, output: the first n frontiers (R5).
    """
    found = scratch.ways
    find_distances(known, x, y, rules.radius_px, as_int64(-1), found)
    n_edges = _find_edges(known, rules.spare_px, given_up, found)
    edges, members, marks = found.queue[0], found.queue[1], found.marks
    n, sees_through = as_int64(0), as_bool(False)
    for k in range(n_edges):
        if marks[edges[k]] == 0:
            continue  # already in a cluster
        cells = _flood(known.shape, marks, edges[k], rules.reach, members)
        if cells < rules.least or len(frontiers) == 0:
            continue
        middle, goal, sees_through = _viewpoint(known, members[:cells], rules, scratch, sees_through)
        if goal >= 0:
            n = _insert(frontiers, n, middle, goal, cells, found.ways[goal], rules.large)
    return n


@njit(cache=True, nogil=True)
def _find_edges(known: Grid, spare_px: float, given_up: Cells, found: PathScratch) -> int:
    """List the frontiers' cells (R1) in row order in the queue's first row, and mark them; return their number."""
    rows, cols = known.shape
    flat, edges, marks, box = known.ravel(), found.queue[0], found.marks, found.box
    first_col, wide = box[2], box[3] - box[2]
    line = np.zeros((wide + 7) // 8 * 8, np.uint8)
    words = line.view(np.uint64)
    n = 0
    for row in range(box[0], box[1]):
        line[:] = 0
        start = np.uint64(row * cols + first_col)
        if row > 0:
            for j in range(np.uint64(wide)):
                line[j] |= flat[start - np.uint64(cols) + j] == FREE
        if row < rows - 1:
            for j in range(np.uint64(wide)):
                line[j] |= flat[start + np.uint64(cols) + j] == FREE
        for j in range(np.uint64(1), np.uint64(max(wide, 1))):
            line[j] |= flat[start + j - np.uint64(1)] == FREE
        for j in range(np.uint64(max(wide - 1, 0))):
            line[j] |= flat[start + j + np.uint64(1)] == FREE
        for j in range(np.uint64(wide)):
            line[j] &= flat[start + j] == UNKNOWN
        for word in range(len(words)):
            if words[word] == 0:
                continue
            for j in range(8 * word, 8 * word + 8):
                if line[j] != 0 and _is_wanted(row, first_col + j, cols, spare_px, given_up):
                    edges[n] = row * cols + first_col + j
                    marks[edges[n]] = 1
                    n += 1
    return n


@njit(cache=True, nogil=True)
def _is_wanted(row: int, col: int, cols: int, spare_px: float, given_up: Cells) -> bool:
    """Return whether no cell close to this one was given up."""
    for k in range(len(given_up)):
        down, right = given_up[k] // cols - row, given_up[k] % cols - col
        if down * down + right * right <= spare_px * spare_px:
            return False
    return True


@njit(cache=True, nogil=True)
def _flood(shape: tuple[int, int], marks: Grid, start: int, reach: int, members: Cells) -> int:
    """List the marked cells that are connected with one (R2), and remove their marks; return their number."""
    rows, cols = shape
    top, bottom = max(start // cols - reach, 0), min(start // cols + reach + 1, rows)
    left, right = max(start % cols - reach, 0), min(start % cols + reach + 1, cols)
    members[0], n, done = start, 1, 0
    marks[start] = 0
    while done < n:
        row, col = members[done] // cols, members[done] % cols
        done += 1
        for r in range(max(row - 1, top), min(row + 2, bottom)):
            for c in range(max(col - 1, left), min(col + 2, right)):
                if marks[r * cols + c] != 0:
                    marks[r * cols + c] = 0
                    members[n] = r * cols + c
                    n += 1
    return n


@njit(cache=True, nogil=True)
def _viewpoint(
    known: Grid, members: Cells, rules: FrontierRules, scratch: Scratch, sees_through: bool
) -> tuple[int, int, bool]:
    """Return a cluster's middle and its goal (R3), -1 without a goal, and whether unknown cells now count as open."""
    cols, found, goal, middle = known.shape[1], scratch.ways, -1, -1
    rows_sum, cols_sum = as_int64(0), as_int64(0)
    for k in range(len(members)):
        rows_sum += members[k] // cols
        cols_sum += members[k] % cols
    for left in range(len(members), 0, -1):
        k = _nearest(members, left, rows_sum, cols_sum, cols)
        middle = int(members[k])
        goal = find_clear_goal(known, middle, rules.near, found)
        if goal < 0:
            if not sees_through:
                open_unknown_cells(known, found)
                sees_through = True
            goal = find_seeing_goal(known, middle, rules.range_px, scratch)
        if goal >= 0:
            break
        members[k], members[left - 1] = members[left - 1], members[k]  # already tried
    return middle, goal, sees_through


@njit(cache=True, nogil=True)
def _nearest(members: Cells, left: int, rows_sum: int, cols_sum: int, cols: int) -> int:
    """Return the index of the first cell closest to the mean of all (R2), computed with integers."""
    n, best, least = len(members), -1, 0
    for k in range(left):
        cell = int(members[k])
        down, right = cell // cols * n - rows_sum, cell % cols * n - cols_sum
        off = down * down + right * right
        if best < 0 or off < least or (off == least and cell < members[best]):
            best, least = k, off
    return best


@njit(cache=True, nogil=True)
def _insert(frontiers: Rows, n: int, middle: int, goal: int, cells: int, way: int, large: int) -> int:
    """Insert a cluster in order among n others (R5), dropping the last one if there is no space; return the new n."""
    at = min(n, len(frontiers) - 1)
    is_large = cells >= large
    if n == len(frontiers):
        last = frontiers[at]
        if not _is_before(is_large, way, middle, last.cells >= large, last.way, last.middle):
            return n
    while at > 0:
        other = frontiers[at - 1]
        if not _is_before(is_large, way, middle, other.cells >= large, other.way, other.middle):
            break
        frontiers[at].middle, frontiers[at].goal = other.middle, other.goal
        frontiers[at].cells, frontiers[at].way = other.cells, other.way
        at -= 1
    frontiers[at].middle, frontiers[at].goal, frontiers[at].cells, frontiers[at].way = middle, goal, cells, way
    return min(n + 1, len(frontiers))


@njit(cache=True, nogil=True)
def _is_before(is_large: bool, way: int, middle: int, other_large: bool, other_way: int, other_middle: int) -> bool:
    """Return whether a cluster comes before another one (R5)."""
    if is_large != other_large:
        return is_large
    return way < other_way or (way == other_way and middle < other_middle)


@njit(cache=True, nogil=True)
def find_clear_goal(known: Grid, middle: int, near: Offsets, found: PathScratch) -> int:
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
        if line_is_free(known, r, c, row, col):
            return int(r * cols + c)
        lines += 1
        if lines >= MOST_LINES:
            break
    return -1


@njit(cache=True, nogil=True)
def line_is_free(known: Grid, row: int, col: int, to_row: int, to_col: int) -> bool:
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
def open_unknown_cells(known: Grid, found: PathScratch) -> None:
    """Open unknown cells, so that only obstacles and the box's rim are closed."""
    flat, closed, box = known.ravel(), found.closed, found.box
    for row in range(box[0] + 1, box[1] - 1):
        line = row * known.shape[1]
        for cell in range(np.uint64(line + box[2] + 1), np.uint64(max(line + box[3] - 1, 0))):
            closed[cell] &= flat[cell] != UNKNOWN


@njit(cache=True, nogil=True)
def find_seeing_goal(known: Grid, middle: int, range_px: float, scratch: Scratch) -> int:
    """Return the nearest standing cell with a path that sees a cell (R3), -1 if no cell does."""
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


@njit(cache=True, nogil=True)
def unknown_area_in_sight(known: Grid, x: float, y: float, range_px: float, fan_cos: Floats, fan_sin: Floats) -> float:
    """Return the unknown area, in cells, that beams in all directions cross before they hit an obstacle of the map.

    Each beam represents its share of the circle, and is sampled at the middle of each pixel of its length.

    Parameters
    ----------
    known
        (rows, cols), the map, at whose border beams end.
    fan_cos, fan_sin
        (n,), directions of evenly spaced beams, right and up.
    """
    rows, cols = known.shape
    area, share = 0.0, 2.0 * math.pi / len(fan_cos)
    for i in range(len(fan_cos)):
        for k in range(int(range_px)):
            away = k + 0.5
            row, col = math.floor(y - away * fan_sin[i]), math.floor(x + away * fan_cos[i])
            if not (0 <= row < rows and 0 <= col < cols) or known[row, col] == OBSTACLE:
                break
            if known[row, col] == UNKNOWN:
                area += away * share
    return area
