"""A configuration in the form of the kernels."""

from __future__ import annotations

import math

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import StepParams
from houseexpo.pseudoslam.kernels.planning.plan import PlanRules, no_rules
from houseexpo.pseudoslam.kernels.types import Errors, Robot, Scratch, Sensor, known_ways_of
from houseexpo.pseudoslam.worlds.people import walk_of
from houseexpo.pseudoslam.worlds.world import scan_buffers

BETWEEN_M, BETWEEN_DEG = 0.3, 10.0
"""The largest distance between two scans during a step (section III-B: a map is built at each sub-pose)."""


def step_params_of(config: SimulatorConfig, clearance_m: float = 0.0, plan: PlanRules | None = None) -> StepParams:
    """Return the parameters that are the same in all steps of all environments.

    ``clearance_m`` is the distance up to which the robot's clearance is measured; 0 turns this off. ``plan`` is for
    planners' actions.
    """
    ppm, laser, noise = float(config.pixels_per_metre), config.laser, config.noise  # an int would need other kernels
    half = math.radians(laser.fov_deg) / 2
    angles = np.arange(-half, half, math.radians(laser.resolution_deg))
    return StepParams(
        Robot(config.robot.radius_m * ppm, BETWEEN_M * ppm, math.radians(BETWEEN_DEG)),
        Sensor(laser.rule == "rays", half, laser.range_m * ppm, np.cos(angles), np.sin(angles)),
        Errors(
            any=noise.any,
            odometry=max(noise.odometry_way, noise.odometry_turn, noise.odometry_deg_per_m) > 0,
            beams=max(noise.drop_out, noise.max_range) > 0,
            laser_px=noise.laser_m * ppm,
            drop_out=float(noise.drop_out),
            max_range=float(noise.max_range),
            shift_px=noise.registration_m * ppm,
            turn_rad=math.radians(noise.registration_deg),
            way_share=float(noise.odometry_way),
            turn_share=float(noise.odometry_turn),
            turn_rad_px=math.radians(noise.odometry_deg_per_m) / ppm,
        ),
        walk_of(config.people, ppm),
        float(config.step_s),
        clearance_m * ppm,
        config.observation.global_size_m / config.observation.global_cells * ppm,
        plan or no_rules(),
    )


def scratch_of(config: SimulatorConfig) -> Scratch:
    """Return working memory for the scans of one thread."""
    laser, range_px = config.laser, config.laser.range_m * config.pixels_per_metre
    runs, hit, slopes = scan_buffers(range_px)
    if laser.rule == "rays":
        rays = math.ceil(laser.fov_deg / laser.resolution_deg) + 1
        hit = np.empty(max(rays, len(hit)), np.int32)
        samples = rays * (round(range_px) + 1) if config.noise.any else 0
        runs = np.empty((max(samples, len(runs)), 2), np.int32)
    side = 2 * math.ceil(range_px) + 3
    patch = np.zeros((side, side) if config.noise.any else (1, 1), np.uint8)
    return Scratch(runs, hit, slopes, patch, known_ways_of(0))


def with_room(scratch: Scratch, cells: int) -> Scratch:
    """Return working memory that is also large enough for plans on grids of this many cells."""
    return scratch if cells <= len(scratch.ways.ways) else scratch._replace(ways=known_ways_of(cells))
