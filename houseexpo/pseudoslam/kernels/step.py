"""Step some of the environments of a pool, one after the other: move obstacles and robot, scan, update map and view.

In a step, moving obstacles move; the robot turns, moves and scans on its way; and its view is drawn. Four kernels take
the same step: scanning a sector, scanning along rays, in full (noise, ranges, overview), and with people. They need
different code, so that each is compiled only when it is used. A single environment is a pool of one. Threads share a
pool: each calls the kernel for its own environments, with its own working memory.

Functions that only a step calls are inlined in it (``inline``). Otherwise they would be compiled separately, with all
functions that they call.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.bound_pool import BoundPool
from houseexpo.pseudoslam.kernels.collision import Disc, clearance, distance_to_people, free_distance, wrap_angle
from houseexpo.pseudoslam.kernels.episode import (
    BEAMS,
    BY_OVERVIEW,
    PEOPLE,
    REGISTRATION,
    Episode,
    StepParams,
    forget_changes,
    noise_key,
    note_runs,
    note_square,
    slice_episode,
)
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, crop_view, draw_overview, merge_cells, merge_runs
from houseexpo.pseudoslam.kernels.odometry import draw_odometry_errors, grip_share
from houseexpo.pseudoslam.kernels.people import move_bodies
from houseexpo.pseudoslam.kernels.planning.goal_paths import goal_distance_at
from houseexpo.pseudoslam.kernels.sensing.noise import (
    HIT,
    LOST,
    draw_beam_errors,
    draw_noisy_scan,
    merge_patch,
    registration_error,
)
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams, merge_ray_scan, ray_scan
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Rows, Scratch, as_bool, as_int64

Move: TypeAlias = Callable[[Episode, StepParams], None]
"""A function that moves people and bodies on tracks."""
Look: TypeAlias = Callable[[Episode, StepParams, Scratch], None]
"""A function that scans from the robot's pose and merges the scan into the map."""
Act: TypeAlias = Callable[[Episode, Floats, StepParams, Scratch, Move, Look, bool], None]
"""A function that takes an action in one environment: a step, or a planner's action."""

SKIP, STEP, REDRAW = range(3)
"""What is ``wanted`` of an environment: nothing, a step, or redrawing its view."""


@njit(cache=True, nogil=True)
def step_pool_by_sector(bound: BoundPool, motions: Floats, wanted: Grid, first: int, end: int) -> None:
    """Step environments that scan sectors without noise, and draw their views; the other kernels are like this one.

    Parameters
    ----------
    bound
        N episodes.
    motions
        (N, 2), turn and distance forward, radians and pixels.
    wanted
        (N,), ``STEP`` to take a step, ``REDRAW`` only to redraw the view, ``SKIP`` for neither.
    first, end
        Environments ``first`` to ``end``, excluded.
    """
    act_in_pool(bound, motions, wanted, first, end, _act, move_nothing, scan_sector_into_map, False)


@njit(cache=True, nogil=True)
def step_pool_by_rays(bound: BoundPool, motions: Floats, wanted: Grid, first: int, end: int) -> None:
    """Step environments that scan along rays without noise."""
    act_in_pool(bound, motions, wanted, first, end, _act, move_nothing, scan_rays_into_map, False)


@njit(cache=True, nogil=True)
def step_pool_in_full(bound: BoundPool, motions: Floats, wanted: Grid, first: int, end: int) -> None:
    """Step environments with the scans and the noise of the parameters, and draw ranges and an overview if observed."""
    act_in_pool(bound, motions, wanted, first, end, _act, move_nothing, scan_fully_into_map, True)


@njit(cache=True, nogil=True)
def step_pool_with_people(bound: BoundPool, motions: Floats, wanted: Grid, first: int, end: int) -> None:
    """Do the same as ``step_pool_in_full`` after people and bodies on trajectories have moved."""
    act_in_pool(bound, motions, wanted, first, end, _act, move_obstacles, scan_fully_into_map, True)


