"""Compute the lengths of the robot's shortest paths to its goal, in the cells where it can stand.

R1  The robot may be anywhere in the squares of these cells. A line may touch other cells, but not cross one.
R2  A shortest path turns only at corners: where one of four cells that meet is closed, or two that are diagonal.
R3  It turns around the closed cell. So a line of the path that ends at a corner leads into a quadrant beside that cell,
    which leaves out most lines before anything is looked at.
R4  Lines between two corners are at most ``reach_px`` long. A longer one, in a hall, passes corners nearby.
R5  A corner of these cells lies up to ``HALF_DIAGONAL`` beside the circle on which a disc turns around a wall's corner.
    So lengths are measured between places on these circles: at the distance of the robot's radius from the occupied
    cell that is nearest to the corner, and around the circles at both ends.
R6  Distances are searched only as far as they are asked for: those of all corners on ways from the goal to the robot
    that are at most ``sure_px`` long. A corner outside of this ellipse is on no shorter way. The search goes on where
    it stopped when the robot leaves the places for which it was enough.
R7  If the goal is a region of the cells, its cells have the value ``GOAL_CELL``, from which the distance is 0. From
    others, it is the one to the place in the region that was nearest to the start.

``CornerGraph`` has what belongs to a house: its corners, and which of them see each other. ``GoalPaths`` adds what
belongs to a goal: the distance from the corners; from a place, the path leads to the best corner in sight, or straight
to the goal.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.collision import HALF_DIAGONAL
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Floats, Grid, Rows, as_int64, make_row_dtype

PATHS = make_row_dtype(
    rows=int, cols=int, corners=int, reach_px=float, goal_x=float, goal_y=float, last=int, from_x=float, from_y=float,
    sure_px=float,
)  # fmt: skip
"""Rows and columns of the cells, the number of corners, the longest line between two of them, the goal, and the corner
to which the last path led; the place for which distances were searched, and the length up to which its ways are
sure."""
X, Y, SIGN, TURN_X, TURN_Y, WALL_X, WALL_Y = range(7)
"""The columns of ``CornerGraph.corners``: the place in pixels, the sign of the product of right and down on lines that
may end there (R3), the place from and to which lengths are measured, and the middle of its circle (R5)."""
WAY, DONE, LOOKED = range(3)
"""The columns of ``GoalPaths.ways``: the distance to the goal as far as it is known, the one with which the corner's
lines were followed, both in pixels, and whether the line to the goal has been looked at."""
GOAL_CELL = 3
"""The value of cells of the goal's region where the robot can stand (R7); of others it is 1."""
_EPS = 1e-7  # pixels by which a line may graze a cell because of rounding, and by which lengths may differ
_AHEAD_SHARE = 0.05  # of the longest line: how much longer ways are searched, so that few steps have to go on with it


class GoalPaths(NamedTuple):
    """The paths to a goal. In a pool, the arrays have an additional first axis and the length of the longest."""

    sizes: Rows
    """(1,) ``PATHS``."""
    standing: Grid
    """(rows * cols,), not 0 for cells where the robot can stand, ``GOAL_CELL`` for those of the goal's region."""
    corners: Floats
    starts: Counts
    others: Cells
    """These three are the house's, as in ``CornerGraph``."""
    ways: Floats
    """(corners, 3), which the search changes."""


def no_goal_paths() -> GoalPaths:
    """Return no paths, for no goal."""
    return GoalPaths(
        np.zeros(1, PATHS), np.zeros(0, np.uint8), np.zeros((0, 7)), np.zeros(0, np.int64), np.zeros(0, np.int32),
        np.zeros((0, 3)),
    )  # fmt: skip


class CornerGraph(NamedTuple):
    """The corners of the cells where the robot can stand, and the lines between them that paths may follow."""

    standing: Grid
    """(rows, cols), 1 for cells where the robot can stand."""
    corners: Floats
    """(corners, 7), from top to bottom."""
    starts: Counts
    """(corners + 1,), where each corner's part of ``others`` begins."""
    others: Cells
    """The corners in sight of each corner (R3, R4), in order."""
    reach_px: float


