"""People: discs that walk from goal to goal by the social force of Helbing and Molnar (1995), and never overlap.

Forces are accelerations: towards the speed and direction wished for, away from others and the robot (section "social
force" of that paper: an ellipse stretched along the other's next step, weaker behind one's back), away from walls. What
forces cannot promise, ``_go`` does: a place where a disc would overlap anything is never taken.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.bodies import (
    ANCHOR_X,
    ANCHOR_Y,
    GOAL,
    HALF_DIAGONAL,
    SPEED,
    VISIT,
    VX,
    VY,
    WAITED,
    Bodies,
    Disc,
    Tracks,
    X,
    Y,
    box,
    cell_meets_disc,
    gap_to,
    nearest,
    to_body,
)
from houseexpo.pseudoslam.kernels.flow import BLOCK_PX, COLS, GOALS, NOWHERE, ROWS, STEPS, THERE, Flow
from houseexpo.pseudoslam.kernels.hashing import uniform
from houseexpo.pseudoslam.kernels.motion import disc_is_free
from houseexpo.pseudoslam.kernels.types import Floats, Grid

PEOPLE_MOST = 1024
"""People in an environment, at most: what a person draws must be nobody else's."""
_AHEAD = 2  # blocks that a person looks ahead
_PUSH_M_S2, _PUSH_M = 7.0, 0.3  # V0 / sigma and sigma of the paper
_NEXT_STEP_S = 1.0  # how far ahead another's step is seen
_BEHIND = 0.5  # weight of what lies behind one's back: more than 100 degrees off
_COS_BEHIND = math.cos(math.radians(100.0))
_NO_PUSH_M = 2.0  # beyond this, 1% of the push at arm's length
_FASTEST = 1.3  # of the speed wished for
_ROAMED_M, _PATIENCE_S = 0.5, 3.0  # who stays within so much for so long, or twice as long, turns to another goal
_TURNS = np.array(
    [(math.cos(math.radians(angle)), math.sin(math.radians(angle))) for angle in (0, 45, -45, 80, -80)]
)  # ways round what is in the way, to the right first
_LENGTHS = np.array([1.0, 0.7, 0.7, 0.35, 0.35])


class Walk(NamedTuple):
    """How people walk, the same for all of them."""

    pixels_per_metre: float
    radius_px: float
    """At least ``HALF_DIAGONAL``, so that everybody covers some cell."""
    relaxation_s: float
    arrive_px: float
    """Nearer than this to its goal, a person has arrived."""
    feelers: Floats
    """(F, 4) x, y of points round a person, pixels, and the push in pixels/s2 that it gets where one is in a wall."""


@njit(cache=True, nogil=True)
def walk_on(
    solid: Grid,
    bodies: Bodies,
    tracks: Tracks,
    flow: Flow,
    walk: Walk,
    key: np.uint64,
    robot: Disc,
    seconds: float,
) -> None:
    """Move all people, one after the other; ``solid`` holds what stands still only."""
    people, errands = bodies.people, bodies.errands
    most = _ROAMED_M * walk.pixels_per_metre
    for p in range(len(people)):
        me = people[p]
        goal_x, goal_y = _goal(flow, errands[p, GOAL], solid.shape[1])
        me[WAITED] += seconds
        if math.hypot(me[X] - me[ANCHOR_X], me[Y] - me[ANCHOR_Y]) > most:
            me[ANCHOR_X], me[ANCHOR_Y], me[WAITED] = me[X], me[Y], 0.0
        arrived = math.hypot(me[X] - goal_x, me[Y] - goal_y) <= walk.arrive_px
        if not arrived and me[WAITED] > _PATIENCE_S:
            arrived = me[WAITED] > _PATIENCE_S * (1.0 + uniform(key, draw(p, errands[p, VISIT], 1)))
        if arrived:
            take_goal(bodies, flow, key, p)
            me[ANCHOR_X], me[ANCHOR_Y], me[WAITED] = me[X], me[Y], 0.0
        wish_x, wish_y = _direction(flow, errands[p, GOAL], me[X], me[Y], solid.shape[1])
        push_x, push_y = _push(solid, bodies, tracks, walk, p, wish_x, wish_y, robot)
        me[VX] += seconds * ((me[SPEED] * wish_x - me[VX]) / walk.relaxation_s + push_x)
        me[VY] += seconds * ((me[SPEED] * wish_y - me[VY]) / walk.relaxation_s + push_y)
        speed = math.hypot(me[VX], me[VY])
        if speed > _FASTEST * me[SPEED]:
            me[VX], me[VY] = me[VX] * _FASTEST * me[SPEED] / speed, me[VY] * _FASTEST * me[SPEED] / speed
        _go(solid, bodies, tracks, walk, p, robot, seconds)