@njit(inline="always")
def act_in_pool(
    bound: BoundPool, actions: Floats, wanted: Grid, first: int, end: int, act: Act, move: Move, look: Look, full: bool
) -> None:
    """Act in those environments ``first`` to ``end`` that want it, and draw their views and those to be redrawn.

    Parameters
    ----------
    act
        A function that takes one environment's action, ``actions[i]``.
    move, look, full
        Arguments of ``step``.
    """
    pool, sizes, params, scratch = bound.pool, bound.sizes, bound.params, bound.scratch
    for i in range(first, end):
        if wanted[i] == SKIP:
            continue
        episode = slice_episode(pool, sizes, i)
        if wanted[i] == STEP:
            act(episode, actions[i], params, scratch, move, look, full)
        draw_view(episode)


@njit(inline="always")
def _act(
    episode: Episode, motion: Floats, params: StepParams, scratch: Scratch, move: Move, look: Look, full: bool
) -> None:
    step(episode, motion[0], motion[1], params, scratch, move, look, full)
    if full:
        measure_ranges(episode, params)


@njit(inline="always")
def step(
    episode: Episode,
    turn: float,
    forward: float,
    params: StepParams,
    scratch: Scratch,
    move: Move,
    look: Look,
    full: bool,
) -> None:
    """Turn, then move forward (backward if negative) until an obstacle blocks the robot; scan; update the readings.

    ``measure_ranges`` must be called after the last step of an action if ranges or an overview are observed.

    An episode that has not begun (``counts.steps`` is -1) begins with a first scan, which is not a step.

    Parameters
    ----------
    turn, forward
        Radians, and pixels.
    scratch
        Working memory that no other thread uses.
    move, look
        Functions for moving obstacles and for scans, which are compiled into this one.
    full
        A constant; False for a step without noise.
    """
    move(episode, params)
    counts, readings = episode.counts, episode.readings
    counts.steps += 1
    held = grip_share(params.errors, counts.key, counts.steps) if full else 1.0
    turn, forward = turn * held, forward * held
    way = _go(episode, turn, forward, held, params, scratch, look, full)
    counts.blocked = 1 if way < abs(forward) else 0
    counts.collisions += counts.blocked
    readings.path_length += way
    update_readings(episode, params)


@njit(inline="always")
def update_readings(episode: Episode, params: StepParams) -> None:
    """Update the clearance and the distance to the goal at the robot's pose, as far as the task needs them."""
    pose, readings = episode.pose, episode.readings
    if params.clearance_px > 0.0:
        readings.clearance = clearance(
            episode.occupied, pose.x, pose.y, params.robot.radius_px, params.robot.radius_px + params.clearance_px
        )
    if len(episode.paths.standing) > 0:
        way = goal_distance_at(episode.paths, pose.x, pose.y)
        if way < math.inf:  # in a gap without a cell to stand in, the last distance is kept
            readings.to_goal = way


@njit(inline="always")
def measure_ranges(episode: Episode, params: StepParams) -> None:
    """Measure the ranges from the robot's pose, and redraw the overview where scans have drawn, as far as observed."""
    pose, readings, sensor = episode.pose, episode.readings, params.sensor
    if len(episode.ranges) > 0:
        cast_beams(
            episode.occupied, pose.x, pose.y, pose.heading, sensor.fan_cos, sensor.fan_sin, sensor.range_px,
            episode.ranges,
        )  # fmt: skip
        if params.errors.any:
            _add_range_noise(episode.ranges, episode.counts, params)
    if len(episode.overview) > 0:
        changed = episode.changed[BY_OVERVIEW]
        draw_overview(episode.known, readings.start_x, readings.start_y, params.overview_px, changed, episode.overview)
        forget_changes(changed)


@njit(inline="always")
def _add_range_noise(ranges: Floats, counts: Rows, params: StepParams) -> None:
    """Apply the noise of the last scan's beams to the ranges; lost beams are 0."""
    beams = len(ranges)
    shift_px, fate = np.empty(beams), np.empty(beams, np.int32)
    draw_beam_errors(params.errors, beams, noise_key(counts.key, BEAMS), counts.scans - 1, shift_px, fate)
    for beam in range(beams):
        if fate[beam] != HIT:
            ranges[beam] = 0.0 if fate[beam] == LOST else params.sensor.range_px
        elif ranges[beam] < params.sensor.range_px:
            ranges[beam] = min(max(ranges[beam] + shift_px[beam], 0.0), params.sensor.range_px)