def make_corner_graph(standing: Grid, occupied: Grid, radius_px: float, reach_px: float) -> CornerGraph:
    """Return the corners of cells (rows, cols), and which of them see each other over at most ``reach_px`` (R4).

    ``occupied`` (rows, cols) is not 0 in the cells that keep the centre of the robot ``radius_px`` away (R5).
    """
    corners = np.empty((list_corners(standing, np.empty((0, 7))), 7))
    list_corners(standing, corners)
    place_turns(occupied, radius_px, corners)
    return CornerGraph(standing, corners, *link_corners(standing, corners, reach_px), reach_px)


def find_goal_paths(graph: CornerGraph, x: float, y: float) -> GoalPaths:
    """Return the paths to the goal (x, y), pixels, of which nothing has been searched yet."""
    number = len(graph.corners)
    ways = np.full((number, 3), math.inf)
    ways[:, LOOKED] = 0.0
    sizes = np.array([(*graph.standing.shape, number, graph.reach_px, x, y, 0, 0.0, 0.0, 0.0)], PATHS)
    return GoalPaths(sizes, graph.standing.ravel(), graph.corners, graph.starts, graph.others, ways)


@njit(cache=True, nogil=True)
def list_corners(standing: Grid, corners: Floats) -> int:
    """Write the corners of the standing cells (R2) into as many rows as there are; return their number."""
    rows, cols = standing.shape
    count = 0
    for row in range(1, rows):
        for col in range(1, cols):
            one, two = standing[row - 1, col - 1], standing[row - 1, col]
            three, four = standing[row, col - 1], standing[row, col]
            free = int(one) + int(two) + int(three) + int(four)
            if free == 3 or (free == 2 and one == four):
                if count < len(corners):
                    corners[count, X], corners[count, Y] = col, row
                    corners[count, SIGN] = -1.0 if one == 0 or four == 0 else 1.0
                count += 1
    return count


@njit(cache=True, nogil=True)
def place_turns(occupied: Grid, radius_px: float, corners: Floats) -> None:
    """Write the places where a disc turns around corners (R5), which are the corners where no occupied cell is near."""
    rows, cols = occupied.shape
    for k in range(len(corners)):
        x, y = corners[k, X], corners[k, Y]
        reach = radius_px + HALF_DIAGONAL
        near, near_x, near_y = reach * reach + _EPS, x, y
        for row in range(max(math.floor(y - reach), 0), min(math.ceil(y + reach), rows)):
            for col in range(max(math.floor(x - reach), 0), min(math.ceil(x + reach), cols)):
                if occupied[row, col] != 0:
                    at_x, at_y = min(max(x, float(col)), float(col + 1)), min(max(y, float(row)), float(row + 1))
                    far = (at_x - x) ** 2 + (at_y - y) ** 2
                    if far < near:
                        near, near_x, near_y = far, at_x, at_y
        stretch = radius_px / math.sqrt(near) if (near_x, near_y) != (x, y) else 0.0
        corners[k, TURN_X], corners[k, WALL_X] = near_x + (x - near_x) * stretch, near_x
        corners[k, TURN_Y], corners[k, WALL_Y] = near_y + (y - near_y) * stretch, near_y


