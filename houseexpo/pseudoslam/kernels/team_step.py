"""What a step of one robot of many teams needs before the robot moves, and after it.

Robots of a team move one after the other, and teams do not know each other. So a step takes the robots with the same
number of all teams together: ``prepare`` or ``prepare_drives``, then the step of a single robot (``kernels.step`` or
``kernels.driving``), then ``gather``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.collision import THINNER_PX, placed_people, stamp_disc, way_to_disc
from houseexpo.pseudoslam.kernels.driving import path_of, way_past_discs
from houseexpo.pseudoslam.kernels.odometry import grip
from houseexpo.pseudoslam.kernels.teams import merge_map
from houseexpo.pseudoslam.kernels.types import Counts, Drive, Errors, Floats, Grid, Robot, Rows, row_type

APART_PX = 1e-6
"""The distance that discs keep, so that rounding does not make them overlap."""
NOTHING, ROBOT, SOMEONE = range(3)
"""What is in a robot's way beside what is in its cells: a person counts for all but the first robot, whose step moves
the people and keeps off them itself."""
MOST_CELLS = np.iinfo(np.int64).max
TOGETHER = row_type(
    steps=int, covered=int, explored=int, found=int, meetings=int, joined=int, steps_90=float, steps_99=float,
    metres_90=float, metres_99=float,
)  # fmt: skip
"""Of a team: the steps so far; the cells that its robots know together, those that coverage counts and all of them; the
cells that were unknown to the robot that saw them, over all robots; how often one robot was blocked by another; after
how many steps each robot reached each other one by radio; and the steps, and the metres of all robots together, until
the team knew shares of what can be seen, NaN before."""


class Others(NamedTuple):
    """What robots of N teams are in the way of: walls, people and each other."""

    walls: Grid
    """(N, cells), not 0 for what does not move."""
    people: Rows
    """(N, P) ``PERSON``."""
    places: Floats
    """(N, robots, 2), the robots' places, pixels, which ``gather`` updates: ``Bodies.robots`` of the first robots."""
    meets: Grid
    """(N,), what is in the way of the robot that ``prepare`` was called for: ``NOTHING``, ``ROBOT`` or ``SOMEONE``."""
    radius_px: float
    """The radius of a robot."""
    people_px: float
    """The radius of a person."""


@njit(cache=True, nogil=True)
def prepare(
    occupied: Grid, counts: Rows, poses: Rows, sizes: Counts, motions: Floats, others: Others, errors: Errors,
    robot: int, first: int, end: int,
) -> None:  # fmt: skip
    """Draw what stands and moves round one robot of each team into its cells, and shorten its motion.

    Parameters
    ----------
    occupied, counts, poses, sizes
        Arrays of the pool of these robots' episodes: (N, cells), (N, 1), (N, 1); and the rows and columns of each one's
        rasters (N, 2).
    motions
        (N, 2), turns and distances, radians and pixels, which are shortened in place.
    robot
        The robot's number in its team.
    first, end
        Teams ``first`` to ``end``, excluded.
    """
    places, reach, reach_people = others.places, 2.0 * others.radius_px, others.radius_px + others.people_px
    for i in range(first, end):
        draw_round(occupied, sizes, others, robot, i)
        pose = poses[i, 0]
        held = grip(errors, counts[i, 0].key, counts[i, 0].steps + 1)
        turn, forward = motions[i, 0] * held, motions[i, 1] * held
        sign = -1.0 if forward < 0.0 else 1.0
        right, down = sign * math.cos(pose.heading + turn), -sign * math.sin(pose.heading + turn)
        distance = abs(forward)
        free = distance
        for k in range(places.shape[1]):
            if k != robot:
                x, y = places[i, k, 0] - pose.x, places[i, k, 1] - pose.y
                free = min(free, way_to_disc(x, y, right, down, reach, APART_PX))
        others.meets[i] = ROBOT if free < distance else NOTHING
        if robot > 0:
            here = placed_people(others.people[i])
            for p in range(len(here)):
                x, y = here[p].x - pose.x, here[p].y - pose.y
                way = way_to_disc(x, y, right, down, reach_people, APART_PX)
                if way < free:
                    free, others.meets[i] = way, SOMEONE
        if free < distance:
            motions[i, 1] = math.copysign(free, forward) / held


