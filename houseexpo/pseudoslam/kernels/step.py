"""A step of one environment: moving obstacles move; the robot turns, moves and scans on its way; the view is drawn.

``step_pool`` has the kernels that take this step in one or more environments. Functions that only a step calls are
inlined in it (``inline``). Otherwise they would be compiled separately, with all functions that they call.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.episode import BEAMS, ODOMETRY, PEOPLE, Episode, StepParams, key_of
from houseexpo.pseudoslam.kernels.mapping.crop import crop
from houseexpo.pseudoslam.kernels.mapping.merge import shrink
from houseexpo.pseudoslam.kernels.motion.bodies import Disc, way_past_people
from houseexpo.pseudoslam.kernels.motion.disc import clearance, free_way
from houseexpo.pseudoslam.kernels.motion.heading import wrapped
from houseexpo.pseudoslam.kernels.people.advance import advance
from houseexpo.pseudoslam.kernels.planning.distance_field import field_at
from houseexpo.pseudoslam.kernels.sensing.noise import (
    HIT,
    LOST,
    believed,
    draw_beams,
)
from houseexpo.pseudoslam.kernels.sensing.ranges import cast
from houseexpo.pseudoslam.kernels.types import Floats, Rows, Scratch

Move: TypeAlias = Callable[["Episode", "StepParams"], None]
"""A function that moves people and bodies on tracks."""
Look: TypeAlias = Callable[["Episode", "StepParams", Scratch], None]
"""A function that scans from the robot's pose and merges the scan into the map."""


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
        A constant; False for a step without noise, ranges and overview.
    """
    move(episode, params)
    counts, readings = episode.counts, episode.readings
    counts.steps += 1
    way = _go(episode, turn, forward, params, scratch, look, full)
    counts.blocked = 1 if way < abs(forward) else 0
    counts.collisions += counts.blocked
    readings.path_length += way
    _read(episode, params, 2.0 * params.sensor.range_px if counts.steps > 0 else math.inf, full)


@njit(inline="always")
def _read(episode: Episode, params: StepParams, spread_px: float, full: bool) -> None:
    """Update the readings at the robot's pose, and redraw the overview within ``spread_px``."""
    pose, readings, sensor = episode.pose, episode.readings, params.sensor
    if params.clearance_px > 0.0:
        readings.clearance = clearance(
            episode.occupied, pose.x, pose.y, params.robot.radius_px, params.robot.radius_px + params.clearance_px
        )
    if len(episode.field.distances) > 0:
        way = field_at(episode.field, pose.x, pose.y)
        if way < math.inf:  # in a gap without a block to stand on, the last distance is kept
            readings.to_goal = way
    if full and len(episode.ranges) > 0:
        cast(
            episode.occupied, pose.x, pose.y, pose.heading, sensor.fan_cos, sensor.fan_sin, sensor.range_px,
            episode.ranges,
        )  # fmt: skip
        if params.errors.any:
            _err(episode.ranges, episode.counts, params)
    if full and len(episode.overview) > 0:
        shrink(
            episode.known, readings.start_x, readings.start_y, params.overview_px, pose.seen_x, pose.seen_y,
            spread_px, episode.overview,
        )  # fmt: skip


@njit(inline="always")
def _err(ranges: Floats, counts: Rows, params: StepParams) -> None:
    """Apply the noise of the last scan's beams to the ranges; lost beams are 0."""
    beams = len(ranges)
    shift_px, fate = np.empty(beams), np.empty(beams, np.int32)
    draw_beams(params.errors, beams, key_of(counts.key, BEAMS), counts.scans - 1, shift_px, fate)
    for beam in range(beams):
        if fate[beam] != HIT:
            ranges[beam] = 0.0 if fate[beam] == LOST else params.sensor.range_px
        elif ranges[beam] < params.sensor.range_px:
            ranges[beam] = min(max(ranges[beam] + shift_px[beam], 0.0), params.sensor.range_px)


@njit(inline="always")
def _go(
    episode: Episode, turn: float, forward: float, params: StepParams, scratch: Scratch, look: Look, full: bool
) -> float:
    """Turn and move, and merge scans on the way; return the distance travelled, pixels.

    Scans are at most ``between_px`` and ``between_rad`` apart, with the last one at the end, and there is at least one.
    With odometry noise, the map is drawn from the believed pose.
    """
    pose, robot, errors = episode.pose, params.robot, params.errors
    distance = abs(forward)
    turns = math.ceil(abs(turn) / robot.between_rad - 1e-9)
    start_x, start_y, start_heading = pose.x, pose.y, pose.heading
    seen_x, seen_y, seen_heading = pose.seen_x, pose.seen_y, pose.seen_heading  # the believed start
    heading = wrapped(start_heading + turn)
    sign = 1.0 if forward >= 0.0 else -1.0
    right, down = sign * math.cos(heading), -sign * math.sin(heading)
    way = distance
    if distance > 0.0:
        way = free_way(episode.occupied, start_x, start_y, right, down, distance, robot.radius_px)
        disc = Disc(start_x, start_y, robot.radius_px)
        way = min(way, way_past_people(episode.bodies.people, params.walk.radius_px, disc, right, down, distance))
    goes = math.ceil(way / robot.between_px - 1e-9)
    seen_turn, seen_way = turn, sign * way
    if full and errors.odometry:
        key = key_of(episode.counts.key, ODOMETRY)
        seen_turn, seen_way = believed(errors, key, episode.counts.steps, turn, sign * way)
    for i in range(1, max(turns + goes, 1) + 1):
        turned, gone = min(i / turns, 1.0) if turns > 0 else 1.0, max(i - turns, 0) / max(goes, 1)
        pose.heading = heading if i >= turns else wrapped(start_heading + turn * turned)
        if i > turns and goes > 0:
            pose.x, pose.y = start_x + way * gone * right, start_y + way * gone * down
        if full and errors.odometry:
            seen = pose.seen_heading = wrapped(seen_heading + seen_turn * turned)
            pose.seen_x = seen_x + seen_way * gone * math.cos(seen)
            pose.seen_y = seen_y - seen_way * gone * math.sin(seen)
        else:
            pose.seen_x, pose.seen_y, pose.seen_heading = pose.x, pose.y, pose.heading
        look(episode, params, scratch)
    return way


@njit(inline="always")
def show(episode: Episode) -> None:
    """Draw the view of the map around the believed pose, with the heading up."""
    pose = episode.pose
    crop(episode.known, pose.seen_x, pose.seen_y, pose.seen_heading, episode.shown)


@njit(inline="always")
def stand_still(episode: Episode, params: StepParams) -> None:
    """Move nothing, since there are no moving obstacles."""


@njit(inline="always")
def move_people(episode: Episode, params: StepParams) -> None:
    """Move people and bodies on trajectories, once the episode has begun."""
    if episode.counts.steps >= 0:
        robot = Disc(episode.pose.x, episode.pose.y, params.robot.radius_px)
        advance(
            episode.occupied, episode.bodies, episode.tracks, episode.flow, params.walk,
            key_of(episode.counts.key, PEOPLE), robot, params.seconds,
        )  # fmt: skip
