"""Move people from goal to goal by social forces, and bodies on tracks; place people; mark the cells of all of them.

People are discs driven by the social force of Helbing and Molnar (1995): accelerations towards their goal, and away
from other people, the robot, walls and bodies. The force of another person has elliptical contours along that person's
next step, and is weaker from behind. Walls act through points around a person. With ``horizon_s``, ``orca`` chooses
their velocities instead. Neither prevents all overlaps; ``person_fits`` does, since a place where a disc would overlap
is never taken. Units are pixels and seconds.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.body_tracks import (
    BodyTracks,
    Tracks,
    body_may_move,
    distance_to_body,
    mark_body,
    nearest_body_point,
    to_body_frame,
    track_pose_at,
)
from houseexpo.pseudoslam.kernels.collision import (
    HALF_DIAGONAL,
    THINNER_PX,
    Disc,
    cell_meets_disc,
    disc_bounds,
    disc_columns,
    disc_is_free,
    erase_disc,
    mark_disc,
)
from houseexpo.pseudoslam.kernels.hashing import normal, uniform
from houseexpo.pseudoslam.kernels.orca import choose_velocity
from houseexpo.pseudoslam.kernels.planning.fields import NOWHERE, STEPS, THERE, FlowField
from houseexpo.pseudoslam.kernels.tolerances import (
    BEHIND_DEG,
    BEHIND_SHARE,
    FASTEST_SHARE,
    LOOK_AHEAD_BLOCKS,
    NEXT_STEP_S,
    NO_PUSH_M,
    PERSON_TRIES,
    PUSH_M,
    PUSH_M_S2,
    ROAMED_M,
    SUBSTEP_S,
    TIMEOUT_S,
)
from houseexpo.pseudoslam.kernels.types import Grid, Rows, as_bool, make_row_dtype

_COS_BEHIND = math.cos(math.radians(BEHIND_DEG))


FEELER = make_row_dtype(x=float, y=float, push_x=float, push_y=float)
"""A point beside a person, pixels, and the acceleration in pixels/s2 if the point is in a wall."""


class WalkParams(NamedTuple):
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
    horizon_s: float
    """How far ahead people by ORCA avoid others, seconds; 0 for social forces."""


@njit(cache=True, nogil=True)
def social_force(
    occupied: Grid, people: Rows, walk: WalkParams, p: int, wish_x: float, wish_y: float, robot: Disc
) -> tuple[float, float]:
    """Return the acceleration of person ``p`` away from walls, the robot and other people.

    The person's desired direction is (``wish_x``, ``wish_y``).
    """
    ppm = walk.pixels_per_metre
    x, y = people[p].x, people[p].y
    push_x, push_y = _push_of_walls(occupied, x, y, walk.feelers, walk.reach_px)
    if abs(robot.x - x) + abs(robot.y - y) < 2 * NO_PUSH_M * ppm:
        by_x, by_y = _force_of_person(robot.x - x, robot.y - y, 0.0, 0.0, wish_x, wish_y, ppm)
        push_x, push_y = push_x + by_x, push_y + by_y
    for i in range(len(people)):
        off_x, off_y = people[i].x - x, people[i].y - y
        if i != p and abs(off_x) + abs(off_y) < 2 * NO_PUSH_M * ppm:
            by_x, by_y = _force_of_person(off_x, off_y, people[i].vx, people[i].vy, wish_x, wish_y, ppm)
            push_x, push_y = push_x + by_x, push_y + by_y
    return push_x, push_y


@njit(cache=True, nogil=True)
def force_from_bodies(bodies: BodyTracks, tracks: Tracks, p: int, ppm: float) -> tuple[float, float]:
    """Return the acceleration of person ``p`` away from the nearest points of bodies on tracks."""
    push_x, push_y = 0.0, 0.0
    for k in range(len(bodies.clocks)):
        ahead, left, cos, sin = to_body_frame(tracks, k, bodies.clocks[k], bodies.people[p].x, bodies.people[p].y)
        gap, a, b = nearest_body_point(tracks, k, ahead, left)
        length = math.sqrt(a * a + b * b)
        if length > 0.0 and gap <= NO_PUSH_M * ppm:
            size = PUSH_M_S2 * ppm * math.exp(-gap / (PUSH_M * ppm)) / length
            push_x, push_y = push_x + size * (a * cos - b * sin), push_y - size * (a * sin + b * cos)
    return push_x, push_y


@njit(cache=True, nogil=True)
def _force_of_person(
    off_x: float, off_y: float, other_vx: float, other_vy: float, wish_x: float, wish_y: float, ppm: float
) -> tuple[float, float]:
    """Return the force of another person at the offset (``off_x``, ``off_y``): equations 3 to 5 and 8 of the paper."""
    off = math.sqrt(off_x * off_x + off_y * off_y)
    if off > NO_PUSH_M * ppm or off == 0.0:
        return 0.0, 0.0
    step_x, step_y = other_vx * NEXT_STEP_S, other_vy * NEXT_STEP_S
    then_x, then_y = off_x + step_x, off_y + step_y
    then = max(math.sqrt(then_x * then_x + then_y * then_y), 1e-9)
    axis = math.sqrt(max((off + then) ** 2 - step_x * step_x - step_y * step_y, 1e-9)) / 2
    size = PUSH_M_S2 * ppm * math.exp(-axis / (PUSH_M * ppm)) * min((off + then) / (4 * axis), 2.0)
    if wish_x * off_x + wish_y * off_y < off * _COS_BEHIND:
        size *= BEHIND_SHARE
    return -size * (off_x / off + then_x / then), -size * (off_y / off + then_y / then)


@njit(cache=True, nogil=True)
def _push_of_walls(occupied: Grid, x: float, y: float, feelers: Rows, reach: float) -> tuple[float, float]:
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


PEOPLE_MOST = 1024
"""Largest number of people in an environment, so that the random numbers of each are different."""
_STRIP = 16
_WAYS = np.array(
    [
        (length * math.cos(math.radians(angle)), length * math.sin(math.radians(angle)))
        for angle, length in ((0, 1.0), (45, 0.7), (-45, 0.7), (80, 0.35), (-80, 0.35))
    ]
)  # turn and length, (cos, sin): straight on, or else around an obstacle, to the right first


@njit(cache=True, nogil=True)
def walk_people(
    occupied: Grid,
    bodies: BodyTracks,
    tracks: Tracks,
    flow: FlowField,
    walk: WalkParams,
    key: int,
    robot: Disc,
    seconds: float,
) -> None:
    """Move all people, one after the other; ``occupied`` contains only static obstacles."""
    people = bodies.people
    beside_tracks, beside_robots = len(bodies.clocks) > 0, len(bodies.robots) > 1
    for p in range(len(people)):
        people[p].waited += seconds
        spot = flow.goals[people[p].goal]
        done = _is_done(people, p, flow.spots[spot, 0], flow.spots[spot, 1], walk.arrive_px, walk.pixels_per_metre)
        if not done and people[p].waited > TIMEOUT_S:
            done = people[p].waited > TIMEOUT_S * (1.0 + uniform(key, draw_counter(p, people[p].visit, 1)))
        if done:
            draw_next_goal(bodies, flow, key, p)
        wish_x, wish_y = _direction(flow, people[p].goal, people[p].x, people[p].y)
        if walk.horizon_s > 0.0:
            vx, vy = choose_velocity(
                occupied, bodies, tracks, walk.feelers, walk.horizon_s, walk.radius_px, robot, p, wish_x, wish_y,
                seconds,
            )  # fmt: skip
        else:
            push_x, push_y = social_force(occupied, people, walk, p, wish_x, wish_y, robot)
            if beside_tracks:
                by_x, by_y = force_from_bodies(bodies, tracks, p, walk.pixels_per_metre)
                push_x, push_y = push_x + by_x, push_y + by_y
            vx, vy = _accelerate(people, p, wish_x, wish_y, push_x, push_y, walk.relaxation_s, seconds)
        people[p].vx, people[p].vy = 0.0, 0.0
        for i in range(len(_WAYS)):
            cos, sin = _WAYS[i, 0], _WAYS[i, 1]
            new_vx, new_vy = vx * cos - vy * sin, vx * sin + vy * cos
            x, y = people[p].x + new_vx * seconds, people[p].y + new_vy * seconds
            if (
                person_fits(occupied, people, len(people), p, x, y, walk.radius_px, robot)
                and (not beside_tracks or person_fits_bodies(bodies, tracks, p, x, y, walk.radius_px))
                and (not beside_robots or person_fits_robots(bodies, p, x, y, walk.radius_px + robot.radius))
            ):
                people[p].x, people[p].y, people[p].vx, people[p].vy = x, y, new_vx, new_vy
                break


@njit(cache=True, nogil=True)
def draw_next_goal(bodies: BodyTracks, flow: FlowField, key: int, p: int) -> None:
    """Draw a person's next goal, a different one if there are several."""
    people, goals = bodies.people, flow.sizes[0].goals
    people[p].anchor_x, people[p].anchor_y, people[p].waited = people[p].x, people[p].y, 0.0
    people[p].visit += 1
    if goals > 1:
        by = 1 + int(uniform(key, draw_counter(p, people[p].visit, 0)) * (goals - 1))
        people[p].goal = (people[p].goal + by) % goals


