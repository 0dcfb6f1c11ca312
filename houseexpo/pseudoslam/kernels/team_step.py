"""Prepare a step of one robot in each of many teams (its obstacles), and afterwards count collisions and new cells.

Robots of a team move one after the other, and teams do not know each other. So a step takes the robots with the same
number of all teams together: ``prepare_motions`` or ``prepare_commands``, then the step of a single robot
(``kernels.step`` or ``kernels.driving``), then ``count_met_and_seen``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.collision import (
    THINNER_PX,
    distance_to_disc,
    erase_disc,
    mark_disc,
    placed_people,
    unmark_disc,
)
from houseexpo.pseudoslam.kernels.driving import command_path, path_length_to_disc
from houseexpo.pseudoslam.kernels.mapping import CHUNK, CHUNK_BITS, FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.odometry import grip_share
from houseexpo.pseudoslam.kernels.types import (
    Bits,
    Counts,
    Drive,
    Errors,
    Floats,
    Grid,
    RobotBody,
    Rows,
    make_row_dtype,
)

APART_PX = 1e-6
"""The distance that discs keep, so that rounding does not make them overlap."""
LEVELS = 0.9, 0.99
"""The coverages for which ``TOGETHER`` records steps and metres."""
EVERYONE = 0xFFFF
"""The set of all robots of a team, of which there are at most 16."""
NOTHING, ROBOT, SOMEONE = range(3)
"""What is in a robot's way beside what is in its cells: a person counts for all but the first robot, whose step moves
the people and keeps off them itself."""
TOGETHER = make_row_dtype(
    steps=int, covered=int, explored=int, found=int, meetings=int, joined=int, steps_90=float, steps_99=float,
    metres_90=float, metres_99=float,
)  # fmt: skip
"""Of a team: the steps so far; the cells that its robots know together, those that coverage counts and all of them; the
cells that were unknown to the robot that saw them, over all robots; how often one robot was blocked by another; after
how many steps each robot reached each other one by radio; and the steps, and the metres of all robots together, until
the team knew shares of what can be seen, NaN before."""


class TeamObstacles(NamedTuple):
    """The obstacles of the robots of N teams of R: walls, people and each other.

    Pools of robots have N * R rows: the robots of the first team, then those of the next.
    """

    walls: Grid
    """(N, cells), not 0 for static obstacles."""
    people: Rows
    """(N * R, P) ``PERSON``, of which the first robots' count."""
    places: Floats
    """(N * R, R, 2), ``BodyTracks.robots``, of which the first robots' count: the robots' places, pixels;
    ``count_met_and_seen`` updates them."""
    drawn: Floats
    """(N * R, R + P, 2), where robots and people are drawn in the cells of each robot, NaN where not."""
    meets: Grid
    """(N,), what is in the way of the robot that is prepared: ``NOTHING``, ``ROBOT`` or ``SOMEONE``."""
    had: Counts
    """(N,), the number of cells that this robot knew before its step."""
    radius_px: float
    """The radius of a robot."""
    people_px: float
    """The radius of a person."""
    sight_px: float
    """The distance beyond which a robot that stands still neither sees, touches nor measures another."""


class TeamKnowledge(NamedTuple):
    """The combined knowledge of N teams of R robots, and the parts that robots have not sent each other yet."""

    known: Grid
    """(N, cells), the cells that some robot of each team knows."""
    pending: Bits
    """(N, R, chunks): bit i of a chunk (``mapping.CHUNK``) of robot j is set if robot j may know cells in it that robot
    i has not been told; (N, R, 0) if they never tell."""
    waiting: Bits
    """(N, R, groups), the bits that are set in any of ``CHUNK`` chunks, one after the other."""
    together: Rows
    """(N,) ``TOGETHER``."""