@njit(cache=True, nogil=True)
def link_corners(standing: Grid, corners: Floats, reach_px: float) -> tuple[Counts, Cells]:
    """Return ``CornerGraph.starts`` and ``CornerGraph.others`` of corners."""
    number, count = len(corners), 0
    pairs = np.empty((4 * number + 4, 2), np.int32)  # from top to bottom
    for here in range(number):
        x, y, sign = corners[here, X], corners[here, Y], corners[here, SIGN]
        _, last = _rows_within(corners, y, y + reach_px)
        for there in range(here + 1, last):
            right, down = corners[there, X] - x, corners[there, Y] - y
            if right * down * sign < 0.0 or right * down * corners[there, SIGN] < 0.0:
                continue  # R3
            if math.hypot(right, down) > reach_px:
                continue
            if is_straight(standing, x, y, corners[there, X], corners[there, Y]):
                if count == len(pairs):
                    more = np.empty((2 * count, 2), np.int32)
                    more[:count] = pairs
                    pairs = more
                pairs[count, 0], pairs[count, 1] = here, there
                count += 1
    starts = np.zeros(number + 1, np.int64)
    for k in range(count):
        starts[pairs[k, 0] + 1] += 1
        starts[pairs[k, 1] + 1] += 1
    for here in range(number):
        starts[here + 1] += starts[here]
    others, filled = np.empty(2 * count, np.int32), starts[:-1].copy()
    for k in range(count):
        for one, two in ((pairs[k, 0], pairs[k, 1]), (pairs[k, 1], pairs[k, 0])):
            others[filled[one]] = two
            filled[one] += 1
    return starts, others


@njit(cache=True, nogil=True)
def goal_distance_at(paths: GoalPaths, x: float, y: float) -> float:
    """Return the length of the shortest path from a place to the goal, pixels; infinite if there is none.

    The result depends on the place and the goal alone. What was searched is kept in ``ways`` and ``sizes`` (R6), which
    only makes the next calls faster.

    A robot that is not in a standing cell, since it need not be at a cell's centre, goes to the nearest one first.
    """
    size = paths.sizes[0]
    standing = paths.standing[: size.rows * size.cols].reshape((size.rows, size.cols))
    row, col = math.floor(y), math.floor(x)
    if 0 <= row < size.rows and 0 <= col < size.cols and standing[row, col] == GOAL_CELL:
        return 0.0  # R7
    from_x, from_y, off = _nearest_standing(standing, x, y)
    if off == math.inf:
        return off
    if is_straight(standing, from_x, from_y, size.goal_x, size.goal_y):
        return math.hypot(x - size.goal_x, y - size.goal_y)
    best, most = _best_by_corners(paths, from_x, from_y), math.hypot(from_x - size.goal_x, from_y - size.goal_y)
    ahead = _AHEAD_SHARE * size.reach_px
    while best + _EPS > size.sure_px - math.hypot(from_x - size.from_x, from_y - size.from_y):
        most = (best if best < math.inf else most) + ahead
        ahead *= 2.0
        _search_ways(paths, from_x, from_y, most)
        best = _best_by_corners(paths, from_x, from_y)
    return off + best


@njit(cache=True, nogil=True)
def nearest_place(paths: GoalPaths, places: Floats) -> tuple[int, float]:
    """Return the index of the place (n, 2) with the shortest path to the goal, the first of equals, and its length."""
    best, found = math.inf, -1
    for k in range(len(places)):
        way = goal_distance_at(paths, places[k, 0], places[k, 1])
        if way < best:
            best, found = way, k
    return found, best


@njit(cache=True, nogil=True)
def _best_by_corners(paths: GoalPaths, x: float, y: float) -> float:
    """Return the length of the shortest known way from a standing cell over a corner to the goal; note the corner."""
    size = paths.sizes[0]
    rows, cols, number, reach = size.rows, size.cols, size.corners, size.reach_px
    standing, corners, ways = paths.standing[: rows * cols].reshape((rows, cols)), paths.corners[:number], paths.ways
    best = math.inf
    first, last = _rows_within(corners, y - reach, y + reach)
    for k in range(first - 1, last):
        there = k if k >= first else size.last  # first that of the last step: few others promise less then
        if there >= number or ways[there, WAY] >= best:
            continue
        right, down = corners[there, X] - x, corners[there, Y] - y
        if abs(right) > reach or right * down * corners[there, SIGN] < 0.0:
            continue
        if _apart(corners[there, TURN_X], corners[there, TURN_Y], x, y) + ways[there, WAY] >= best:
            continue
        way = _length_to(corners, there, x, y) + ways[there, WAY]
        if way < best and is_straight(standing, x, y, corners[there, X], corners[there, Y]):
            best = way
            size.last = there
    return best