@njit(inline="always")
def draw_counter(p: int, visit: int, which: int) -> int:
    """Return the counter of a random draw, one of eight for each visit of each person."""
    return (visit * PEOPLE_MOST + p) * 8 + which


@njit(cache=True, nogil=True)
def person_fits(
    occupied: Grid, people: Rows, count: int, p: int, x: float, y: float, radius: float, robot: Disc
) -> bool:
    """Return whether walls, the first ``count`` people and the robot allow person ``p`` to be at a place.

    The robot moves by cells, so that its disc may already overlap a person's; the person may then move away, but not
    closer. No cell that is drawn for a person may touch the robot's disc.
    """
    for i in range(count):
        if i != p and (people[i].x - x) ** 2 + (people[i].y - y) ** 2 < 4.0 * radius * radius:
            return False
    off = (robot.x - x) ** 2 + (robot.y - y) ** 2
    touch = radius + robot.radius
    if off < (touch + HALF_DIAGONAL) ** 2:
        if off < touch * touch and off <= (robot.x - people[p].x) ** 2 + (robot.y - people[p].y) ** 2:
            return False
        if _covers_some(occupied, x, y, radius, robot):
            return False
    return _box_is_free(occupied, x, y, radius) or disc_is_free(occupied, x, y, radius)


@njit(cache=True, nogil=True)
def person_fits_bodies(bodies: BodyTracks, tracks: Tracks, p: int, x: float, y: float, radius: float) -> bool:
    """Return whether bodies on tracks allow person ``p`` to be at a place; it may leave one that it overlaps."""
    for k in range(len(bodies.clocks)):
        clock = bodies.clocks[k]
        gap = distance_to_body(tracks, k, clock, x, y)
        if gap < radius and gap <= distance_to_body(tracks, k, clock, bodies.people[p].x, bodies.people[p].y):
            return False
    return True