@njit(inline="always")
def _go(
    episode: Episode,
    turn: float,
    forward: float,
    held: float,
    params: StepParams,
    scratch: Scratch,
    look: Look,
    full: bool,
) -> float:
    """Turn and move, and merge scans on the way; return the distance travelled, pixels.

    ``held`` is the share of the wheels' motion that is left after slipping.

    Scans are at most ``between_px`` and ``between_rad`` apart, with the last one at the end, and there is at least one.
    With odometry noise, the map is drawn from the believed pose.
    """
    pose, robot, errors = episode.pose, params.robot, params.errors
    distance = abs(forward)
    turns = math.ceil(abs(turn) / robot.between_rad - 1e-9)
    start_x, start_y, start_heading = pose.x, pose.y, pose.heading
    seen_x, seen_y, seen_heading = pose.seen_x, pose.seen_y, pose.seen_heading  # the believed start
    heading = wrap_angle(start_heading + turn)
    sign = 1.0 if forward >= 0.0 else -1.0
    right, down = sign * math.cos(heading), -sign * math.sin(heading)
    way = distance
    if distance > 0.0:
        way = free_distance(episode.occupied, start_x, start_y, right, down, distance, robot.radius_px)
        disc = Disc(start_x, start_y, robot.radius_px)
        way = min(way, distance_to_people(episode.bodies.people, params.walk.radius_px, disc, right, down, distance))
    goes = math.ceil(way / robot.between_px - 1e-9)
    seen_turn, seen_way, seen_last = turn, sign * way, 0.0
    if full and errors.odometry:
        rolled_turn, rolled_way = turn / held, sign * way / held
        off = draw_odometry_errors(
            errors, episode.counts, episode.readings, rolled_turn, rolled_way, as_bool(False), params.seconds
        )
        seen_turn, seen_way = rolled_turn + off.before + off.turn, rolled_way + off.way
        seen_last = off.after
    for i in range(1, max(turns + goes, 1) + 1):
        turned, gone = min(i / turns, 1.0) if turns > 0 else 1.0, max(i - turns, 0) / max(goes, 1)
        pose.heading = heading if i >= turns else wrap_angle(start_heading + turn * turned)
        if i > turns and goes > 0:
            pose.x, pose.y = start_x + way * gone * right, start_y + way * gone * down
        if full and errors.odometry:
            seen = pose.seen_heading = wrap_angle(seen_heading + seen_turn * turned)
            pose.seen_x = seen_x + seen_way * gone * math.cos(seen)
            pose.seen_y = seen_y - seen_way * gone * math.sin(seen)
            if i == max(turns + goes, 1):
                pose.seen_heading = wrap_angle(seen + seen_last)
        else:
            pose.seen_x, pose.seen_y, pose.seen_heading = pose.x, pose.y, pose.heading
        look(episode, params, scratch)
    return way


@njit(inline="always")
def draw_view(episode: Episode) -> None:
    """Draw the view of the map around the believed pose, with the heading up."""
    pose = episode.pose
    crop_view(episode.known, pose.seen_x, pose.seen_y, pose.seen_heading, episode.shown)


@njit(inline="always")
def move_nothing(episode: Episode, params: StepParams) -> None:
    """Move nothing, since there are no moving obstacles."""


@njit(inline="always")
def move_obstacles(episode: Episode, params: StepParams) -> None:
    """Move people and bodies on trajectories, once the episode has begun."""
    if episode.counts.steps >= 0:
        robot = Disc(episode.pose.x, episode.pose.y, params.robot.radius_px)
        move_bodies(
            episode.occupied, episode.bodies, episode.tracks, episode.flow, params.walk,
            noise_key(episode.counts.key, PEOPLE), robot, params.seconds,
        )  # fmt: skip


