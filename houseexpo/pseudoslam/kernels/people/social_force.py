"""The social force of Helbing and Molnar (1995): accelerations away from people, the robot, walls and bodies.

The force of another person has elliptical contours along that person's next step, and is weaker from behind. Walls act
through points around a person. Units are pixels and seconds.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.motion.bodies import Bodies, Disc, Tracks, nearest, to_body
from houseexpo.pseudoslam.kernels.types import Grid, Rows, row_type

_PUSH_M_S2, _PUSH_M = 7.0, 0.3  # V0 / sigma and sigma of the paper
_NEXT_STEP_S = 1.0  # duration of another person's next step
_BEHIND = 0.5  # weight of forces from more than 100 degrees off the direction
_COS_BEHIND = math.cos(math.radians(100.0))
_NO_PUSH_M = 1.5  # beyond this, the force is less than 1%


FEELER = row_type(x=float, y=float, push_x=float, push_y=float)
"""A point beside a person, pixels, and the acceleration in pixels/s2 if the point is in a wall."""


class Walk(NamedTuple):
    """The parameters of walking, the same for all people."""

    pixels_per_metre: float
    radius_px: float
    """At least ``HALF_DIAGONAL``, so that each person covers some cell."""
    relaxation_s: float
    arrive_px: float
    """Distance at which a person has reached a goal: two radii, so that it cannot be across a wall."""
    feelers: Rows
    """(F,) ``FEELER``."""
    reach_px: float
    """The largest distance of a feeler."""


@njit(cache=True, nogil=True)
def push(
    occupied: Grid, people: Rows, walk: Walk, p: int, wish_x: float, wish_y: float, robot: Disc
) -> tuple[float, float]:
    """Return the acceleration of person ``p`` away from walls, the robot and other people.

    The person's desired direction is (``wish_x``, ``wish_y``).
    """
    ppm = walk.pixels_per_metre
    x, y = people[p].x, people[p].y
    push_x, push_y = _by_walls(occupied, x, y, walk.feelers, walk.reach_px)
    if abs(robot.x - x) + abs(robot.y - y) < 2 * _NO_PUSH_M * ppm:
        by_x, by_y = _by_other(robot.x - x, robot.y - y, 0.0, 0.0, wish_x, wish_y, ppm)
        push_x, push_y = push_x + by_x, push_y + by_y
    for i in range(len(people)):
        off_x, off_y = people[i].x - x, people[i].y - y
        if i != p and abs(off_x) + abs(off_y) < 2 * _NO_PUSH_M * ppm:
            by_x, by_y = _by_other(off_x, off_y, people[i].vx, people[i].vy, wish_x, wish_y, ppm)
            push_x, push_y = push_x + by_x, push_y + by_y
    return push_x, push_y


@njit(cache=True, nogil=True)
def push_by_tracks(bodies: Bodies, tracks: Tracks, p: int, ppm: float) -> tuple[float, float]:
    """Return the acceleration of person ``p`` away from the nearest points of bodies on tracks."""
    push_x, push_y = 0.0, 0.0
    for k in range(len(bodies.clocks)):
        ahead, left, cos, sin = to_body(tracks, k, bodies.clocks[k], bodies.people[p].x, bodies.people[p].y)
        gap, a, b = nearest(tracks, k, ahead, left)
        length = math.sqrt(a * a + b * b)
        if length > 0.0 and gap <= _NO_PUSH_M * ppm:
            size = _PUSH_M_S2 * ppm * math.exp(-gap / (_PUSH_M * ppm)) / length
            push_x, push_y = push_x + size * (a * cos - b * sin), push_y - size * (a * sin + b * cos)
    return push_x, push_y


@njit(cache=True, nogil=True)
def _by_other(
    off_x: float, off_y: float, other_vx: float, other_vy: float, wish_x: float, wish_y: float, ppm: float
) -> tuple[float, float]:
    """Return the force of another person at the offset (``off_x``, ``off_y``): equations 3 to 5 and 8 of the paper."""
    off = math.sqrt(off_x * off_x + off_y * off_y)
    if off > _NO_PUSH_M * ppm or off == 0.0:
        return 0.0, 0.0
    step_x, step_y = other_vx * _NEXT_STEP_S, other_vy * _NEXT_STEP_S
    then_x, then_y = off_x + step_x, off_y + step_y
    then = max(math.sqrt(then_x * then_x + then_y * then_y), 1e-9)
    axis = math.sqrt(max((off + then) ** 2 - step_x * step_x - step_y * step_y, 1e-9)) / 2
    size = _PUSH_M_S2 * ppm * math.exp(-axis / (_PUSH_M * ppm)) * min((off + then) / (4 * axis), 2.0)
    if wish_x * off_x + wish_y * off_y < off * _COS_BEHIND:
        size *= _BEHIND
    return -size * (off_x / off + then_x / then), -size * (off_y / off + then_y / then)


@njit(cache=True, nogil=True)
def _by_walls(occupied: Grid, x: float, y: float, feelers: Rows, reach: float) -> tuple[float, float]:
    """Return the sum of the accelerations of all feelers that are in a wall or off the grid."""
    rows, cols = occupied.shape
    push_x, push_y = 0.0, 0.0
    if reach <= x < cols - reach and reach <= y < rows - reach:
        for i in range(len(feelers)):
            # unsigned: compiled code checks every signed index for being negative
            if occupied[np.uint32(y + feelers[i].y), np.uint32(x + feelers[i].x)] != 0:
                push_x, push_y = push_x + feelers[i].push_x, push_y + feelers[i].push_y
        return push_x, push_y
    for i in range(len(feelers)):
        at_x, at_y = x + feelers[i].x, y + feelers[i].y
        if not (0.0 <= at_x < cols and 0.0 <= at_y < rows) or occupied[int(at_y), int(at_x)] != 0:
            push_x, push_y = push_x + feelers[i].push_x, push_y + feelers[i].push_y
    return push_x, push_y
