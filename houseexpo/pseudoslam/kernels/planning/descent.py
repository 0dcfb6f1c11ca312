"""The next step along decreasing distances, and the turns before it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.motion.bodies import cell_meets_disc
from houseexpo.pseudoslam.kernels.motion.disc import free_way
from houseexpo.pseudoslam.kernels.planning.plan import STRAIGHT
from houseexpo.pseudoslam.kernels.types import NO_WAY, Grid, KnownWays

NO_TURN = np.iinfo(np.int32).max
"""No step reduces the distance."""
_MIN_GAIN = 0.5 * STRAIGHT
"""A step must reduce the distance by more than this."""
_BESIDE = 3  # cells, since the robot need not be at the centre of a standing cell


@njit(cache=True, nogil=True)
def best_turns(
    known: Grid,
    x: float,
    y: float,
    heading: float,
    turn: float,
    step_px: float,
    radius_px: float,
    enough: float,
    found: KnownWays,
) -> int:
    """Return the fewest turns, positive to the left, before a step that makes nearly as much progress as the best one.

    Steps that an obstacle would shorten come after all others. The result is ``NO_TURN`` if no step reduces the
    distance; of equally many turns to both sides, those to the right are taken.

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
    found
        The result of ``find_ways`` from the goal, up to the robot.
    """
    reach = math.ceil(step_px + radius_px) + 2
    top, left = max(math.floor(y) - reach, 0), max(math.floor(x) - reach, 0)
    closed = _closed(known, x, y, radius_px, top, left, reach)
    here = way_at(found, known.shape[0], x, y, _BESIDE)
    if here == math.inf:  # only then: a farther cell may be around a corner, and no step would reduce its distance
        here = way_at(found, known.shape[0], x, y, math.ceil(radius_px) + 2)
    half = int(math.pi / turn + 1e-9)
    gains, is_full, some_full = np.zeros(2 * half + 1), np.zeros(2 * half + 1, np.uint8), False
    for k in range(-half, half + 1):
        right, down = math.cos(heading + k * turn), -math.sin(heading + k * turn)
        way = free_way(closed, x - left, y - top, right, down, step_px, radius_px)
        gain = here - way_at(found, known.shape[0], x + way * right, y + way * down, _BESIDE)
        if gain > _MIN_GAIN:  # not if both are infinite
            gains[k + half] = gain
            is_full[k + half] = way == step_px
            some_full |= way == step_px
    if some_full:
        gains *= is_full
    most = gains.max()
    if not most > 0.0:
        return NO_TURN
    best = NO_TURN
    for k in range(-half, half + 1):
        if gains[k + half] >= enough * most and (best == NO_TURN or abs(k) < abs(best)):
            best = k
    return best


@njit(cache=True, nogil=True)
def way_at(found: KnownWays, rows: int, x: float, y: float, reach: int) -> float:
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
def _closed(known: Grid, x: float, y: float, radius_px: float, top: int, left: int, reach: int) -> Grid:
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