@njit(inline="always")
def scan_sector_into_map(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan the sector from the robot's pose, and merge the scan into the map."""
    pose, sensor = episode.pose, params.sensor
    n_runs, n_hit = sector_scan(
        episode.occupied, pose.x, pose.y, pose.heading, sensor.half_fov, sensor.range_px, scratch.runs, scratch.hit,
        scratch.slopes,
    )  # fmt: skip
    new, covered = merge_runs(episode.known, episode.observable, scratch.runs, n_runs, as_int64(FREE), episode.fresh)
    _count(episode, scratch, n_hit, new, covered)
    note_runs(episode.counts, episode.changed, episode.known.shape[1], scratch.runs, n_runs, scratch.hit, n_hit)


@njit(inline="always")
def scan_rays_into_map(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan along the rays from the robot's pose, and merge the scan into the map."""
    pose, sensor = episode.pose, params.sensor
    bodies = episode.bodies
    settled = len(bodies.clocks) + len(bodies.people) == 0 and len(bodies.robots) < 2
    new, covered, n_hit = merge_ray_scan(
        episode.occupied, episode.observable, episode.known, pose.x, pose.y, pose.heading, sensor.fan_cos,
        sensor.fan_sin, sensor.range_px, scratch.hit, settled, episode.fresh,
    )  # fmt: skip
    _count(episode, scratch, n_hit, new, covered)
    note_square(episode.counts, episode.changed, episode.known.shape, pose.x, pose.y, sensor.range_px + 2.0)


@njit(inline="always")
def _count(episode: Episode, scratch: Scratch, n_hit: int, new: int, covered: int) -> None:
    """Merge the visible obstacles after the free cells, and count what became known."""
    new_hit, covered_hit = merge_cells(
        episode.known, episode.observable, scratch.hit, n_hit, as_int64(OBSTACLE), episode.fresh
    )
    episode.counts.known += new + new_hit
    episode.counts.covered += covered + covered_hit
    episode.counts.scans += 1


@njit(inline="always")
def scan_fully_into_map(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan according to the parameters, including noise."""
    if params.errors.any:
        _look_with_errors(episode, params, scratch)
    elif params.sensor.by_rays:
        scan_rays_into_map(episode, params, scratch)
    else:
        scan_sector_into_map(episode, params, scratch)


@njit(inline="always")
def _look_with_errors(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Merge a scan with the noise of its beams, at the believed pose and with the error of registration."""
    pose, counts, sensor, errors = episode.pose, episode.counts, params.sensor, params.errors
    x, y, heading, runs, hit = pose.x, pose.y, pose.heading, scratch.runs, scratch.hit
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
    draw_beam_errors(errors, beams, noise_key(counts.key, BEAMS), counts.scans, shift_px, fate)
    draw_noisy_scan(
        scratch.patch, episode.occupied.shape[1], x, y, heading, sensor, runs, n_runs, hit, n_hit, shift_px, fate
    )
    right, down, turn = registration_error(errors, noise_key(counts.key, REGISTRATION), counts.steps)
    new, covered, lost = merge_patch(
        episode.known, episode.observable, scratch.patch, x, y, pose.seen_x - x + right, pose.seen_y - y + down,
        pose.seen_heading - heading + turn, episode.fresh,
    )  # fmt: skip
    counts.lost += lost
    spread = len(scratch.patch) * 0.5 * (abs(math.cos(turn)) + abs(math.sin(turn))) * math.sqrt(2.0) + 3.0
    note_square(counts, episode.changed, episode.known.shape, pose.seen_x + right, pose.seen_y + down, spread)
    _count(episode, scratch, as_int64(0), new, covered)


@njit(cache=True, nogil=True)
def look_up_motions(actions: Counts, table: Floats, motions: Floats, ahead: npt.NDArray[np.bool_]) -> int:
    """Write the motions (N, 2) of actions (N,), which are rows of a table, and which actions are the first one.

    Return the index of an action that is not in the table, -1 if all are.
    """
    for i in range(len(actions)):
        action = actions[i]
        if action < 0 or action >= len(table):
            return i
        motions[i, 0], motions[i, 1] = table[action, 0], table[action, 1]
        ahead[i] = action == 0
    return -1