@njit(cache=True, nogil=True)
def person_fits_robots(bodies: BodyTracks, p: int, x: float, y: float, touch: float) -> bool:
    """Return whether the other robots of a team allow person ``p`` to be at a place, ``touch`` or more from each.

    The person may move away from one that it overlaps.
    """
    me = bodies.people[p]
    for k in range(1, len(bodies.robots)):
        at_x, at_y = bodies.robots[k, 0], bodies.robots[k, 1]
        off = (at_x - x) ** 2 + (at_y - y) ** 2
        if off < touch * touch and off <= (at_x - me.x) ** 2 + (at_y - me.y) ** 2:
            return False
    return True


@njit(cache=True, nogil=True)
def _accelerate(
    people: Rows, p: int, wish_x: float, wish_y: float, push_x: float, push_y: float, relaxation_s: float, s: float
) -> tuple[float, float]:
    """Return a person's velocity after ``s`` seconds, given the desired one and the forces; its speed is limited."""
    vx, vy, speed = people[p].vx, people[p].vy, people[p].speed
    vx += s * ((speed * wish_x - vx) / relaxation_s + push_x)
    vy += s * ((speed * wish_y - vy) / relaxation_s + push_y)
    most = FASTEST_SHARE * speed
    slower = most / max(math.sqrt(vx * vx + vy * vy), most)
    return vx * slower, vy * slower


