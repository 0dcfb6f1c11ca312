"""Where people start."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.bodies import (
    ANCHOR_X,
    ANCHOR_Y,
    GOAL,
    HALF_DIAGONAL,
    SPEED,
    Bodies,
    Disc,
    Tracks,
    X,
    Y,
)
from houseexpo.pseudoslam.kernels.flow import COLS, GOALS, ROWS, Flow
from houseexpo.pseudoslam.kernels.hashing import uniform
from houseexpo.pseudoslam.kernels.people import Walk, draw, fits, take_goal
from houseexpo.pseudoslam.kernels.types import Grid

_TRIES = 64


@njit(cache=True, nogil=True)
def place_people(
    solid: Grid,
    bodies: Bodies,
    tracks: Tracks,
    flow: Flow,
    walk: Walk,
    key: np.uint64,
    robot: Disc,
    away_px: float,
    speed: float,
    speed_sd: float,
) -> int:
    """Put people at random places where they fit, with a speed (pixels/s) and a first goal each.

    A place is drawn until one fits that lies ``away_px`` from the robot's centre, at most 64 times; then any that fits
    is taken. ``solid`` holds what stands still only; nothing is drawn in it.

    Returns
    -------
    How many found a place; all of them, unless there is no more room.
    """
    people = bodies.people
    people[:], bodies.errands[:] = 0.0, 0
    for p in range(len(people)):
        if not _find_place(solid, bodies, tracks, flow, walk, key, p, robot, away_px):
            return p
        people[p, ANCHOR_X], people[p, ANCHOR_Y] = people[p, X], people[p, Y]
        radius = math.sqrt(-2.0 * math.log(1.0 - uniform(key, draw(p, 0, 2))))
        normal = radius * math.cos(2.0 * math.pi * uniform(key, draw(p, 0, 3)))
        people[p, SPEED] = max(speed + speed_sd * min(max(normal, -2.0), 2.0), 0.1 * speed)
        bodies.errands[p, GOAL] = int(uniform(key, draw(p, 0, 4)) * flow.sizes[GOALS])
        take_goal(bodies, flow, key, p)
    return len(people)


@njit(cache=True, nogil=True)
def _find_place(
    solid: Grid,
    bodies: Bodies,
    tracks: Tracks,
    flow: Flow,
    walk: Walk,
    key: np.uint64,
    p: int,
    robot: Disc,
    away_px: float,
) -> bool:
    """Draw a place for person ``p``; after so many draws, look at all spots from the last one drawn on."""
    me, blocks, cols = bodies.people[p], flow.sizes[ROWS] * flow.sizes[COLS], solid.shape[1]
    least = robot.radius + walk.radius_px + HALF_DIAGONAL
    block = 0
    for i in range(_TRIES + blocks):
        drawn = i < _TRIES
        block = int(uniform(key, draw(p, i, 5)) * blocks) if drawn else (block + 1) % blocks
        spot = flow.spots[block]
        if spot < 0:
            continue
        me[X] = spot % cols + (uniform(key, draw(p, i, 6)) if drawn else 0.5)
        me[Y] = spot // cols + (uniform(key, draw(p, i, 7)) if drawn else 0.5)
        if math.hypot(robot.x - me[X], robot.y - me[Y]) >= (max(away_px, least) if drawn else least):
            if fits(solid, bodies, tracks, p, p, me[X], me[Y], walk.radius_px, robot):
                return True
    return False
