"""People: discs that walk from goal to goal, driven by forces, and never overlap anything.

Forces alone do not ensure this; ``fits`` does, since a place where a disc would overlap is never taken.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.hashing import uniform
from houseexpo.pseudoslam.kernels.motion.bodies import (
    HALF_DIAGONAL,
    Bodies,
    Disc,
    Tracks,
    box,
    cell_meets_disc,
    disc_span,
    gap_to,
)
from houseexpo.pseudoslam.kernels.motion.disc import disc_is_free
from houseexpo.pseudoslam.kernels.people.social_force import Walk, push, push_by_tracks
from houseexpo.pseudoslam.kernels.planning.flow import NOWHERE, STEPS, THERE, Flow
from houseexpo.pseudoslam.kernels.types import Grid, Rows

PEOPLE_MOST = 1024
"""Largest number of people in an environment, so that the random numbers of each are different."""
_AHEAD = 2  # blocks that a person looks ahead
_STRIP = 16
_FASTEST = 1.3  # times the desired speed
_ROAMED_M, _TIMEOUT_S = 0.5, 3.0  # who stays within this for so long, or up to twice as long, gives up the goal
_WAYS = np.array(
    [
        (length * math.cos(math.radians(angle)), length * math.sin(math.radians(angle)))
        for angle, length in ((0, 1.0), (45, 0.7), (-45, 0.7), (80, 0.35), (-80, 0.35))
    ]
)  # turn and length, (cos, sin): straight on, or else around an obstacle, to the right first


@njit(cache=True, nogil=True)
def walk_on(
    occupied: Grid, bodies: Bodies, tracks: Tracks, flow: Flow, walk: Walk, key: int, robot: Disc, seconds: float
) -> None:
    """Move all people, one after the other; ``occupied`` contains only static obstacles."""
    people = bodies.people
    beside_tracks = len(bodies.clocks) > 0
    for p in range(len(people)):
        people[p].waited += seconds
        spot = flow.goals[people[p].goal]
        done = _is_done(people, p, flow.spots[spot, 0], flow.spots[spot, 1], walk.arrive_px, walk.pixels_per_metre)
        if not done and people[p].waited > _TIMEOUT_S:
            done = people[p].waited > _TIMEOUT_S * (1.0 + uniform(key, draw(p, people[p].visit, 1)))
        if done:
            take_goal(bodies, flow, key, p)
        wish_x, wish_y = _direction(flow, people[p].goal, people[p].x, people[p].y)
        push_x, push_y = push(occupied, people, walk, p, wish_x, wish_y, robot)
        if beside_tracks:
            by_x, by_y = push_by_tracks(bodies, tracks, p, walk.pixels_per_metre)
            push_x, push_y = push_x + by_x, push_y + by_y
        vx, vy = _faster(people, p, wish_x, wish_y, push_x, push_y, walk.relaxation_s, seconds)
        people[p].vx, people[p].vy = 0.0, 0.0
        for i in range(len(_WAYS)):
            cos, sin = _WAYS[i, 0], _WAYS[i, 1]
            new_vx, new_vy = vx * cos - vy * sin, vx * sin + vy * cos
            x, y = people[p].x + new_vx * seconds, people[p].y + new_vy * seconds
            if fits(occupied, people, len(people), p, x, y, walk.radius_px, robot) and (
                not beside_tracks or fits_bodies(bodies, tracks, p, x, y, walk.radius_px)
            ):
                people[p].x, people[p].y, people[p].vx, people[p].vy = x, y, new_vx, new_vy
                break


@njit(cache=True, nogil=True)
def take_goal(bodies: Bodies, flow: Flow, key: int, p: int) -> None:
    """Draw a person's next goal, a different one if there are several."""
    people, goals = bodies.people, flow.sizes[0].goals
    people[p].anchor_x, people[p].anchor_y, people[p].waited = people[p].x, people[p].y, 0.0
    people[p].visit += 1
    if goals > 1:
        by = 1 + int(uniform(key, draw(p, people[p].visit, 0)) * (goals - 1))
        people[p].goal = (people[p].goal + by) % goals


@njit(cache=True, nogil=True)
def draw(p: int, visit: int, which: int) -> int:
    """Return the counter of a random draw, one of eight for each visit of each person."""
    return (visit * PEOPLE_MOST + p) * 8 + which


@njit(cache=True, nogil=True)
def fits(occupied: Grid, people: Rows, count: int, p: int, x: float, y: float, radius: float, robot: Disc) -> bool:
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
def fits_bodies(bodies: Bodies, tracks: Tracks, p: int, x: float, y: float, radius: float) -> bool:
    """Return whether bodies on tracks allow person ``p`` to be at a place; it may leave one that it overlaps."""
    for k in range(len(bodies.clocks)):
        clock = bodies.clocks[k]
        gap = gap_to(tracks, k, clock, x, y)
        if gap < radius and gap <= gap_to(tracks, k, clock, bodies.people[p].x, bodies.people[p].y):
            return False
    return True


@njit(cache=True, nogil=True)
def _faster(
    people: Rows, p: int, wish_x: float, wish_y: float, push_x: float, push_y: float, relaxation_s: float, s: float
) -> tuple[float, float]:
    """Return a person's velocity after ``s`` seconds, given the desired one and the forces; its speed is limited."""
    vx, vy, speed = people[p].vx, people[p].vy, people[p].speed
    vx += s * ((speed * wish_x - vx) / relaxation_s + push_x)
    vy += s * ((speed * wish_y - vy) / relaxation_s + push_y)
    most = _FASTEST * speed
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
    if roamed > (_ROAMED_M * ppm) ** 2:
        people[p].anchor_x, people[p].anchor_y, people[p].waited = x, y, 0.0
    return False


@njit(cache=True, nogil=True)
def _direction(flow: Flow, goal: int, x: float, y: float) -> tuple[float, float]:
    """Return the unit vector towards a spot a few blocks ahead, or zero if no path is known."""
    size = flow.sizes[0]
    rows, cols, side = size.rows, size.cols, float(size.block_px)
    first = goal * rows * cols
    block = int(y / side) * cols + int(x / side)
    for _ in range(_AHEAD):
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
    top, bottom, left, right = box(occupied.shape, x, y, radius)
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
    top, bottom, left, right = box(occupied.shape, robot.x, robot.y, robot.radius)
    for row in range(top, bottom):
        first, end = disc_span(row, x, y, radius)
        for col in range(max(first, left), min(end, right)):
            if cell_meets_disc(row, col, robot.x, robot.y, robot.radius):
                return True
    return False