@njit(cache=True, nogil=True)
def take_goal(bodies: Bodies, flow: Flow, key: np.uint64, p: int) -> None:
    """Draw a person's next goal, another one where there is another."""
    errands, goals = bodies.errands, flow.sizes[GOALS]
    errands[p, VISIT] += 1
    if goals > 1:
        by = 1 + int(uniform(key, draw(p, errands[p, VISIT], 0)) * (goals - 1))
        errands[p, GOAL] = (errands[p, GOAL] + by) % goals


@njit(cache=True, nogil=True)
def fits(
    solid: Grid,
    bodies: Bodies,
    tracks: Tracks,
    p: int,
    count: int,
    x: float,
    y: float,
    radius: float,
    robot: Disc,
) -> bool:
    """Whether person ``p`` may go from where it is to a place: it may leave, but not approach, what it overlaps.

    Walls are never overlapped, nor are the first ``count`` people. By its moves and the cells that are drawn of it, a
    person keeps off the robot; the robot, which goes by cells, may have come nearer by a part of one.
    """
    people = bodies.people
    for other in range(count):
        if other != p:
            off = (people[other, X] - x) ** 2 + (people[other, Y] - y) ** 2
            if off < 4.0 * radius * radius:
                return False
    off = math.hypot(robot.x - x, robot.y - y)
    gap = off - radius - robot.radius
    if gap < HALF_DIAGONAL:
        if gap < 0.0 and off <= math.hypot(robot.x - people[p, X], robot.y - people[p, Y]):
            return False
        if _covers_some(solid, x, y, radius, robot):
            return False
    for k in range(len(bodies.clocks)):
        clock = bodies.clocks[k]
        gap = gap_to(tracks, k, clock, x, y)
        if gap < radius and gap <= gap_to(tracks, k, clock, people[p, X], people[p, Y]):
            return False
    return disc_is_free(solid, x, y, radius)


@njit(cache=True, nogil=True)
def draw(p: int, visit: int, which: int) -> int:
    """Return the counter of a draw: one of eight at each visit of each person."""
    return (visit * PEOPLE_MOST + p) * 8 + which