@njit(cache=True, nogil=True)
def _is_done(people: Rows, p: int, row: int, col: int, arrive: float, ppm: float) -> bool:
    """Return whether a person has arrived at a cell; reset the waiting time of one that has moved on."""
    x, y = people[p].x, people[p].y
    right, down = col + 0.5 - x, row + 0.5 - y
    if right * right + down * down <= arrive * arrive:
        return True
    roamed = (x - people[p].anchor_x) ** 2 + (y - people[p].anchor_y) ** 2
    if roamed > (ROAMED_M * ppm) ** 2:
        people[p].anchor_x, people[p].anchor_y, people[p].waited = x, y, 0.0
    return False


@njit(cache=True, nogil=True)
def _direction(flow: FlowField, goal: int, x: float, y: float) -> tuple[float, float]:
    """Return the unit vector towards a spot a few blocks ahead, or zero if no path is known."""
    size = flow.sizes[0]
    rows, cols, side = size.rows, size.cols, float(size.block_px)
    first = goal * rows * cols
    block = int(y / side) * cols + int(x / side)
    for _ in range(LOOK_AHEAD_BLOCKS):
        step = flow.toward[first + block]
        if step == NOWHERE:
            return 0.0, 0.0
        if step == THERE:
            break
        block += STEPS[step, 0] * cols + STEPS[step, 1]
    right, down = flow.spots[block, 1] + 0.5 - x, flow.spots[block, 0] + 0.5 - y
    length = math.sqrt(right * right + down * down)
    return (right / length, down / length) if length > 0.0 else (0.0, 0.0)


@njit(cache=True, nogil=True)
def _box_is_free(occupied: Grid, x: float, y: float, radius: float) -> bool:
    """Return whether the box around a disc is free: four times faster than the exact test, and usually sufficient.

    Strips of 16 cells whose indices cannot be negative compile to one instruction each.
    """
    rows, cols = occupied.shape
    if cols < _STRIP or x < radius or y < radius or x > cols - radius or y > rows - radius:
        return False
    top, bottom, left, right = disc_bounds(occupied.shape, x, y, radius)
    found = np.uint8(0)
    for row in range(np.uint64(top), np.uint64(bottom)):
        for start in range(left, right, _STRIP):
            first = np.uint64(min(start, cols - _STRIP))
            for i in range(np.uint64(_STRIP)):
                found |= occupied[row, first + i]
    return bool(found == 0)


@njit(cache=True, nogil=True)
def _covers_some(occupied: Grid, x: float, y: float, radius: float, robot: Disc) -> bool:
    """Return whether a cell that is drawn for a person touches the robot's disc."""
    top, bottom, left, right = disc_bounds(occupied.shape, robot.x, robot.y, robot.radius)
    for row in range(top, bottom):
        first, end = disc_columns(row, x, y, radius)
        for col in range(max(first, left), min(end, right)):
            if cell_meets_disc(row, col, robot.x, robot.y, robot.radius):
                return True
    return False


_SPEEDS = 1 << 40  # counters beyond all others


