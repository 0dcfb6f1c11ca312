"""Find where the robot can stand by its own map, the shortest distances to there, and its next motion on a path.

W1  A cell is open if the map shows it free. Unknown cells, obstacles and all cells on the border of the grid are not.
W2  Cells that the robot covers are open whatever the map shows, since the robot is there.
W3  The robot can stand at the centre of a cell if its disc touches only open cells.
W4  It goes from a standing cell to one of its eight neighbours, diagonally only if it can stand in both cells beside.
W5  Distances are whole numbers, 70 for a straight step and 99 for a diagonal one, so that they are exact and the square
    root of 2 has an error of 0.005%. A path starts at the robot, with the straight line to the centre of its cell, or
    of one beside it (W4).

Only rows and columns with known cells are processed. A robot with single actions descends these distances
(``choose_turns``); one with planners' actions follows a path (``next_motion``):

T1  The robot aims at the farthest cell of its path, within reach, to which a straight line over standing cells leads.
    If by the map its disc cannot go there, it aims at the next cells of the path instead.
T2  A step turns towards the aim, as far as the limit allows. It goes forward only if that completes the turn, and not
    beyond the aim.
T3  The robot stops before its disc touches a cell that the map does not currently show as free, except for cells that
    it already covers.
T4  At the end of its path, it turns towards its target, if there is one.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.collision import cell_meets_disc, distance_to_square, free_distance, wrap_angle
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.planner_types import ACROSS, ARRIVED, BLOCKED, GOING, STRAIGHT, TravelRules
from houseexpo.pseudoslam.kernels.tolerances import (
    ALIGNED,
    ARRIVED_PX,
    BESIDE_CELLS,
    LEAST_GAIN_PX,
    OFF_CENTRE_PX,
    REST_PX,
    SHORTEST_STEP_PX,
    TOUCH_PX,
)
from houseexpo.pseudoslam.kernels.types import NO_STAND, NO_WAY, Cells, Counts, Grid, PathScratch, as_int64

TOP, BOTTOM, LEFT, RIGHT, COLS = range(5)
"""In ``PathScratch.box``."""


@njit(cache=True, nogil=True)
def find_known_box(known: Grid, x: float, y: float, radius_px: float, box: Counts) -> None:
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
def mark_closed_cells(known: Grid, x: float, y: float, radius_px: float, found: PathScratch) -> None:
    """Mark the cells that are not open (W1, W2), including the box's rim, which is unknown or the grid's border."""
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
def find_standing_cells(radius_px: float, found: PathScratch) -> None:
    """Set ``ways`` to ``NO_WAY`` in standing cells (W3), from distances to closed cells in columns and then along rows.

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
            if math.hypot(max(across - 0.5, 0.0), max(down - 0.5, 0.0)) < radius_px - TOUCH_PX:
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


@njit(cache=True, nogil=True)
def find_distances(known: Grid, x: float, y: float, radius_px: float, until: int, found: PathScratch) -> None:
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
    find_known_box(known, x, y, radius_px, found.box)
    mark_closed_cells(known, x, y, radius_px, found)
    find_standing_cells(radius_px, found)
    _find_lengths(known.shape[0], x, y, radius_px, until, found)