@njit(cache=True, nogil=True)
def _search_ways(paths: GoalPaths, x: float, y: float, most: float) -> None:
    """Find the distances of all corners on ways from the goal to (x, y) that are at most ``most`` long (R6).

    Within these it is the algorithm of Dijkstra (1959). Distances of other corners may be found too long.
    """
    size, corners, ways, starts, others = paths.sizes[0], paths.corners, paths.ways, paths.starts, paths.others
    standing = paths.standing[: size.rows * size.cols].reshape((size.rows, size.cols))
    goal_x, goal_y, is_left = size.goal_x, size.goal_y, False
    heap = [(0.0, 0)]
    heap.pop()
    for there in range(size.corners):
        if ways[there, LOOKED] != 0.0 and ways[there, WAY] >= ways[there, DONE]:
            continue
        to_x, to_y = corners[there, TURN_X], corners[there, TURN_Y]
        if _apart(to_x, to_y, goal_x, goal_y) + _apart(to_x, to_y, x, y) > most:
            is_left = True
            continue
        if ways[there, LOOKED] == 0.0:
            ways[there, LOOKED] = 1.0
            at_x, at_y, way = corners[there, X], corners[there, Y], _length_to(corners, there, goal_x, goal_y)
            leads = (at_x - goal_x) * (at_y - goal_y) * corners[there, SIGN] >= 0.0  # R3
            if leads and way < ways[there, WAY] and is_straight(standing, goal_x, goal_y, at_x, at_y):
                ways[there, WAY] = way
        if ways[there, WAY] < ways[there, DONE]:
            if ways[there, WAY] + _apart(to_x, to_y, x, y) > most:
                is_left = True
            else:
                heapq.heappush(heap, (ways[there, WAY], there))
    while len(heap) > 0:
        way, here = heapq.heappop(heap)
        if way >= ways[here, DONE]:
            continue
        ways[here, DONE] = way
        from_x, from_y = corners[here, TURN_X], corners[here, TURN_Y]
        for k in range(starts[here], starts[here + 1]):
            there = as_int64(others[k])
            to_x, to_y = corners[there, TURN_X], corners[there, TURN_Y]
            if way + _apart(from_x, from_y, to_x, to_y) > ways[there, WAY] + _EPS:
                continue
            chord = math.hypot(to_x - from_x, to_y - from_y)
            far = way + chord + _detour(corners, there, from_x, from_y, chord)
            if corners[here, WALL_X] != corners[there, WALL_X] or corners[here, WALL_Y] != corners[there, WALL_Y]:
                far += _detour(corners, here, to_x, to_y, chord)
            if far < ways[there, WAY]:
                ways[there, WAY] = far
                if far + _apart(to_x, to_y, x, y) > most:
                    is_left = True
                else:
                    heapq.heappush(heap, (far, there))
    size.from_x, size.from_y, size.sure_px = x, y, most if is_left else math.inf


@njit(cache=True, nogil=True)
def _length_to(corners: Floats, there: int, x: float, y: float) -> float:
    """Return the length of the shortest line from (x, y) around a corner's circle to its place on it (R5)."""
    chord = math.hypot(corners[there, TURN_X] - x, corners[there, TURN_Y] - y)
    return chord + _detour(corners, there, x, y, chord)


