"""A step: the robot turns, goes, looks on the way, and is shown what it knows.

What only ``transitions`` calls is taken into it line by line: a function of its own would be compiled, with all that it
calls, once more for itself. ``among.transitions_with_people`` is the same between things that move.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.hashing import uniform
from houseexpo.pseudoslam.kernels.mapping.crop import crop
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, merge_cells, merge_runs, shrink
from houseexpo.pseudoslam.kernels.motion.bodies import Bodies, Disc, Tracks, bodies_of, tracks_of, way_past_people
from houseexpo.pseudoslam.kernels.motion.disc import clearance, free_way
from houseexpo.pseudoslam.kernels.people.social_force import Walk
from houseexpo.pseudoslam.kernels.planning.distance_field import Field, field_at, field_of
from houseexpo.pseudoslam.kernels.planning.flow import Flow, flow_of
from houseexpo.pseudoslam.kernels.runtime.thread_pool import MAX_ENVS, VIEWS, done, enter, leave, puts_off, take
from houseexpo.pseudoslam.kernels.sensing.noise import (
    HIT,
    LOST,
    believed,
    draw_beams,
    draw_noisy,
    merge_patch,
    registration,
)
from houseexpo.pseudoslam.kernels.sensing.ranges import cast
from houseexpo.pseudoslam.kernels.sensing.rays import ray_merge, ray_scan
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Counts, Errors, Floats, Grid, Robot, Scratch, Sensor

X, Y, HEADING, SEEN_X, SEEN_Y, SEEN_HEADING = range(6)
"""What ``pose`` holds, pixels and radians: where the robot is, and where it believes it is."""
STEPS, COLLISIONS, KNOWN, COVERED, SCANS, BLOCKED, KEY = range(7)
"""What ``counts`` holds: steps and those that met an obstacle; cells of the map; scans; whether the last step met an
obstacle; the key of the episode's noise."""
PATH_LENGTH, CLEARANCE, TO_GOAL, START_X, START_Y = range(5)
"""What ``readings`` holds, pixels: the way gone, the room round the robot, the way that is left to the goal, and where
the episode started."""
SKIP, STEP, REDRAW = range(3)
"""What is ``wanted`` of an environment: nothing, a step, or to be shown again what it knows."""
ARRAYS = 3
"""Arrays for views beside the pool's: the caller of a batch holds one or two, one is written."""
BEAMS, ODOMETRY, REGISTRATION, PEOPLE = range(1, 5)
"""Kinds of chance, each with a key of its own (``key_of``)."""


ViewBuffers: TypeAlias = tuple[Grid, ...]
Move: TypeAlias = Callable[["Episode", "StepParams"], None]
"""Moves what moves beside the robot."""
Look: TypeAlias = Callable[["Episode", "StepParams", Scratch], None]
"""Scans from where the robot is, and merges what is seen into the map."""


class Episode(NamedTuple):
    """The arrays of one environment. In a pool each has one axis more in front, and rasters lie flat, with room."""

    occupied: Grid
    """(rows, cols), not 0 where an obstacle is; the border is."""
    observable: Grid
    """(rows, cols), 1 where a cell counts for coverage."""
    known: Grid
    """(rows, cols) the map."""
    shown: Grid
    """(side, side) what the robot is shown."""
    overview: Grid
    """(cells, cells) the whole map, coarsely; (0, 0) where nobody asks."""
    ranges: Floats
    """(beams,) what the last scan's beams returned, pixels; (0,) where nobody asks."""
    pose: Floats
    """(6,)"""
    counts: Counts
    """(7,)"""
    readings: Floats
    """(5,)"""
    bodies: Bodies
    tracks: Tracks
    flow: Flow
    field: Field


class StepParams(NamedTuple):
    """What is the same for all environments: the robot and its sensor, their errors, and what moves beside it."""

    robot: Robot
    sensor: Sensor
    errors: Errors
    walk: Walk
    seconds: float
    clearance_px: float
    overview_px: float
    """Pixels along the side of an overview's cell."""


