"""The starts of people."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.hashing import normal, uniform
from houseexpo.pseudoslam.kernels.motion.bodies import HALF_DIAGONAL, Bodies, Disc, Tracks
from houseexpo.pseudoslam.kernels.people.social_force import Walk
from houseexpo.pseudoslam.kernels.people.walking import draw, fits, fits_bodies, take_goal
from houseexpo.pseudoslam.kernels.planning.flow import Flow
from houseexpo.pseudoslam.kernels.types import Grid

_TRIES = 64
_SPEEDS = 1 << 40  # counters beyond all others


@njit(cache=True, nogil=True)
def place_people(
    occupied: Grid,
    bodies: Bodies,
    tracks: Tracks,
    flow: Flow,
    walk: Walk,
    key: int,
    robot: Disc,
    away_px: float,
    speed: float,
    speed_sd: float,
) -> int:
    """Put people at random places where they fit, with a speed (pixels/s) and a first goal each.

    Places are drawn up to 64 times until one fits that is at least ``away_px`` from the robot's centre; after that, any
    place that fits is taken. ``occupied`` contains only static obstacles and is not changed. All of ``bodies.people``
    must be 0 before.

    Returns
    -------
    The number of people with a place: all of them, unless the house is full.
    """
    people = bodies.people
    for p in range(len(people)):
        if not _find_place(occupied, bodies, tracks, flow, walk, key, p, robot, away_px):
            return p
        people[p].speed = max(speed + speed_sd * min(max(normal(key, _SPEEDS + p), -2.0), 2.0), 0.1 * speed)
        people[p].goal = int(uniform(key, draw(p, 0, 4)) * flow.sizes[0].goals)
        take_goal(bodies, flow, key, p)
    return len(people)


@njit(cache=True, nogil=True)
def _find_place(
    occupied: Grid,
    bodies: Bodies,
    tracks: Tracks,
    flow: Flow,
    walk: Walk,
    key: int,
    p: int,
    robot: Disc,
    away_px: float,
) -> bool:
    """Draw a place for person ``p``; after too many draws, try all spots, starting at the last one drawn."""
    me, blocks = bodies.people[p], flow.sizes[0].rows * flow.sizes[0].cols
    least = robot.radius + walk.radius_px + HALF_DIAGONAL
    block = 0
    for i in range(_TRIES + blocks):
        drawn = i < _TRIES
        block = int(uniform(key, draw(p, i, 5)) * blocks) if drawn else (block + 1) % blocks
        if flow.spots[block, 0] < 0:
            continue
        me.x = flow.spots[block, 1] + (uniform(key, draw(p, i, 6)) if drawn else 0.5)
        me.y = flow.spots[block, 0] + (uniform(key, draw(p, i, 7)) if drawn else 0.5)
        far = max(away_px, least) if drawn else least
        if math.hypot(robot.x - me.x, robot.y - me.y) < far:
            continue
        if fits(occupied, bodies.people, p, p, me.x, me.y, walk.radius_px, robot) and (
            fits_bodies(bodies, tracks, p, me.x, me.y, walk.radius_px)
        ):
            return True
    return False