@njit(cache=True, nogil=True)
def prepare_drives(
    occupied: Grid, counts: Rows, poses: Rows, sizes: Counts, commands: Floats, others: Others, errors: Errors,
    robot: int, first: int, end: int, readings: Rows, drive: Drive, shape: Robot, seconds: float,
) -> None:  # fmt: skip
    """Do the same as ``prepare`` for robots with a drive; ``commands`` (N, 3) are those of ``kernels.driving``."""
    places = others.places
    discs = np.empty((places.shape[1] - 1, 2))
    for i in range(first, end):
        draw_round(occupied, sizes, others, robot, i)
        held = grip(errors, counts[i, 0].key, counts[i, 0].steps + 1)
        for k in range(len(discs)):
            other = k if k < robot else k + 1
            discs[k, 0], discs[k, 1] = places[i, other, 0], places[i, other, 1]
        path = path_of(readings[i, 0], commands[i, 0], commands[i, 1], drive, shape, seconds, held)
        free = way_past_discs(path, poses[i, 0], discs, 2.0 * others.radius_px, APART_PX)
        others.meets[i] = ROBOT if free < math.inf else NOTHING
        if robot > 0:
            here = placed_people(others.people[i])
            centres = np.empty((len(here), 2))
            for p in range(len(here)):
                centres[p, 0], centres[p, 1] = here[p].x, here[p].y
            way = way_past_discs(path, poses[i, 0], centres, others.radius_px + others.people_px, APART_PX)
            if way < free:
                free, others.meets[i] = way, SOMEONE
        commands[i, 2] = free


@njit(cache=True, nogil=True)
def draw_round(occupied: Grid, sizes: Counts, others: Others, robot: int, i: int) -> None:
    """Draw walls, people and the other robots of team ``i`` into the cells of one of its robots."""
    rows, cols = sizes[i, 0], sizes[i, 1]
    cells = rows * cols
    for cell in range(cells):
        occupied[i, np.uint64(cell)] = others.walls[i, np.uint64(cell)]
    raster = occupied[i, :cells].reshape((rows, cols))
    thinner = THINNER_PX if robot > 0 else 0.0
    here = placed_people(others.people[i])
    for p in range(len(here)):
        stamp_disc(raster, here[p].x, here[p].y, max(others.people_px - thinner, 1.0))
    for k in range(others.places.shape[1]):
        if k != robot:
            x, y = others.places[i, k, 0], others.places[i, k, 1]
            stamp_disc(raster, x, y, max(others.radius_px - THINNER_PX, 1.0))


@njit(cache=True, nogil=True)
def gather(
    observable: Grid, known: Grid, counts: Rows, poses: Rows, sizes: Counts, others: Others, team_known: Grid,
    together: Rows, had: Counts, reach_px: float, robot: int, first: int, end: int,
) -> None:  # fmt: skip
    """Count what one robot of each team has met and seen in its step, and add it to what the team knows.

    Parameters
    ----------
    team_known
        (N, cells), what the robots of each team know together.
    together
        (N,) ``TOGETHER``.
    had
        (N,), the number of cells that the robot knew before the step.
    reach_px
        Greatest distance from the robot's place at which a step changes the map; infinite if it may be anywhere.
    """
    for i in range(first, end):
        rows, cols = sizes[i, 0], sizes[i, 1]
        cells = rows * cols
        count, pose = counts[i, 0], poses[i, 0]
        if others.meets[i] != NOTHING:
            count.collisions += 1 - count.blocked
            count.blocked = 1
            together[i].meetings += 1 if others.meets[i] == ROBOT else 0
            others.meets[i] = NOTHING
        others.places[i, robot, 0], others.places[i, robot, 1] = pose.x, pose.y
        box = np.array([0, rows, 0, cols])
        if reach_px < math.inf and together[i].steps > 0:
            box[0], box[2] = max(int(pose.seen_y - reach_px), 0), max(int(pose.seen_x - reach_px), 0)
            box[1], box[3] = min(int(pose.seen_y + reach_px) + 1, rows), min(int(pose.seen_x + reach_px) + 1, cols)
        new, covered = merge_map(
            team_known[i, :cells].reshape((rows, cols)), observable[i, :cells].reshape((rows, cols)),
            known[i, :cells].reshape((rows, cols)), box, MOST_CELLS,
        )  # fmt: skip
        together[i].explored += new
        together[i].covered += covered
        together[i].found += count.known - had[i]
