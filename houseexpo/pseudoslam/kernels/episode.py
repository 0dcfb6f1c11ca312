"""Define the arrays and records of an episode and the parameters of steps; slice one environment out of a pool."""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import literal_unroll, njit

from houseexpo.pseudoslam.kernels.body_tracks import BodyTracks, Tracks
from houseexpo.pseudoslam.kernels.collision import placed_people
from houseexpo.pseudoslam.kernels.hashing import uniform
from houseexpo.pseudoslam.kernels.people import WalkParams
from houseexpo.pseudoslam.kernels.planning.fields import FlowField
from houseexpo.pseudoslam.kernels.planning.goal_paths import GoalPaths
from houseexpo.pseudoslam.kernels.planning.planner_types import PlannerMemory, PlannerRules
from houseexpo.pseudoslam.kernels.types import (
    Cells,
    Counts,
    Drive,
    Errors,
    Floats,
    Grid,
    RobotBody,
    Rows,
    Runs,
    Sensor,
    make_row_dtype,
)

POSE = make_row_dtype(x=float, y=float, heading=float, seen_x=float, seen_y=float, seen_heading=float)
"""The robot's pose and the believed pose (``seen_...``), pixels and radians."""
COUNTS = make_row_dtype(
    steps=int, collisions=int, known=int, covered=int, scans=int, blocked=int, key=int, lost=int, low=int,
    high=int,
)  # fmt: skip
"""Counts of steps, of collisions, of known cells, of those among them that are observable, and of scans; whether an
obstacle blocked the last step; the key of the episode's noise; the number of cells that scans would have drawn beyond
the map; and the flat indices between which scans have drawn, the second excluded."""
READINGS = make_row_dtype(
    path_length=float, clearance=float, to_goal=float, start_x=float, start_y=float, speed=float, turning=float,
    bias=float,
)  # fmt: skip
"""The distance travelled, the clearance, the remaining distance to the goal, and the start, pixels; a drive's speed,
pixels per second, and its speed of turning, radians per second, or its steering angle, radians; and the rate at which
the heading by odometry drifts, radians per second."""
BEAMS, ODOMETRY, REGISTRATION, PEOPLE, MODEL, SLIP, BIAS = range(1, 8)
"""Kinds of random numbers, each with its own key (``noise_key``)."""


BY_OVERVIEW, BY_PICTURES = range(2)
"""Who draws what has changed: the rows of ``Episode.changed``."""
NO_CELL = 1 << 40
"""The first row and column of a rectangle without cells."""


class Blocks(NamedTuple):
    """The highest values of blocks of the map (``mapping.max_of_blocks``) for pictures, flat; (0,) if none is kept."""

    near: Grid
    far: Grid
    whole: Grid


class Episode(NamedTuple):
    """The arrays of one environment. In a pool, each has an additional first axis, and rasters are flat and padded."""

    occupied: Grid
    """(rows, cols), not 0 for obstacles, including the border."""
    observable: Grid
    """(rows, cols), 1 for cells that count for coverage."""
    known: Grid
    """(rows, cols), the map."""
    shown: Grid
    """(side, side), the view."""
    overview: Grid
    """(cells, cells), the overview of the whole map; (0, 0) if it is not observed."""
    ranges: Floats
    """(beams,), the ranges of the last scan, pixels; (0,) if they are not observed."""
    fresh: Grid
    """(chunks,), 1 where a step has made cells of the map known, see ``mapping.CHUNK``; (0,) outside teams."""
    pose: Rows
    """(1,) ``POSE``; in a kernel's view of one environment, this and the next two are the records themselves."""
    counts: Rows
    """(1,) ``COUNTS``."""
    readings: Rows
    """(1,) ``READINGS``."""
    bodies: BodyTracks
    tracks: Tracks
    flow: FlowField
    paths: GoalPaths
    plans: PlannerMemory
    changed: Counts
    """(2, 4), first row, end, first column and end of the cells that scans may have changed since the overview was
    drawn, and since the pictures were; (0, 4) if neither is observed."""
    blocks: Blocks


class StepParams(NamedTuple):
    """The parameters of all environments: the robot, its sensor, their noise, and moving obstacles."""

    robot: RobotBody
    sensor: Sensor
    errors: Errors
    walk: WalkParams
    seconds: float
    clearance_px: float
    overview_px: float
    """Side of an overview's cell, pixels."""
    plan: PlannerRules
    drive: Drive


@njit(inline="always")
def slice_episode(pool: Episode, sizes: Counts, i: int) -> Episode:
    """Return environment ``i`` of a pool, as views of its arrays; of people, only those who have a place."""
    rows, cols = sizes[i, 0], sizes[i, 1]
    cells = rows * cols
    bodies, tracks, flow, paths, plans = pool.bodies, pool.tracks, pool.flow, pool.paths, pool.plans
    blocks = pool.blocks
    return Episode(
        pool.occupied[i, :cells].reshape((rows, cols)), pool.observable[i, :cells].reshape((rows, cols)),
        pool.known[i, :cells].reshape((rows, cols)), pool.shown[i], pool.overview[i], pool.ranges[i], pool.fresh[i],
        pool.pose[i, 0], pool.counts[i, 0], pool.readings[i, 0],
        BodyTracks(bodies.clocks[i], placed_people(bodies.people[i]), bodies.robots[i]),
        Tracks(tracks.times_s[i], tracks.poses[i], tracks.corners[i], tracks.shapes[i]),
        FlowField(flow.sizes[i], flow.toward[i], flow.spots[i], flow.goals[i]),
        GoalPaths(
            paths.sizes[i], paths.standing[i], paths.corners[i], paths.starts[i], paths.others[i], paths.ways[i]
        ),
        PlannerMemory(plans.frontiers[i], plans.given_up[i], plans.state[i]),
        pool.changed[i], Blocks(blocks.near[i], blocks.far[i], blocks.whole[i]),
    )  # fmt: skip


