"""Compute how far outside of a house noise can draw cells, and give worlds a margin of that width.

A map is drawn from the believed pose, with the errors of the laser and of registration. What these move outward needs
cells to be drawn in. The margin is unknown in maps and occupied in the world, so that nothing can go or see there.

R1  A draw of ``kernels.hashing.normal`` is at most ``MOST_SIGMA``: errors that are drawn once (laser, registration)
    have that bound, and none of their cells is lost. With ``max_range``, beams draw cells up to the laser's range.
R2  Odometry turns the house about its middle and shifts it. With a heading error a_k after k steps and the robot at
    p_k from the middle, a wall at w is drawn at R(a_n) w - sum (R(a_k) - R(a_(k-1))) p_k + the errors of the way. The
    robot stays in the house; so for errors that are drawn, the shift grows with the root of the number of steps, and
    not with the length of the path. The margin has ``DRIFT_SIGMA`` of it after ``max_steps`` steps, with the robot in
    the house's corner and each step a full turn and a full way, and the sum of the systematic errors.
R3  A map that has drifted by the house's own diagonal is no map of it: the margin ends there, and where the grid would
    have more than ``MAX_WORLD_CELLS`` cells. Cells beyond it are counted (``COUNTS.lost``), and ``info`` has
    ``lost_m2``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config import Ackermann, NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.worlds.world import MAX_WORLD_CELLS, World

MOST_SIGMA: Final = math.sqrt(66.0 * math.log(2.0))
"""The largest draw of a normal distribution: 6.76; a uniform one is at least 2 ** -33 (``kernels.hashing``)."""
DRIFT_SIGMA: Final = 1.5
"""Standard deviations of drift that have room, of a robot that is always in the house's corner. Robots that wandered
through 60 published plans for 4,000 steps with the noise of the track ``noisy`` used 0.47 of the margin at most, and
0.13 on average."""


def margin_px(config: SimulatorConfig, rows: int, cols: int) -> int:
    """Return the width of the margin that a map of (rows, cols) needs with the noise of a configuration, cells."""
    noise, ppm = config.noise, config.pixels_per_metre
    if not noise.any:
        return 0
    needed_m = _scan_m(noise, config.laser.range_m)
    if noise.odometry:
        needed_m += min(_drift_m(config, rows / ppm, cols / ppm), math.hypot(rows, cols) / ppm)
    needed = math.ceil(needed_m * ppm) + 1  # a cell's centre falls into the next cell
    # (rows + 2a)(cols + 2a) = MAX_WORLD_CELLS
    across = (math.sqrt((rows - cols) ** 2 + 4.0 * MAX_WORLD_CELLS) - rows - cols) / 4.0
    return max(min(needed, math.floor(across)), 0)


def add_margin(world: World, config: SimulatorConfig) -> World:
    """Return a world with the margin that a configuration needs, or the same world if it needs no margin."""
    rows, cols = world.occupied.shape
    margin = margin_px(config, rows, cols)
    if not margin:
        return world
    frame, margin_m = world.frame, margin / world.frame.pixels_per_metre
    origin_m = (frame.origin_m[0] - margin_m, frame.origin_m[1] - margin_m)
    wider = replace(
        world,
        frame=GridFrame(origin_m, frame.pixels_per_metre, (rows + 2 * margin, cols + 2 * margin), frame.y_up),
        occupied=np.pad(world.occupied, margin, constant_values=1),
        traversable=np.pad(world.traversable, margin),
        observable=np.pad(world.observable, margin),
        margin_px=margin,
    )
    for array in (wider.occupied, wider.traversable, wider.observable):
        array.flags.writeable = False
    return wider


def _scan_m(noise: NoiseConfig, range_m: float) -> float:
    """Return how far the noise of a scan can move a cell outward (R1)."""
    laser_m = range_m if noise.max_range > 0 else min(MOST_SIGMA * noise.laser_m, range_m)
    turned = 2.0 * math.sin(min(MOST_SIGMA * math.radians(noise.registration_deg), math.pi) / 2.0)
    return laser_m + turned * range_m + MOST_SIGMA * noise.registration_m


def _drift_m(config: SimulatorConfig, height_m: float, width_m: float) -> float:
    """Return how far odometry may move the walls of a house of this size outward in an episode (R2)."""
    steps, half_m = config.max_steps, math.hypot(height_m, width_m) / 2.0
    turn, way, always_turn, always_way = _errors_of_a_step(config)
    seconds = steps * config.step_s
    rate = math.radians(config.noise.odometry_bias_deg_s)  # its integral has the deviation rate sqrt(t ** 3 / 3)
    heading = math.sqrt(turn**2 * steps + rate**2 * seconds**3 / 3.0)
    turned = min(DRIFT_SIGMA * heading + always_turn * steps, math.pi)
    rotation_m = min(2.0 * math.sin(turned / 2.0) * half_m, half_m - min(height_m, width_m) / 2.0)
    shift_m = DRIFT_SIGMA * math.hypot(heading * half_m, way * math.sqrt(steps))
    return rotation_m + shift_m + (always_turn * half_m + always_way) * steps


def _errors_of_a_step(config: SimulatorConfig) -> tuple[float, float, float, float]:
    """Return the deviations of a full step's heading and way by odometry, and their systematic errors; rad and m."""
    noise, robot = config.noise, config.robot
    way, turn = config.full_step_m, math.radians(robot.turn_deg)
    if isinstance(robot.drive, Ackermann):
        turn = way / robot.drive.least_radius_m
    elif robot.drive:
        turn = robot.drive.most_turning * config.step_s
    way2, turn2 = way * way, turn * turn
    heading2 = (noise.odometry_turn * turn) ** 2 + (math.radians(noise.odometry_deg_per_m) * way) ** 2
    along2, slipped = (noise.odometry_way * way) ** 2, 2.0 * noise.slip
    heading2, along2 = heading2 + (slipped * turn) ** 2 / 12.0, along2 + (slipped * way) ** 2 / 12.0  # a uniform share
    always_turn, always_way = noise.slip * turn, noise.slip * way
    model = noise.odometry_model
    if model is not None:
        along2 += model.alpha3 * way2 + model.alpha4 * turn2
        heading2 += 2.0 * (model.alpha1 * turn2 + model.alpha2 * way2)
    return math.sqrt(heading2), math.sqrt(along2), always_turn, always_way