@njit(cache=True, nogil=True)
def place_people(
    occupied: Grid,
    bodies: BodyTracks,
    tracks: Tracks,
    flow: FlowField,
    walk: WalkParams,
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
        people[p].goal = int(uniform(key, draw_counter(p, 0, 4)) * flow.sizes[0].goals)
        draw_next_goal(bodies, flow, key, p)
    return len(people)


@njit(cache=True, nogil=True)
def _find_place(
    occupied: Grid,
    bodies: BodyTracks,
    tracks: Tracks,
    flow: FlowField,
    walk: WalkParams,
    key: int,
    p: int,
    robot: Disc,
    away_px: float,
) -> bool:
    """Draw a place for person ``p``; after too many draws, try all spots, starting at the last one drawn."""
    me, blocks = bodies.people[p], flow.sizes[0].rows * flow.sizes[0].cols
    least = robot.radius + walk.radius_px + HALF_DIAGONAL
    block = 0
    for i in range(PERSON_TRIES + blocks):
        drawn = i < PERSON_TRIES
        block = int(uniform(key, draw_counter(p, i, 5)) * blocks) if drawn else (block + 1) % blocks
        if flow.spots[block, 0] < 0:
            continue
        me.x = flow.spots[block, 1] + (uniform(key, draw_counter(p, i, 6)) if drawn else 0.5)
        me.y = flow.spots[block, 0] + (uniform(key, draw_counter(p, i, 7)) if drawn else 0.5)
        far = max(away_px, least) if drawn else least
        if math.hypot(robot.x - me.x, robot.y - me.y) < far:
            continue
        if person_fits(occupied, bodies.people, p, p, me.x, me.y, walk.radius_px, robot) and (
            person_fits_bodies(bodies, tracks, p, me.x, me.y, walk.radius_px)
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def move_bodies(
    occupied: Grid,
    bodies: BodyTracks,
    tracks: Tracks,
    flow: FlowField,
    walk: WalkParams,
    key: int,
    robot: Disc,
    seconds: float,
) -> None:
    """Move all bodies for a time, and the moving bits of ``occupied`` with them; the robot's disc does not move.

    Bodies on tracks move first; the clock of one that would run into the robot or a person stops. Then people walk. No
    body covers a cell that touches the robot's disc.
    """
    if len(bodies.clocks) + len(bodies.people) == 0:
        return
    erase_bodies(occupied, bodies, tracks, walk)
    for k in range(1, len(bodies.robots)):  # where people stood beside them
        mark_disc(occupied, bodies.robots[k, 0], bodies.robots[k, 1], max(robot.radius - THINNER_PX, 1.0))
    parts = _substeps(bodies, tracks, walk, robot.radius, seconds)
    for _ in range(parts):
        for k in range(len(bodies.clocks)):
            _run(bodies, tracks, walk, k, robot, seconds / parts)
        walk_people(occupied, bodies, tracks, flow, walk, key, robot, seconds / parts)
    mark_bodies(occupied, bodies, tracks, walk)


@njit(cache=True, nogil=True)
def mark_bodies(occupied: Grid, bodies: BodyTracks, tracks: Tracks, walk: WalkParams) -> None:
    """Set the moving bits of all bodies, by cells' centres."""
    for k in range(len(bodies.clocks)):
        mark_body(occupied, tracks, k, bodies.clocks[k])
    for p in range(len(bodies.people)):
        mark_disc(occupied, bodies.people[p].x, bodies.people[p].y, walk.radius_px)


@njit(cache=True, nogil=True)
def erase_bodies(occupied: Grid, bodies: BodyTracks, tracks: Tracks, walk: WalkParams) -> None:
    """Clear the moving bits of all bodies."""
    for k in range(len(bodies.clocks)):
        x, y, _ = track_pose_at(tracks, k, bodies.clocks[k])
        erase_disc(occupied, x, y, tracks.shapes[k].reach)
    for p in range(len(bodies.people)):
        erase_disc(occupied, bodies.people[p].x, bodies.people[p].y, walk.radius_px)


@njit(cache=True, nogil=True)
def _substeps(bodies: BodyTracks, tracks: Tracks, walk: WalkParams, robot_radius: float, seconds: float) -> int:
    """Return the number of substeps, so that no body on a track can jump over the robot or a person."""
    parts = math.ceil(seconds / SUBSTEP_S - 1e-9)
    least = min(robot_radius, walk.radius_px) if len(bodies.people) > 0 else robot_radius
    for k in range(len(bodies.clocks)):
        parts = max(parts, math.ceil(tracks.shapes[k].fastest * seconds / least))
    return max(parts, 1)


@njit(cache=True, nogil=True)
def _run(
    bodies: BodyTracks,
    tracks: Tracks,
    walk: WalkParams,
    k: int,
    robot: Disc,
    seconds: float,
) -> None:
    """Advance a track's clock unless its body is blocked."""
    before = bodies.clocks[k]
    after, end = before + seconds, tracks.times_s[k, tracks.shapes[k].poses - 1]
    if after > end:
        after = after % end if tracks.shapes[k].loops else end
    if not body_may_move(tracks, k, before, after, robot, as_bool(True)):
        return
    for p in range(len(bodies.people)):
        person = Disc(bodies.people[p].x, bodies.people[p].y, walk.radius_px)
        if not body_may_move(tracks, k, before, after, person, as_bool(False)):
            return
    bodies.clocks[k] = after
