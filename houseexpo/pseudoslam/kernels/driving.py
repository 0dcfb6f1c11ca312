"""Step robots with a drive, which follow velocity commands, in some of the environments of a pool; like ``step``.

A drive follows a command, the velocity that the robot is to have, within its limits of acceleration. The step is
planned as arcs (``command_path``), shortened at what is in the way (``shorten_path``), and then driven, with scans on
the way. The other parts of a step are those of ``step``; the kernels take the same arguments and are compiled only when
used.

R1  Speed and turning change linearly until they are as commanded, as fast as the limits allow (``ramp_and_integral``).
R2  A step is divided into equal slices of time, in each of which the curvature is constant: the mean over the slice.
    At a constant velocity, the path is therefore an exact arc. Distances, and a differential drive's turns, are always
    exact.
R3  Collisions are looked for along the chord of each slice, which is at most ``SAGITTA_PX`` away from its arc. All ends
    of chords lie on the arcs.
R4  Where something blocks the robot, it stops: its speed is 0. A differential drive goes on turning. A car does not,
    but its steering goes on.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.bound_pool import BoundPool
from houseexpo.pseudoslam.kernels.collision import Disc, distance_to_disc, distance_to_people, free_distance, wrap_angle
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.odometry import draw_odometry_errors, grip_share
from houseexpo.pseudoslam.kernels.step import (
    Look,
    Move,
    act_in_pool,
    measure_ranges,
    move_nothing,
    move_obstacles,
    scan_fully_into_map,
    update_readings,
)
from houseexpo.pseudoslam.kernels.tolerances import SAGITTA_PX, SLICE_S
from houseexpo.pseudoslam.kernels.types import ACKERMANN, Drive, Floats, Grid, RobotBody, Rows, Scratch, as_bool

CHORD, ASIDE, TURN, WAY = range(4)
"""Columns of a path: the length of the chord, negative for backward, pixels; its angle from the heading before the
slice; the turn; and the length of the arc, negative for backward, pixels."""


@njit(cache=True, nogil=True)
def ramp_and_integral(start: float, target: float, rate: float, seconds: float) -> tuple[float, float]:
    """Return a value that goes from ``start`` to ``target`` at ``rate`` per second (R1), and its integral."""
    change = target - start
    if abs(change) <= rate * seconds:
        ramp_s = abs(change) / rate
        return target, (start + target) / 2.0 * ramp_s + target * (seconds - ramp_s)
    end = start + math.copysign(rate * seconds, change)
    return end, (start + end) / 2.0 * seconds


@njit(cache=True, nogil=True)
def command_path(
    readings: Rows, speed: float, turning: float, drive: Drive, robot: RobotBody, seconds: float, held: float
) -> Floats:
    """Return the path of a command, ``speed`` and ``turning``, that nothing blocks (n, 4), see ``CHORD``.

    ``held`` is the share of the path that is left after slipping. ``readings`` has the velocity before the step and is
    not changed. A slice is no longer than the distance and the turn between two scans.
    """
    old_speed, old_turning = readings.speed, readings.turning
    new_speed, _ = ramp_and_integral(old_speed, speed, drive.acceleration, seconds)
    new_turning, _ = ramp_and_integral(old_turning, turning, drive.turning_rate, seconds)
    way = max(abs(old_speed), abs(new_speed)) * seconds
    turn = max(abs(old_turning), abs(new_turning))
    turn = math.tan(turn) / drive.wheelbase_px * way if drive.kind == ACKERMANN else turn * seconds
    slices = max(way / robot.between_px, turn / robot.between_rad, math.sqrt(way * turn / (8.0 * SAGITTA_PX)))  # R3
    if way * turn > 0.0 and (new_speed != old_speed or new_turning != old_turning):
        slices = max(slices, seconds / SLICE_S)
    n = max(math.ceil(slices - 1e-9), 1)
    path = np.empty((n, 4))
    gone, turned = 0.0, 0.0
    for i in range(n):
        until = seconds * (i + 1) / n
        _, way = ramp_and_integral(old_speed, speed, drive.acceleration, until)
        _, turn = ramp_and_integral(old_turning, turning, drive.turning_rate, until)
        arc, angle = (way - gone) * held, turn - turned
        if drive.kind == ACKERMANN:
            angle = math.tan(angle * n / seconds) / drive.wheelbase_px * arc  # R2
        else:
            angle *= held
        half = angle / 2.0
        path[i, CHORD] = _chord(arc, half)
        path[i, ASIDE], path[i, TURN], path[i, WAY] = half, angle, arc
        gone, turned = way, turn
    return path


@njit(inline="always")
def _chord(arc: float, half: float) -> float:
    """Return the length of the chord of an arc; ``half`` is half of its turn, radians."""
    return arc if half == 0.0 else arc * math.sin(half) / half


@njit(cache=True, nogil=True)
def shorten_path(path: Floats, car: bool, pose: Rows, occupied: Grid, people: Rows, reach_px: float, radius_px: float,
            most_px: float) -> bool:  # fmt: skip
    """Shorten a path, in place, to where something blocks the robot (R3, R4); return whether something does.

    Parameters
    ----------
    car
        Whether the robot does not turn when it stands.
    people, reach_px
        People, and their radius.
    most_px
        Length of chords after which something is in the way that is not in the cells.
    """
    x, y, heading = pose.x, pose.y, pose.heading
    for i in range(len(path)):
        distance = abs(path[i, CHORD])
        if distance > 0.0:
            course = heading + path[i, ASIDE]
            sign = 1.0 if path[i, CHORD] > 0.0 else -1.0
            right, down = sign * math.cos(course), -sign * math.sin(course)
            free = free_distance(occupied, x, y, right, down, distance, radius_px)
            free = min(
                free, distance_to_people(people, reach_px, Disc(x, y, radius_px), right, down, distance), most_px
            )
            if free < distance:
                share = free / distance
                path[i, CHORD] *= share
                path[i, WAY] *= share
                path[i + 1 :, CHORD], path[i + 1 :, WAY] = 0.0, 0.0
                if car:
                    path[i, TURN] *= share
                    path[i + 1 :, TURN] = 0.0
                return True
            most_px -= distance
            x, y = x + distance * right, y + distance * down
        heading += path[i, TURN]
    return False


@njit(cache=True, nogil=True)
def path_length_to_disc(path: Floats, pose: Rows, discs: Floats, reach: float, apart: float) -> float:
    """Return the length of a path's chords until a disc touches one of others, infinite if it does not.

    Parameters
    ----------
    discs, reach, apart
        The centres (n, 2) of the others, the sum of the radii of two, and the distance that they keep, pixels.
    """
    x, y, heading, gone = pose.x, pose.y, pose.heading, 0.0
    for i in range(len(path)):
        distance = float(abs(path[i, CHORD]))
        course = heading + path[i, ASIDE]
        sign = 1.0 if path[i, CHORD] > 0.0 else -1.0
        right, down = sign * math.cos(course), -sign * math.sin(course)
        free = distance
        for k in range(len(discs)):
            free = min(free, distance_to_disc(discs[k, 0] - x, discs[k, 1] - y, right, down, reach, apart))
        if free < distance:
            return gone + free
        gone += distance
        x, y = x + distance * right, y + distance * down
        heading += path[i, TURN]
    return math.inf


@njit(cache=True, nogil=True)
def drive_pool_in_full(bound: BoundPool, commands: Floats, wanted: Grid, first: int, end: int) -> None:
    """Drive in environments without moving obstacles, with the scans and the noise of the parameters.

    Parameters
    ----------
    bound, wanted, first, end
        Arguments of ``step_pool_by_sector``.
    commands
        (N, 3): speed, pixels per second; turning, radians per second, or steering angle, radians; and the distance
        after which something is in the way that is not in the cells, pixels. Episodes that have not begun need none.
    """
    act_in_pool(bound, commands, wanted, first, end, _drive, move_nothing, scan_fully_into_map, True)


@njit(cache=True, nogil=True)
def drive_pool_with_people(bound: BoundPool, commands: Floats, wanted: Grid, first: int, end: int) -> None:
    """Do the same as ``drive_pool_in_full`` after people and bodies on trajectories have moved."""
    act_in_pool(bound, commands, wanted, first, end, _drive, move_obstacles, scan_fully_into_map, True)


@njit(inline="always")
def _drive(
    episode: Episode,
    command: Floats,
    params: StepParams,
    scratch: Scratch,
    move: Move,
    look: Look,
    full: bool,  # noqa: ARG001
) -> None:
    """Follow a command; an episode that has not begun begins with a first scan, which is not a step."""
    move(episode, params)
    counts, readings, drive, robot = episode.counts, episode.readings, params.drive, params.robot
    begins = counts.steps < 0
    counts.steps += 1
    path, blocked, held = np.zeros((1, 4)), False, 1.0
    if not begins:
        held = grip_share(params.errors, counts.key, counts.steps)
        path = command_path(readings, command[0], command[1], drive, robot, params.seconds, held)
        blocked = shorten_path(
            path, drive.kind == ACKERMANN, episode.pose, episode.occupied, episode.bodies.people,
            params.walk.radius_px, robot.radius_px, command[2],
        )  # fmt: skip
        readings.speed, _ = ramp_and_integral(readings.speed, command[0], drive.acceleration, params.seconds)
        readings.turning, _ = ramp_and_integral(readings.turning, command[1], drive.turning_rate, params.seconds)
    if blocked:
        readings.speed = 0.0
        counts.collisions += 1
    counts.blocked = 1 if blocked else 0
    _follow(episode, path, held, params, scratch, look)
    readings.path_length += np.abs(path[:, WAY]).sum()
    update_readings(episode, params)
    measure_ranges(episode, params)


@njit(inline="always")
def _follow(episode: Episode, path: Floats, held: float, params: StepParams, scratch: Scratch, look: Look) -> None:
    """Move along a path, and merge scans on the way, as far apart as those of ``step``, and one at the end.

    The error of odometry is spread evenly over the slices. ``held`` is the share of the wheels' motion that is left
    after slipping.
    """
    pose, robot, errors = episode.pose, params.robot, params.errors
    n, i, more_turn, more_way, last = len(path), 0, 0.0, 0.0, 0.0
    if errors.odometry:
        turn, way = path[:, TURN].sum() / held, path[:, WAY].sum() / held
        off = draw_odometry_errors(errors, episode.counts, episode.readings, turn, way, as_bool(True), params.seconds)
        more_turn, more_way, last = off.turn / n, off.way / n, off.after
        pose.seen_heading = wrap_angle(pose.seen_heading + off.before)
    while i < n:
        before, gone, turned = i, 0.0, 0.0
        while i < n:
            gone, turned = gone + abs(path[i, WAY]), turned + abs(path[i, TURN])
            if i > before and (gone > robot.between_px + 1e-9 or turned > robot.between_rad + 1e-9):
                break
            course = pose.heading + path[i, ASIDE]
            pose.x += path[i, CHORD] * math.cos(course)
            pose.y -= path[i, CHORD] * math.sin(course)
            pose.heading = wrap_angle(pose.heading + path[i, TURN])
            if errors.odometry:
                half = path[i, ASIDE] / held
                course, chord = pose.seen_heading + half + more_turn / 2.0, _chord(path[i, WAY] / held, half)
                pose.seen_x += (chord + more_way) * math.cos(course)
                pose.seen_y -= (chord + more_way) * math.sin(course)
                pose.seen_heading = wrap_angle(pose.seen_heading + path[i, TURN] / held + more_turn)
            else:
                pose.seen_x, pose.seen_y, pose.seen_heading = pose.x, pose.y, pose.heading
            i += 1
        if i == n:
            pose.seen_heading = wrap_angle(pose.seen_heading + last)
        look(episode, params, scratch)