@njit(cache=True, nogil=True)
def _covers_some(solid: Grid, x: float, y: float, radius: float, robot: Disc) -> bool:
    """Whether a cell that is drawn of a person meets the robot's disc."""
    top, bottom, left, right = box(solid.shape, robot.x, robot.y, robot.radius)
    for row in range(top, bottom):
        for col in range(left, right):
            if (col + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2 <= radius * radius:
                if cell_meets_disc(row, col, robot.x, robot.y, robot.radius):
                    return True
    return False


@njit(cache=True, nogil=True)
def _goal(flow: Flow, goal: int, cols: int) -> tuple[float, float]:
    spot = flow.spots[flow.goals[goal]]
    return spot % cols + 0.5, spot // cols + 0.5


@njit(cache=True, nogil=True)
def _direction(flow: Flow, goal: int, x: float, y: float, cols: int) -> tuple[float, float]:
    """Return the unit vector towards a spot a few blocks ahead, or nothing where no way is known."""
    wide, side = flow.sizes[COLS], flow.sizes[BLOCK_PX]
    first = goal * flow.sizes[ROWS] * wide
    block = int(y) // side * wide + int(x) // side
    for _ in range(_AHEAD):
        step = flow.toward[first + block]
        if step == NOWHERE:
            return 0.0, 0.0
        if step == THERE:
            break
        block += STEPS[step, 0] * wide + STEPS[step, 1]
    right, down = flow.spots[block] % cols + 0.5 - x, flow.spots[block] // cols + 0.5 - y
    length = math.hypot(right, down)
    return (right / length, down / length) if length > 0.0 else (0.0, 0.0)


@njit(cache=True, nogil=True)
def _push(
    solid: Grid,
    bodies: Bodies,
    tracks: Tracks,
    walk: Walk,
    p: int,
    wish_x: float,
    wish_y: float,
    robot: Disc,
) -> tuple[float, float]:
    """Return the acceleration away from all that is near, pixels/s2."""
    people, ppm = bodies.people, walk.pixels_per_metre
    x, y = people[p, X], people[p, Y]
    push_x, push_y = _social(robot.x - x, robot.y - y, 0.0, 0.0, wish_x, wish_y, ppm)
    for other in range(len(people)):
        if other != p:
            off_x, off_y = people[other, X] - x, people[other, Y] - y
            by_x, by_y = _social(off_x, off_y, people[other, VX], people[other, VY], wish_x, wish_y, ppm)
            push_x, push_y = push_x + by_x, push_y + by_y
    for k in range(len(bodies.clocks)):
        ahead, left, cos, sin = to_body(tracks, k, bodies.clocks[k], x, y)
        gap, a, b = nearest(tracks, k, ahead, left)
        length = math.hypot(a, b)
        if length > 0.0 and gap < _NO_PUSH_M * ppm:
            size = _PUSH_M_S2 * ppm * math.exp(-gap / (_PUSH_M * ppm)) / length
            push_x, push_y = push_x + size * (a * cos - b * sin), push_y - size * (a * sin + b * cos)
    rows, cols = solid.shape
    feelers = walk.feelers
    for i in range(len(feelers)):
        row, col = int(y + feelers[i, 1]), int(x + feelers[i, 0])
        if 0 <= row < rows and 0 <= col < cols and solid[row, col] != 0:
            push_x, push_y = push_x + feelers[i, 2], push_y + feelers[i, 3]
    return push_x, push_y


@njit(cache=True, nogil=True)
def _social(
    off_x: float, off_y: float, other_vx: float, other_vy: float, wish_x: float, wish_y: float, ppm: float
) -> tuple[float, float]:
    """Return the push from another at (``off_x``, ``off_y``) of here: equations 3 to 5 and 8 of the paper."""
    off = math.hypot(off_x, off_y)
    if off > _NO_PUSH_M * ppm or off == 0.0:
        return 0.0, 0.0
    step_x, step_y = other_vx * _NEXT_STEP_S, other_vy * _NEXT_STEP_S
    then_x, then_y = off_x + step_x, off_y + step_y
    then = max(math.hypot(then_x, then_y), 1e-9)
    b = math.sqrt(max((off + then) ** 2 - step_x * step_x - step_y * step_y, 1e-9)) / 2
    size = _PUSH_M_S2 * ppm * math.exp(-b / (_PUSH_M * ppm)) * (off + then) / (4 * b)
    size = min(size, 2 * _PUSH_M_S2 * ppm)
    push_x, push_y = -size * (off_x / off + then_x / then), -size * (off_y / off + then_y / then)
    if wish_x * off_x + wish_y * off_y < off * _COS_BEHIND:
        return _BEHIND * push_x, _BEHIND * push_y
    return push_x, push_y


@njit(cache=True, nogil=True)
def _go(
    solid: Grid,
    bodies: Bodies,
    tracks: Tracks,
    walk: Walk,
    p: int,
    robot: Disc,
    seconds: float,
) -> None:
    """Take a person's next place: straight on, else aside by 45 or 80 degrees, else where it is."""
    people = bodies.people
    me = people[p]
    for i in range(len(_TURNS)):
        cos, sin = _TURNS[i]
        vx, vy = (me[VX] * cos - me[VY] * sin) * _LENGTHS[i], (me[VX] * sin + me[VY] * cos) * _LENGTHS[i]
        x, y = me[X] + vx * seconds, me[Y] + vy * seconds
        if fits(solid, bodies, tracks, p, len(people), x, y, walk.radius_px, robot):
            me[X], me[Y], me[VX], me[VY] = x, y, vx, vy
            return
    me[VX], me[VY] = 0.0, 0.0