@njit(cache=True, nogil=True)
def prepare_motions(
    occupied: Grid, counts: Rows, poses: Rows, sizes: Counts, motions: Floats, others: TeamObstacles, errors: Errors,
    robot: int, first: int, end: int,
) -> None:  # fmt: skip
    """Draw what stands and moves round one robot of each team into its cells, and shorten its motion.

    Parameters
    ----------
    occupied, counts, poses, sizes
        Arrays of the pool of all robots: (N * R, cells), (N * R, 1), (N * R, 1); and the rows and columns of each one's
        rasters (N * R, 2).
    motions
        (N * R, 2), turns and distances, radians and pixels, which are shortened in place.
    robot
        The robot's number in its team.
    first, end
        Teams ``first`` to ``end``, excluded.
    """
    robots = others.places.shape[1]
    reach, reach_people = 2.0 * others.radius_px, others.radius_px + others.people_px
    for i in range(first, end):
        row = i * robots + robot
        pose, places = poses[row, 0], others.places[i * robots]
        held = grip_share(errors, counts[row, 0].key, counts[row, 0].steps + 1)
        turn, forward = motions[row, 0] * held, motions[row, 1] * held
        _begin(occupied, counts, sizes, others, robot, i, others.sight_px + abs(forward))
        sign = -1.0 if forward < 0.0 else 1.0
        right, down = sign * math.cos(pose.heading + turn), -sign * math.sin(pose.heading + turn)
        distance = abs(forward)
        free = distance
        for k in range(robots):
            if k != robot:
                x, y = places[k, 0] - pose.x, places[k, 1] - pose.y
                free = min(free, distance_to_disc(x, y, right, down, reach, APART_PX))
        others.meets[i] = ROBOT if free < distance else NOTHING
        if robot > 0:
            here = placed_people(others.people[i * robots])
            for p in range(len(here)):
                x, y = here[p].x - pose.x, here[p].y - pose.y
                way = distance_to_disc(x, y, right, down, reach_people, APART_PX)
                if way < free:
                    free, others.meets[i] = way, SOMEONE
        if free < distance:
            motions[row, 1] = math.copysign(free, forward) / held


@njit(cache=True, nogil=True)
def prepare_commands(
    occupied: Grid, counts: Rows, poses: Rows, sizes: Counts, commands: Floats, others: TeamObstacles, errors: Errors,
    robot: int, first: int, end: int, readings: Rows, drive: Drive, shape: RobotBody, seconds: float,
) -> None:  # fmt: skip
    """Do as ``prepare_motions`` for robots with a drive; ``commands`` (N * R, 3) are those of ``kernels.driving``."""
    robots = others.places.shape[1]
    discs = np.empty((robots - 1, 2))
    for i in range(first, end):
        row = i * robots + robot
        _begin(occupied, counts, sizes, others, robot, i, math.inf)
        held = grip_share(errors, counts[row, 0].key, counts[row, 0].steps + 1)
        for k in range(len(discs)):
            discs[k] = others.places[i * robots, k if k < robot else k + 1]
        path = command_path(readings[row, 0], commands[row, 0], commands[row, 1], drive, shape, seconds, held)
        free = path_length_to_disc(path, poses[row, 0], discs, 2.0 * others.radius_px, APART_PX)
        others.meets[i] = ROBOT if free < math.inf else NOTHING
        if robot > 0:
            here = placed_people(others.people[i * robots])
            centres = np.empty((len(here), 2))
            for p in range(len(here)):
                centres[p, 0], centres[p, 1] = here[p].x, here[p].y
            way = path_length_to_disc(path, poses[row, 0], centres, others.radius_px + others.people_px, APART_PX)
            if way < free:
                free, others.meets[i] = way, SOMEONE
        commands[row, 2] = free


@njit(cache=True, nogil=True)
def _begin(
    occupied: Grid, counts: Rows, sizes: Counts, others: TeamObstacles, robot: int, i: int, reach: float
) -> None:  # fmt: skip
    """Note what one robot of team ``i`` knows, and draw the people and the other robots into its cells.

    What was drawn there before is erased first; before the first step, everything is drawn anew. Where there are no
    people, robots farther away than ``reach`` are not drawn.
    """
    robots = others.places.shape[1]
    row = i * robots + robot
    begins = counts[row, 0].steps < 0
    others.had[i] = 0 if begins else counts[row, 0].known  # what a robot knows at the start counts as found by it
    if robots == 1:
        return
    rows, cols = sizes[row, 0], sizes[row, 1]
    cells, drawn, places = rows * cols, others.drawn[row], others.places[i * robots]
    raster = occupied[row, :cells].reshape((rows, cols))
    here = placed_people(others.people[i * robots])
    radius = max(others.radius_px - THINNER_PX, 1.0)
    if begins:
        for cell in range(cells):
            occupied[row, np.uint64(cell)] = others.walls[i, np.uint64(cell)]
        drawn[:] = math.nan
    elif len(here) > 0 or radius > others.radius_px:  # discs that are drawn may overlap
        for k in range(len(drawn)):
            if not math.isnan(drawn[k, 0]):
                erase_disc(raster, drawn[k, 0], drawn[k, 1], others.radius_px if k < robots else others.people_px)
        drawn[:] = math.nan
    thinner = THINNER_PX if robot > 0 else 0.0
    for p in range(len(here)):
        mark_disc(raster, here[p].x, here[p].y, max(others.people_px - thinner, 1.0))
        drawn[robots + p, 0], drawn[robots + p, 1] = here[p].x, here[p].y
    for k in range(robots):
        x, y = places[k, 0], places[k, 1]
        if k == robot or (drawn[k, 0] == x and drawn[k, 1] == y):
            continue
        if not math.isnan(drawn[k, 0]):
            unmark_disc(raster, drawn[k, 0], drawn[k, 1], radius)
            drawn[k] = math.nan
        if len(here) > 0 or math.hypot(x - places[robot, 0], y - places[robot, 1]) <= reach:
            mark_disc(raster, x, y, radius)
            drawn[k] = places[k]


