"""Follow a path on the robot's own map, step by step, within its limits of turn and step.

R1  The robot aims at the farthest cell of its path, within reach, to which a straight line over standing cells leads.
    If by the map its disc cannot go there, it aims at the next cells of the path instead.
R2  A step turns towards the aim, as far as the limit allows. It goes forward only if that completes the turn, and not
    beyond the aim.
R3  The robot stops before its disc touches a cell that the map does not currently show as free, except for cells that
    it already covers.
R4  At the end of its path, it turns towards its target, if there is one.
"""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.motion.bodies import cell_meets_disc
from houseexpo.pseudoslam.kernels.motion.disc import REST, TOUCH, contact
from houseexpo.pseudoslam.kernels.motion.heading import wrapped
from houseexpo.pseudoslam.kernels.planning.plan import ARRIVED, BLOCKED, GOING, TravelRules
from houseexpo.pseudoslam.kernels.types import NO_WAY, Cells, Grid, KnownWays

_THERE_PX = 0.5  # from the end of a path
_ALIGNED = 1e-9  # radians
_MIN_PX = 0.5  # smallest distance for a step
_NEAR_PX = 1.5  # from the robot, which need not be at the centre of a cell


@njit(cache=True, nogil=True)
def next_motion(
    known: Grid, x: float, y: float, heading: float, found: KnownWays, n: int, at: int, target: int, rules: TravelRules
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
        The cell to see, -1 for none.
    """
    path, cols = found.queue[0], found.box[4]
    at = _progress(path, n, at, x, y, cols, rules.aim_cells)
    end_x, end_y = path[n - 1] % cols + 0.5, path[n - 1] // cols + 0.5
    if math.hypot(end_x - x, end_y - y) <= _THERE_PX:
        if target < 0:
            return 0.0, 0.0, at, ARRIVED
        off = wrapped(_direction(x, y, target % cols + 0.5, target // cols + 0.5, heading) - heading)  # R4
        turn = min(max(off, -rules.turn_rad), rules.turn_rad)
        return turn, 0.0, at, (ARRIVED if abs(off) <= _ALIGNED else GOING)
    furthest = _aim(path, n, at, x, y, found, cols, rules.aim_cells)
    for k in range(3):  # R1
        cell = path[furthest if k == 0 else min(at + 2 - k, n - 1)]
        to_x, to_y = cell % cols + 0.5, cell // cols + 0.5
        distance = math.hypot(to_x - x, to_y - y)
        if distance <= _ALIGNED:
            continue
        towards = _direction(x, y, to_x, to_y, heading)
        wanted = min(distance, rules.step_px)
        way = way_by_map(known, x, y, math.cos(towards), -math.sin(towards), wanted, rules.radius_px)
        if way < min(wanted, _MIN_PX):
            continue
        off = wrapped(towards - heading)
        if abs(off) > rules.turn_rad:  # R2
            return math.copysign(rules.turn_rad, off), 0.0, at, GOING
        return off, way, at, GOING
    return 0.0, 0.0, at, BLOCKED


@njit(cache=True, nogil=True)
def way_by_map(known: Grid, x: float, y: float, right: float, down: float, distance: float, radius: float) -> float:
    """Return how far, up to ``distance``, a disc can go in a direction (a unit vector) by the map (R3), pixels."""
    rows, cols = known.shape
    end_x, end_y = x + distance * right, y + distance * down
    top, bottom = max(math.floor(min(y, end_y) - radius), 0), min(math.floor(max(y, end_y) + radius) + 1, rows)
    left, last = max(math.floor(min(x, end_x) - radius), 0), min(math.floor(max(x, end_x) + radius) + 1, cols)
    way = distance
    for row in range(top, bottom):
        for col in range(left, last):
            if known[row, col] != FREE and not cell_meets_disc(row, col, x, y, radius):
                way = min(way, contact(x - col - 0.5, y - row - 0.5, right, down, radius - TOUCH, way))
    return way if way == distance else max(way - REST, 0.0)


@njit(cache=True, nogil=True)
def is_settled(known: Grid, cell: int, reach: int) -> bool:
    """Return whether a cell is known, and no unknown cell beside a free one is left within reach of it."""
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
def nearest_place(found: KnownWays, x: float, y: float) -> int:
    """Return the standing cell with a path whose centre is closest to a point, of several the first; -1 for none."""
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
def _aim(path: Cells, n: int, at: int, x: float, y: float, found: KnownWays, cols: int, reach: int) -> int:
    """Return the farthest cell of the path up to which straight lines over standing cells lead."""
    furthest = min(at + 1, n - 1)
    for k in range(furthest + 1, min(at + reach, n - 1) + 1):
        if not line_stands(found, x, y, path[k] % cols + 0.5, path[k] // cols + 0.5, cols):
            break
        furthest = k
    return furthest


@njit(cache=True, nogil=True)
def line_stands(found: KnownWays, x: float, y: float, to_x: float, to_y: float, cols: int) -> bool:
    """Return whether a line lies in standing cells, sampled twice per cell, except for its start."""
    right, down = to_x - x, to_y - y
    length = math.hypot(right, down)
    samples = math.ceil(2.0 * length)
    for i in range(samples + 1):
        part = i / max(samples, 1)
        if part * length > _NEAR_PX:
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
