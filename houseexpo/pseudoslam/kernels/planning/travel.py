"""Going along a way on the robot's own map, step by step, as its limits of turn and step allow.

R1  The robot aims at the furthest cell of its way, within reach, to which a straight line leads over standing cells
    only; where its disc cannot go that way by the map, at the next cells of the way instead.
R2  A step turns towards the aim, as far as a step may; it goes forward only where that is the whole turn, and no
    further than to the aim.
R3  It goes no further than its disc meets a cell that the map does not show free now, but for those it covers already.
R4  At the end of its way it turns towards what it came to see, if anything.
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

_THERE_PX = 0.5  # from the end of a way
_ALIGNED = 1e-9  # radians
_MIN_PX = 0.5  # a way forward that is worth a step
_NEAR_PX = 1.5  # from the robot, which need not stand in the middle of a cell


@njit(cache=True, nogil=True)
def next_motion(
    known: Grid, x: float, y: float, heading: float, found: KnownWays, n: int, at: int, target: int, rules: TravelRules
) -> tuple[float, float, int, int]:
    """Return the next step's turn and way forward, radians and pixels, how far along it is, and how it stands.

    Parameters
    ----------
    x, y, heading
        Where the robot believes to be.
    found
        The ways; the first row of its queue holds this way's ``n`` cells.
    at
        The cell of the way that it was at last.
    target
        The cell that it wants to see, -1: none.
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
    """Return how far of ``distance`` a disc goes in a direction, a unit vector, as the map has it (R3); pixels."""
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
    """Whether a cell is known, and no unknown cell beside a free one is left within reach of it."""
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
    """Return the standing cell with a way whose middle is nearest to a point, of several the first; -1: none."""
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
    """Return the cell of the way, not before ``at``, that the robot is nearest to."""
    best, least = at, math.inf
    for k in range(at, min(at + reach, n)):
        off = (path[k] % cols + 0.5 - x) ** 2 + (path[k] // cols + 0.5 - y) ** 2
        if off < least:
            best, least = k, off
    return best


@njit(cache=True, nogil=True)
def _aim(path: Cells, n: int, at: int, x: float, y: float, found: KnownWays, cols: int, reach: int) -> int:
    """Return the furthest cell of the way up to which straight lines lead over standing cells."""
    furthest = min(at + 1, n - 1)
    for k in range(furthest + 1, min(at + reach, n - 1) + 1):
        if not line_stands(found, x, y, path[k] % cols + 0.5, path[k] // cols + 0.5, cols):
            break
        furthest = k
    return furthest


@njit(cache=True, nogil=True)
def line_stands(found: KnownWays, x: float, y: float, to_x: float, to_y: float, cols: int) -> bool:
    """Whether a line lies in standing cells, looked at twice a cell, but for where it begins."""
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
    """Return the heading from one place to another; the robot's own where they are one."""
    if to_x == x and to_y == y:
        return heading
    return math.atan2(y - to_y, to_x - x)