@njit(cache=True, nogil=True)
def trace_path(found: PathScratch, goal: int, path: Cells) -> int:
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
            corner = ways[cell + one] >= 0 and ways[cell + other] >= 0  # W4
            if before < 0 and corner and ways[beside] >= 0 and ways[beside] == ways[cell] - ACROSS:
                before = beside
        if before < 0:
            for k in range(n // 2):  # from the robot on
                path[k], path[n - 1 - k] = path[n - 1 - k], path[k]
            return n
        cell = before
    return 0


@njit(cache=True, nogil=True)
def _clear(found: PathScratch) -> None:
    """Clear the last distances."""
    box, ways = found.box, found.ways
    for row in range(box[TOP], box[BOTTOM]):
        for cell in range(np.uint64(row * box[COLS] + box[LEFT]), np.uint64(row * box[COLS] + box[RIGHT])):
            ways[cell] = NO_STAND


@njit(cache=True, nogil=True)
def _start_ways(rows: int, x: float, y: float, radius_px: float, found: PathScratch, starts: Cells) -> int:
    """Write the standing cells at which paths start (W5), and their distances; return their number.

    They are the standing cells among the robot's own cell and its eight neighbours (diagonal neighbours by W4), or else
    the nearest standing cell within its radius plus two cells.
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
                    n, best = 0, -1.0  # farther cells do not count
                if is_near or off < best:
                    starts[n if is_near else 0] = cell
                    n = n + 1 if is_near else 1
                    best = best if is_near else off
    for i in range(n):
        cell = starts[i]
        ways[cell] = round(STRAIGHT * math.hypot(cell % cols + 0.5 - x, cell // cols + 0.5 - y))
    return n


@njit(cache=True, nogil=True)
def _find_lengths(rows: int, x: float, y: float, radius_px: float, until: int, found: PathScratch) -> None:
    """Compute the distances by Dijkstra's algorithm with buckets of 70, in which no path is a part of another one.

    A cell's neighbours are in the two buckets after its own, so that three buckets are enough, used in turn. A cell is
    at most once in a bucket; if a shorter path was found meanwhile, it was already processed in an earlier one.
    """
    ways, queue, cols = found.ways, found.queue, found.box[COLS]
    starts = np.empty(9, np.int32)
    n = _start_ways(rows, x, y, radius_px, found, starts)
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
                else:  # W4
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


NO_TURN = np.iinfo(np.int32).max
"""No step reduces the distance."""
_MIN_GAIN = LEAST_GAIN_PX * STRAIGHT
"""A step must reduce the distance by more than this."""


@njit(cache=True, nogil=True)
def choose_turns(
    known: Grid,
    x: float,
    y: float,
    heading: float,
    turn: float,
    step_px: float,
    radius_px: float,
    enough: float,
    parts: int,
    found: PathScratch,
) -> int:
    """Return the fewest turns, positive to the left, before a step that makes nearly as much progress as the best one.

    Steps that an obstacle would shorten come after all others. The result is ``NO_TURN`` if no step reduces the
    distance; of equally many turns to both sides, those to the right are taken.

    A robot that turns while it goes chooses among ``parts`` of a turn. The last turn costs it no action, so that of the
    headings with the fewest turns, it takes the one with most progress.

    Parameters
    ----------
    known
        (rows, cols), the map.
    x, y, heading
        The robot's pose; distances are from its goal.
    turn, step_px
        The turn of an action in radians, and the distance of a step.
    enough
        The share of the best step's progress that is enough.
    parts
        The result is a number of these parts of a turn; 1 for a robot that turns on the spot.
    found
        The result of ``find_distances`` from the goal, up to the robot.
    """
    reach = math.ceil(step_px + radius_px) + 2
    top, left = max(math.floor(y) - reach, 0), max(math.floor(x) - reach, 0)
    closed = _closed_cells_around(known, x, y, radius_px, top, left, reach)
    beside = min(as_int64(BESIDE_CELLS), as_int64(math.ceil(radius_px)))  # a farther cell may be round a wall's end,
    here = distance_at(found, known.shape[0], x, y, beside)  # so that no step would reduce its distance
    if here == math.inf:
        here = distance_at(found, known.shape[0], x, y, math.ceil(radius_px) + 2)
    part = turn / parts
    half = int(math.pi / part + 1e-9)
    gains, is_full, some_full = np.zeros(2 * half + 1), np.zeros(2 * half + 1, np.uint8), False
    for k in range(-half, half + 1):
        right, down = math.cos(heading + k * part), -math.sin(heading + k * part)
        way = free_distance(closed, x - left, y - top, right, down, step_px, radius_px)
        gain = here - distance_at(found, known.shape[0], x + way * right, y + way * down, beside)
        if gain > _MIN_GAIN:  # not if both are infinite
            gains[k + half] = gain
            is_full[k + half] = way == step_px
            some_full |= way == step_px
    if some_full:
        gains *= is_full
    most = gains.max()
    if not most > 0.0:
        return NO_TURN
    best, fewest = NO_TURN, NO_TURN
    for k in range(-half, half + 1):
        gain, turns = gains[k + half], abs(k) if parts == 1 else max(abs(k) - 1, 0) // parts
        if gain >= enough * most and (turns < fewest or (parts > 1 and turns == fewest and gain > gains[best + half])):
            best, fewest = k, turns
    return best


@njit(cache=True, nogil=True)
def distance_at(found: PathScratch, rows: int, x: float, y: float, reach: int) -> float:
    """Return the distance from a place, by the best standing cell at most ``reach`` away; infinite if there is none.

    The unit is ``STRAIGHT`` per cell.
    """
    cols = found.box[4]
    row, col = math.floor(y), math.floor(x)
    best = math.inf
    for r in range(max(row - reach, 0), min(row + reach + 1, rows)):
        for c in range(max(col - reach, 0), min(col + reach + 1, cols)):
            way = found.ways[r * cols + c]
            if 0 <= way < NO_WAY:
                best = min(best, way + STRAIGHT * math.hypot(c + 0.5 - x, r + 0.5 - y))
    return best


@njit(cache=True, nogil=True)
def _closed_cells_around(known: Grid, x: float, y: float, radius_px: float, top: int, left: int, reach: int) -> Grid:
    """Return the map around the robot, 1 for cells where it must not go: obstacles, and unknown cells not under it."""
    rows, cols = known.shape
    bottom, last = min(math.floor(y) + reach + 1, rows), min(math.floor(x) + reach + 1, cols)
    closed = np.zeros((max(bottom - top, 0), max(last - left, 0)), np.uint8)
    for row in range(top, bottom):
        for col in range(left, last):
            value = known[row, col]
            if value == OBSTACLE or (value != FREE and not cell_meets_disc(row, col, x, y, radius_px)):
                closed[row - top, col - left] = 1
    return closed


@njit(cache=True, nogil=True)
def next_motion(
    known: Grid,
    x: float,
    y: float,
    heading: float,
    found: PathScratch,
    n: int,
    at: int,
    target: int,
    rules: TravelRules,
) -> tuple[float, float, int, int]:
    """Return the next step's turn and distance, radians and pixels, its place on the path, and the travel's state.

    Parameters
    ----------
    x, y, heading
        The robot's believed pose.
    found
        The distances; the first row of its queue contains the ``n`` cells of this path.
    at
        The cell of the path at which the robot was last.
    target
        The cell to see, -1 for no cell.
    """
    path, cols = found.queue[0], found.box[4]
    at = _progress(path, n, at, x, y, cols, rules.aim_cells)
    end_x, end_y = path[n - 1] % cols + 0.5, path[n - 1] // cols + 0.5
    if math.hypot(end_x - x, end_y - y) <= ARRIVED_PX:
        if target < 0:
            return 0.0, 0.0, at, ARRIVED
        off = wrap_angle(_direction(x, y, target % cols + 0.5, target // cols + 0.5, heading) - heading)  # T4
        turn = min(max(off, -rules.turn_rad), rules.turn_rad)
        return turn, 0.0, at, (ARRIVED if abs(off) <= ALIGNED else GOING)
    furthest = _aim(path, n, at, x, y, found, cols, rules.aim_cells)
    for k in range(3):  # T1
        cell = path[furthest if k == 0 else min(at + 2 - k, n - 1)]
        to_x, to_y = cell % cols + 0.5, cell // cols + 0.5
        distance = math.hypot(to_x - x, to_y - y)
        if distance <= ALIGNED:
            continue
        towards = _direction(x, y, to_x, to_y, heading)
        wanted = min(distance, rules.step_px)
        way = free_distance_by_map(known, x, y, math.cos(towards), -math.sin(towards), wanted, rules.radius_px)
        if way < min(wanted, SHORTEST_STEP_PX):
            continue
        off = wrap_angle(towards - heading)
        if abs(off) > rules.turn_rad:  # T2
            return math.copysign(rules.turn_rad, off), 0.0, at, GOING
        return off, way, at, GOING
    return 0.0, 0.0, at, BLOCKED


@njit(cache=True, nogil=True)
def free_distance_by_map(
    known: Grid, x: float, y: float, right: float, down: float, distance: float, radius: float
) -> float:
    """Return how far, up to ``distance``, a disc can go in a direction (a unit vector) by the map (T3), pixels."""
    rows, cols = known.shape
    end_x, end_y = x + distance * right, y + distance * down
    top, bottom = max(math.floor(min(y, end_y) - radius), 0), min(math.floor(max(y, end_y) + radius) + 1, rows)
    left, last = max(math.floor(min(x, end_x) - radius), 0), min(math.floor(max(x, end_x) + radius) + 1, cols)
    way = distance
    for row in range(top, bottom):
        for col in range(left, last):
            if known[row, col] != FREE and not cell_meets_disc(row, col, x, y, radius):
                way = min(way, distance_to_square(x - col - 0.5, y - row - 0.5, right, down, radius - TOUCH_PX, way))
    return way if way == distance else max(way - REST_PX, 0.0)


@njit(cache=True, nogil=True)
def is_explored_near(known: Grid, cell: int, reach: int) -> bool:
    """Return whether a cell is known, and no unknown cell beside a free cell is within reach of it."""
    rows, cols = known.shape
    row, col = cell // cols, cell % cols
    if known[row, col] == UNKNOWN:
        return False
    for r in range(max(row - reach, 0), min(row + reach + 1, rows)):
        for c in range(max(col - reach, 0), min(col + reach + 1, cols)):
            if known[r, c] == UNKNOWN and (
                (r > 0 and known[r - 1, c] == FREE)
                or (r < rows - 1 and known[r + 1, c] == FREE)
                or (c > 0 and known[r, c - 1] == FREE)
                or (c < cols - 1 and known[r, c + 1] == FREE)
            ):
                return False
    return True


@njit(cache=True, nogil=True)
def nearest_reachable_cell(found: PathScratch, x: float, y: float) -> int:
    """Return the reachable standing cell whose centre is closest to a point, the first on a tie; -1 without cells."""
    box, ways = found.box, found.ways
    best, least = -1, math.inf
    for row in range(box[0], box[1]):
        down = (row + 0.5 - y) ** 2
        if down >= least:
            continue
        for col in range(box[2], box[3]):
            way = ways[row * box[4] + col]
            if way >= 0 and way != NO_WAY:
                off = down + (col + 0.5 - x) ** 2
                if off < least:
                    best, least = int(row * box[4] + col), off
    return best


@njit(cache=True, nogil=True)
def _progress(path: Cells, n: int, at: int, x: float, y: float, cols: int, reach: int) -> int:
    """Return the cell of the path, not before ``at``, that is closest to the robot."""
    best, least = at, math.inf
    for k in range(at, min(at + reach, n)):
        off = (path[k] % cols + 0.5 - x) ** 2 + (path[k] // cols + 0.5 - y) ** 2
        if off < least:
            best, least = k, off
    return best


@njit(cache=True, nogil=True)
def _aim(path: Cells, n: int, at: int, x: float, y: float, found: PathScratch, cols: int, reach: int) -> int:
    """Return the farthest cell of the path up to which straight lines over standing cells lead."""
    furthest = min(at + 1, n - 1)
    for k in range(furthest + 1, min(at + reach, n - 1) + 1):
        if not line_is_traversable(found, x, y, path[k] % cols + 0.5, path[k] // cols + 0.5, cols):
            break
        furthest = k
    return furthest


@njit(cache=True, nogil=True)
def line_is_traversable(found: PathScratch, x: float, y: float, to_x: float, to_y: float, cols: int) -> bool:
    """Return whether a line lies in standing cells, sampled twice per cell, except for its start."""
    right, down = to_x - x, to_y - y
    length = math.hypot(right, down)
    samples = math.ceil(2.0 * length)
    for i in range(samples + 1):
        part = i / max(samples, 1)
        if part * length > OFF_CENTRE_PX:
            row, col = math.floor(y + part * down), math.floor(x + part * right)
            if found.ways[row * cols + col] < 0:
                return False
    return True


@njit(cache=True, nogil=True)
def _direction(x: float, y: float, to_x: float, to_y: float, heading: float) -> float:
    """Return the heading from one place to another, or the robot's own if they are the same."""
    if to_x == x and to_y == y:
        return heading
    return math.atan2(y - to_y, to_x - x)