@njit(cache=True, nogil=True)
def count_met_and_seen(
    observable: Grid, known: Grid, counts: Rows, poses: Rows, sizes: Counts, fresh: Grid, others: TeamObstacles,
    shared: TeamKnowledge, robot: int, first: int, end: int,
) -> None:  # fmt: skip
    """Count what one robot of each team has met and seen in its step, and add it to what the team knows.

    Only chunks that the step marked as ``fresh`` (N * R, chunks) are looked at; their marks move to ``shared.pending``.
    """
    robots, together = others.places.shape[1], shared.together
    tells, rest = shared.pending.shape[2] > 0, EVERYONE & ~(1 << robot)
    for i in range(first, end):
        row = i * robots + robot
        cells = sizes[row, 0] * sizes[row, 1]
        count, pose, marks = counts[row, 0], poses[row, 0], fresh[row]
        if others.meets[i] != NOTHING:
            count.collisions += 1 - count.blocked
            count.blocked = 1
            together[i].meetings += 1 if others.meets[i] == ROBOT else 0
            others.meets[i] = NOTHING
        others.places[i * robots, robot, 0], others.places[i * robots, robot, 1] = pose.x, pose.y
        own, other, seen = shared.known[i], known[row], observable[row]
        chunks = (cells + CHUNK - 1) >> CHUNK_BITS
        if count.known == others.had[i] and marks[0] == 0:  # nothing is new; a merge outside steps marks all
            chunks = 0
        for start in range(0, chunks, CHUNK):
            stop = min(start + CHUNK, chunks)
            if not _any(marks, start, stop):
                continue
            if tells:
                shared.waiting[i, robot, start >> CHUNK_BITS] = rest
            for chunk in range(start, stop):
                if marks[chunk] != 0:
                    marks[chunk] = 0
                    if tells:
                        shared.pending[i, robot, chunk] = rest
                    low, high = chunk << CHUNK_BITS, min((chunk + 1) << CHUNK_BITS, cells)
                    new, covered = copy_known_cells(own, other, seen, low, high)
                    together[i].explored += new
                    together[i].covered += covered
        together[i].found += count.known - others.had[i]


@njit(inline="always")
def _any(marks: Grid, start: int, stop: int) -> bool:
    """Return whether a mark is set, in a loop without a branch."""
    some = np.uint8(0)
    for k in range(start, stop):
        some |= marks[np.uint64(k)]
    return bool(some != 0)


@njit(cache=True, nogil=True)
def count_step(together: Rows, active: Grid, joined: Grid, observable: Floats) -> bool:
    """Count a step of the ``active`` teams (N,), after their robots have exchanged maps.

    Return whether some team has just come to know one of ``LEVELS``. ``joined`` (N,) is not 0 if each robot reaches
    each other one; ``observable`` (N,) is the number of cells that coverage counts.
    """
    some = False
    for i in range(len(together)):
        if active[i] == 0:
            continue
        one = together[i]
        one.steps += 1
        one.joined += joined[i]
        share = one.covered / observable[i]
        if share >= LEVELS[0] and math.isnan(one.steps_90):
            one.steps_90, some = one.steps, True
        if share >= LEVELS[1] and math.isnan(one.steps_99):
            one.steps_99, some = one.steps, True
    return some


@njit(inline="always")
def copy_known_cells(own: Grid, other: Grid, observable: Grid, low: int, high: int) -> tuple[int, int]:
    """Copy the known cells of a chunk of a flat map, from ``low`` to ``high``, into the unknown cells of another.

    Return the number of cells copied, and how many of them are observable.
    """
    missing = np.uint8(0)
    for k in range(low, high):  # known cells have all bits of FREE
        missing = np.uint8(missing | (other[np.uint64(k)] & ~own[np.uint64(k)] & FREE))
    new, covered = np.uint8(0), np.uint8(0)  # so that the compiler can vectorise the sums
    if missing:
        for k in range(low, high):
            had, has = own[np.uint64(k)], other[np.uint64(k)]
            copies = np.uint8((had == UNKNOWN) & (has != UNKNOWN))
            own[np.uint64(k)] = has if had == UNKNOWN else had
            new = np.uint8(new + copies)
            covered = np.uint8(covered + (copies & observable[np.uint64(k)]))
    return int(new), int(covered)