@njit(cache=True, nogil=True)
def transitions(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Turn, then go forward (backward where negative) until something is in the way; look; show what is known.

    An episode that has not begun, ``counts[STEPS]`` is -1, begins: with a look round that is no step. This one looks at
    sectors, without errors, and draws the view; ``transitions_by_rays`` and ``transitions_in_full`` can do other
    things, so that each is compiled when it is asked for.

    Parameters
    ----------
    pool
        N episodes.
    sizes
        (N, 2) rows and columns of each one's rasters.
    motions
        (N, 2) turn and way forward, radians and pixels.
    wanted
        (N,) ``STEP`` where an environment steps, ``REDRAW`` where it is only shown again, ``SKIP`` where neither.
    views
        Arrays (N, side, side), of which ``sync`` names one, or none: what robots are shown is drawn there, not in the
        pool.
    crew, epoch, thread
        What threads share, see ``sync``. Thread 0 begins a step and returns when it is done, but for views that it puts
        off; others take part in steps until none has come for a while. All have ``scratch`` of their own.
    """
    steps(pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, _alone, look_at_sector, False)


@njit(cache=True, nogil=True)
def transitions_by_rays(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``transitions`` does, looking along rays."""
    steps(pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, _alone, look_along_rays, False)


@njit(cache=True, nogil=True)
def transitions_in_full(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``transitions`` does, as the rules say: with errors, and ranges and an overview where there is room."""
    steps(pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, _alone, look, True)


@njit(inline="always")
def steps(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int, move: Move, look: Look, full: bool,
) -> None:  # fmt: skip
    """Take environments and step them, after all else has moved there."""
    enter(sync, thread)
    while True:
        taken = take(sync, epoch, thread)
        if taken < 0:
            break
        i, is_moved = taken & MAX_ENVS, taken <= MAX_ENVS
        if wanted[i] != SKIP:
            episode = episode_of(pool, sizes, i)
            if is_moved and wanted[i] == STEP:
                move(episode, params)
                step(episode, motions[i, 0], motions[i, 1], params, scratch, look, full)
            if not (is_moved and puts_off(sync, i)):
                pose, view = episode.pose, sync[VIEWS]
                shown = views[view][i] if view >= 0 else episode.shown
                crop(episode.known, pose[SEEN_X], pose[SEEN_Y], pose[SEEN_HEADING], shown)
        done(sync, taken)
    leave(sync, thread)


@njit(inline="always")
def _alone(episode: Episode, params: StepParams) -> None:
    """Move nothing: there is nothing beside the robot that does."""


@njit(inline="always")
def step(
    episode: Episode, turn: float, forward: float, params: StepParams, scratch: Scratch, look: Look, full: bool
) -> None:
    """Do one episode's step but for its view; unless ``full``, a constant, without errors, ranges and overview."""
    counts, readings = episode.counts, episode.readings
    counts[STEPS] += 1
    way = _go(episode, turn, forward, params, scratch, look, full)
    counts[BLOCKED] = 1 if way < abs(forward) else 0
    counts[COLLISIONS] += counts[BLOCKED]
    readings[PATH_LENGTH] += way
    _read(episode, params, 2.0 * params.sensor.range_px if counts[STEPS] > 0 else math.inf, full)


@njit(inline="always")
def _read(episode: Episode, params: StepParams, spread_px: float, full: bool) -> None:
    """Take the readings at the robot's place; of the overview, draw anew what lies within ``spread_px``."""
    pose, readings, sensor = episode.pose, episode.readings, params.sensor
    if params.clearance_px > 0.0:
        readings[CLEARANCE] = clearance(
            episode.occupied, pose[X], pose[Y], params.robot.radius_px, params.robot.radius_px + params.clearance_px
        )
    if len(episode.field.distances) > 0:
        way = field_at(episode.field, pose[X], pose[Y])
        if way < math.inf:  # in a gap without a block to stand on, the way known last stands
            readings[TO_GOAL] = way
    if full and len(episode.ranges) > 0:
        cast(
            episode.occupied, pose[X], pose[Y], pose[HEADING], sensor.fan_cos, sensor.fan_sin, sensor.range_px,
            episode.ranges,
        )  # fmt: skip
        if params.errors.any:
            _err(episode.ranges, episode.counts, params)
    if full and len(episode.overview) > 0:
        shrink(
            episode.known, readings[START_X], readings[START_Y], params.overview_px, pose[SEEN_X], pose[SEEN_Y],
            spread_px, episode.overview,
        )  # fmt: skip


@njit(inline="always")
def _err(ranges: Floats, counts: Counts, params: StepParams) -> None:
    """Give ranges the errors of the beams of the last scan: a lost one is 0."""
    beams = len(ranges)
    shift_px, fate = np.empty(beams), np.empty(beams, np.int32)
    draw_beams(params.errors, beams, key_of(counts[KEY], BEAMS), counts[SCANS] - 1, shift_px, fate)
    for beam in range(beams):
        if fate[beam] != HIT:
            ranges[beam] = 0.0 if fate[beam] == LOST else params.sensor.range_px
        elif ranges[beam] < params.sensor.range_px:
            ranges[beam] = min(max(ranges[beam] + shift_px[beam], 0.0), params.sensor.range_px)


@njit(inline="always")
def _go(
    episode: Episode, turn: float, forward: float, params: StepParams, scratch: Scratch, look: Look, full: bool
) -> float:
    """Turn and go, and merge what is seen on the way; return the way gone, pixels.

    Scans lie at most ``between_px`` and ``between_rad`` apart, the last at the end; there is one at least. Where
    odometry errs, the map is drawn from where the robot believes it is.
    """
    pose, robot, errors = episode.pose, params.robot, params.errors
    distance = abs(forward)
    turns = math.ceil(abs(turn) / robot.between_rad - 1e-9)
    start = pose.copy()
    heading = _wrapped(start[HEADING] + turn)
    sign = 1.0 if forward >= 0.0 else -1.0
    right, down = sign * math.cos(heading), -sign * math.sin(heading)
    way = distance
    if distance > 0.0:
        way = free_way(episode.occupied, start[X], start[Y], right, down, distance, robot.radius_px)
        disc = Disc(start[X], start[Y], robot.radius_px)
        way = min(way, way_past_people(episode.bodies.people, params.walk.radius_px, disc, right, down, distance))
    goes = math.ceil(way / robot.between_px - 1e-9)
    seen_turn, seen_way = turn, sign * way
    if full and errors.odometry:
        key = key_of(episode.counts[KEY], ODOMETRY)
        seen_turn, seen_way = believed(errors, key, episode.counts[STEPS], turn, sign * way)
    for i in range(1, max(turns + goes, 1) + 1):
        turned, gone = min(i / turns, 1.0) if turns > 0 else 1.0, max(i - turns, 0) / max(goes, 1)
        pose[HEADING] = heading if i >= turns else _wrapped(start[HEADING] + turn * turned)
        if i > turns and goes > 0:
            pose[X], pose[Y] = start[X] + way * gone * right, start[Y] + way * gone * down
        if full and errors.odometry:
            seen = _wrapped(start[SEEN_HEADING] + seen_turn * turned)
            pose[SEEN_HEADING] = seen
            pose[SEEN_X] = start[SEEN_X] + seen_way * gone * math.cos(seen)
            pose[SEEN_Y] = start[SEEN_Y] - seen_way * gone * math.sin(seen)
        else:
            pose[SEEN_X], pose[SEEN_Y], pose[SEEN_HEADING] = pose[X], pose[Y], pose[HEADING]
        look(episode, params, scratch)
    return way


@njit(inline="always")
def look_at_sector(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan the sector from where the robot is, and merge what is seen into the map."""
    pose, sensor = episode.pose, params.sensor
    n_runs, n_hit = sector_scan(
        episode.occupied, pose[X], pose[Y], pose[HEADING], sensor.half_fov, sensor.range_px, scratch.runs, scratch.hit,
        scratch.slopes,
    )  # fmt: skip
    new, covered = merge_runs(episode.known, episode.observable, scratch.runs, n_runs, FREE)
    _count(episode, scratch, n_hit, new, covered)


@njit(inline="always")
def look_along_rays(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan along the rays from where the robot is, and merge what is seen into the map."""
    pose, sensor = episode.pose, params.sensor
    settled = len(episode.bodies.clocks) + len(episode.bodies.people) == 0
    new, covered, n_hit = ray_merge(
        episode.occupied, episode.observable, episode.known, pose[X], pose[Y], pose[HEADING], sensor.fan_cos,
        sensor.fan_sin, sensor.range_px, scratch.hit, settled,
    )  # fmt: skip
    _count(episode, scratch, n_hit, new, covered)


@njit(inline="always")
def _count(episode: Episode, scratch: Scratch, n_hit: int, new: int, covered: int) -> None:
    """Merge the obstacles that were seen after the free cells, and count what is new."""
    new_hit, covered_hit = merge_cells(episode.known, episode.observable, scratch.hit, n_hit, OBSTACLE)
    episode.counts[KNOWN] += new + new_hit
    episode.counts[COVERED] += covered + covered_hit
    episode.counts[SCANS] += 1


@njit(inline="always")
def look(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Look as the rules say, with errors where there are some."""
    if params.errors.any:
        _look_with_errors(episode, params, scratch)
    elif params.sensor.by_rays:
        look_along_rays(episode, params, scratch)
    else:
        look_at_sector(episode, params, scratch)


@njit(inline="always")
def _look_with_errors(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Merge a scan as its beams measure it, from where the robot believes it is, as registration misplaces it."""
    pose, counts, sensor, errors = episode.pose, episode.counts, params.sensor, params.errors
    x, y, heading, runs, hit = pose[X], pose[Y], pose[HEADING], scratch.runs, scratch.hit
    if sensor.by_rays:
        n_runs, n_hit = ray_scan(
            episode.occupied, x, y, heading, sensor.fan_cos, sensor.fan_sin, sensor.range_px, runs, hit
        )
    else:
        n_runs, n_hit = sector_scan(
            episode.occupied, x, y, heading, sensor.half_fov, sensor.range_px, runs, hit, scratch.slopes
        )
    beams = len(sensor.fan_cos)
    shift_px, fate = np.empty(beams), np.empty(beams, np.int32)
    draw_beams(errors, beams, key_of(counts[KEY], BEAMS), counts[SCANS], shift_px, fate)
    draw_noisy(
        scratch.patch, episode.occupied.shape[1], x, y, heading, sensor, runs, n_runs, hit, n_hit, shift_px, fate
    )
    right, down, turn = registration(errors, key_of(counts[KEY], REGISTRATION), counts[STEPS])
    new, covered = merge_patch(
        episode.known, episode.observable, scratch.patch, x, y, pose[SEEN_X] - x + right, pose[SEEN_Y] - y + down,
        pose[SEEN_HEADING] - heading + turn,
    )  # fmt: skip
    _count(episode, scratch, 0, new, covered)


@njit(inline="always")
def episode_of(pool: Episode, sizes: Counts, i: int) -> Episode:
    """Return environment ``i`` of a pool, views of its arrays."""
    rows, cols = sizes[i, 0], sizes[i, 1]
    cells = rows * cols
    return Episode(
        pool.occupied[i, :cells].reshape((rows, cols)), pool.observable[i, :cells].reshape((rows, cols)),
        pool.known[i, :cells].reshape((rows, cols)), pool.shown[i], pool.overview[i], pool.ranges[i], pool.pose[i],
        pool.counts[i], pool.readings[i], bodies_of(pool.bodies, i), tracks_of(pool.tracks, i),
        flow_of(pool.flow, i), field_of(pool.field, i),
    )  # fmt: skip


@njit(inline="always")
def key_of(key: int, kind: int) -> int:
    """Return the key of one kind of noise."""
    return int(uniform(key, kind + 0) * 4611686018427387904.0)  # for each constant numba would compile anew


@njit(inline="always")
def _wrapped(heading: float) -> float:
    """Return the same direction in [-pi, pi]; one that lies there already keeps its bits."""
    while heading > math.pi:
        heading -= 2.0 * math.pi
    while heading < -math.pi:
        heading += 2.0 * math.pi
    return heading