@njit(cache=True, nogil=True)
def _detour(corners: Floats, there: int, x: float, y: float, chord: float) -> float:
    """Return by how much that line is longer than the straight one: it is a tangent and an arc if this one crosses."""
    to_x, to_y = corners[there, TURN_X], corners[there, TURN_Y]
    out_x, out_y = to_x - corners[there, WALL_X], to_y - corners[there, WALL_Y]
    if (to_x - x) * out_x + (to_y - y) * out_y <= 0.0:
        return 0.0
    off_x, off_y, radius = x - corners[there, WALL_X], y - corners[there, WALL_Y], math.hypot(out_x, out_y)
    tangent = math.sqrt(max(off_x * off_x + off_y * off_y - radius * radius, 0.0))
    turn = math.atan2(abs(off_x * out_y - off_y * out_x), off_x * out_x + off_y * out_y) - math.atan2(tangent, radius)
    return max(tangent + radius * turn - chord, 0.0)


@njit(inline="always")
def _apart(x: float, y: float, to_x: float, to_y: float) -> float:
    """Return a distance, where its last digits do not matter: ``math.hypot`` takes several times as long."""
    return math.sqrt((to_x - x) * (to_x - x) + (to_y - y) * (to_y - y))


@njit(cache=True, nogil=True)
def is_straight(standing: Grid, x: float, y: float, end_x: float, end_y: float) -> bool:
    """Return whether a line crosses no closed cell (R1); a line along a side of cells needs an open one beside it."""
    rows, cols = standing.shape
    if x > end_x:
        x, y, end_x, end_y = end_x, end_y, x, y
    if end_x - x < _EPS:
        left, right = max(math.ceil(x - _EPS) - 1, 0), min(math.floor(x + _EPS), cols - 1)
        for row in range(math.floor(min(y, end_y) + _EPS), math.ceil(max(y, end_y) - _EPS)):
            if standing[row, left] == 0 and standing[row, right] == 0:
                return False
        return True
    slope = (end_y - y) / (end_x - x)
    for col in range(math.floor(x + _EPS), math.ceil(end_x - _EPS)):
        one = y + (max(float(col), x) - x) * slope
        other = y + (min(float(col + 1), end_x) - x) * slope
        top, bottom = min(one, other), max(one, other)
        first, last = math.floor(top + _EPS), math.ceil(bottom - _EPS)
        along = last <= first  # along a side
        if along and standing[min(first, rows - 1), col] == 0 and standing[max(last - 1, 0), col] == 0:
            return False
        for row in range(first, last):
            if standing[row, col] == 0:
                return False
    return True


@njit(cache=True, nogil=True)
def _rows_within(corners: Floats, top: float, bottom: float) -> tuple[int, int]:
    """Return the first and the last (excluded) corner with y from ``top`` to ``bottom``."""
    first, last = 0, len(corners)
    low, high = first, last
    while low < high:
        middle = (low + high) // 2
        if corners[middle, Y] < top:
            low = middle + 1
        else:
            high = middle
    first, high = low, last
    while low < high:
        middle = (low + high) // 2
        if corners[middle, Y] <= bottom:
            low = middle + 1
        else:
            high = middle
    return first, low


@njit(cache=True, nogil=True)
def _nearest_standing(standing: Grid, x: float, y: float) -> tuple[float, float, float]:
    """Return the nearest place in a standing cell at most two cells away, and its distance; infinite if none is."""
    rows, cols = standing.shape
    row, col = math.floor(y), math.floor(x)
    if 0 <= row < rows and 0 <= col < cols and standing[row, col] != 0:
        return x, y, 0.0
    best, to_x, to_y = math.inf, x, y
    for r in range(max(row - 2, 0), min(row + 3, rows)):
        for c in range(max(col - 2, 0), min(col + 3, cols)):
            if standing[r, c] != 0:
                near_x, near_y = min(max(x, float(c)), float(c + 1)), min(max(y, float(r)), float(r + 1))
                off = math.hypot(near_x - x, near_y - y)
                if off < best:
                    best, to_x, to_y = off, near_x, near_y
    return to_x, to_y, best