@njit(inline="always")
def noise_key(key: int, kind: int) -> int:
    """Return the key of one kind of noise."""
    return int(uniform(key, kind + 0) * 4611686018427387904.0)  # numba would compile again for each constant


@njit(cache=True, nogil=True)
def note_runs(counts: Rows, changed: Counts, cols: int, runs: Runs, n_runs: int, hit: Cells, n_hit: int) -> None:
    """Note that a scan has drawn these runs and cells of a map with ``cols`` columns.

    Parameters
    ----------
    counts, changed
        Those of the episode, which are updated.
    """
    low, high = NO_CELL, -1
    for i in range(n_runs):
        low, high = min(low, int(runs[i, 0])), max(high, int(runs[i, 1]))
    for i in range(n_hit):
        low, high = min(low, int(hit[i])), max(high, int(hit[i]))
    if high < 0:
        return
    counts.low, counts.high = min(counts.low, low), max(counts.high, high + 1)
    if len(changed) == 0:
        return
    left, right, per_col = cols, 0, 1.0 / cols  # half a cell more makes up for the rounding of the quotient
    for i in range(n_runs):
        col = int(runs[i, 0]) - int((runs[i, 0] + 0.5) * per_col) * cols
        left, right = min(left, col), max(right, col + int(runs[i, 1]) - int(runs[i, 0]))
    for i in range(n_hit):
        col = int(hit[i]) - int((hit[i] + 0.5) * per_col) * cols
        left, right = min(left, col), max(right, col)
    _note(changed, low // cols, high // cols + 1, left, right + 1)


@njit(cache=True, nogil=True)
def note_square(counts: Rows, changed: Counts, shape: tuple[int, int], x: float, y: float, spread: float) -> None:
    """Note that a scan may have drawn cells of a map of this shape within ``spread`` cells of (x, y), each way."""
    rows, cols = shape
    top, end = max(math.floor(y - spread), 0), min(math.ceil(y + spread), rows)
    if top >= end:
        return
    counts.low, counts.high = min(counts.low, top * cols), max(counts.high, end * cols)
    _note(changed, top, end, max(math.floor(x - spread), 0), min(math.ceil(x + spread), cols))


@njit(cache=True, nogil=True)
def _note(changed: Counts, top: int, end: int, left: int, right: int) -> None:
    for who in range(len(changed)):
        changed[who, 0], changed[who, 1] = min(changed[who, 0], top), max(changed[who, 1], end)
        changed[who, 2], changed[who, 3] = min(changed[who, 2], left), max(changed[who, 3], right)


@njit(inline="always")
def forget_changes(changed: Counts) -> None:
    """Note that a row of ``Episode.changed`` has been drawn."""
    changed[0], changed[1], changed[2], changed[3] = NO_CELL, 0, NO_CELL, 0


_COUNTS, _READINGS, _POSE = COUNTS.names or (), READINGS.names or (), POSE.names or ()
MEASURES = make_row_dtype(
    **dict.fromkeys(_COUNTS, int), **dict.fromkeys((*_READINGS, *_POSE), float), explored_m2=float,
    coverage=float, collided=bool, truncated=bool,
)  # fmt: skip
"""The counts, the readings and the poses of an episode, and what follows: the known area, m2, the known share of the
observable cells, whether an obstacle blocked the last step, and whether the episode has reached its time limit."""


@njit(cache=True)
def measure_pool(
    counts: Rows, readings: Rows, pose: Rows, constants: Floats, cell_m: float, cell_m2: float, max_steps: int,
    out: Rows, poses: Floats,
) -> None:  # fmt: skip
    """Write the measures of N episodes.

    Parameters
    ----------
    counts, readings, pose
        (N, 1), those of the pool.
    constants
        (N, 11), ``metrics.EpisodeConstants.rows``.
    cell_m, cell_m2
        Side and area of a cell, metres and m2.
    max_steps
        The number of steps after which an episode is truncated.
    out
        (N,), receives ``MEASURES``.
    poses
        (N, 6), receives the pose and the believed pose: x, y in the plan's metres, heading in radians.
    """
    for i in range(len(out)):
        row, count, reading, at = out[i], counts[i, 0], readings[i, 0], pose[i, 0]
        for name in literal_unroll(_COUNTS):
            row[name] = count[name]
        for name in literal_unroll(_READINGS):
            row[name] = reading[name]
        for name in literal_unroll(_POSE):
            row[name] = at[name]
        row.explored_m2 = count.known * cell_m2
        row.coverage = count.covered / constants[i, 6]
        row.collided = count.blocked != 0
        row.truncated = count.steps >= max_steps
        poses[i, 0] = at.x * cell_m + constants[i, 0]
        poses[i, 1] = at.y * -cell_m + constants[i, 1]
        poses[i, 2] = at.heading + constants[i, 2]
        poses[i, 3] = at.seen_x * cell_m + constants[i, 3]
        poses[i, 4] = at.seen_y * -cell_m + constants[i, 4]
        poses[i, 5] = at.seen_heading + constants[i, 5]
