"""A configuration as the kernels take it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.planning.plan import PlanRules, no_rules
from houseexpo.pseudoslam.kernels.step_pool import (
    STEP,
    steps_by_rays,
    steps_by_sector,
    steps_in_full,
    steps_with_people,
)
from houseexpo.pseudoslam.kernels.types import Errors, Robot, Scratch, Sensor, known_ways_of
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.people import walk_of
from houseexpo.pseudoslam.worlds.world import scan_buffers

BETWEEN_M, BETWEEN_DEG = 0.3, 10.0
"""A robot looks at least so often on its way (section III-B: a map is built at each sub-pose)."""
_ONE_STEP = np.full(1, STEP, np.uint8)


def step_params_of(config: SimulatorConfig, clearance_m: float = 0.0, plan: PlanRules | None = None) -> StepParams:
    """Return what is the same in all steps of all environments.

    ``clearance_m`` is how far round the robot its clearance is measured; 0: it is not. ``plan`` is for actions of
    planners.
    """
    ppm, laser, noise = float(config.pixels_per_metre), config.laser, config.noise  # a whole number makes other kernels
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
    """Return memory for the scans of one thread."""
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
    """Return memory for plans on grids of so many cells, too; what there is may be enough."""
    return scratch if cells <= len(scratch.ways.ways) else scratch._replace(ways=known_ways_of(cells))


def kernel_for(episode: Episode, params: StepParams) -> Any:
    """Return the kernel that steps such episodes, or makes planners' actions of them.

    What is not asked for need not be compiled.
    """
    if len(episode.plans.state) > 0:
        from houseexpo.pseudoslam.kernels import travel_pool

        if len(episode.bodies.people) + len(episode.bodies.clocks) > 0:
            return travel_pool.travels_with_people
        if params.errors.any or len(episode.ranges) > 0:
            return travel_pool.travels_in_full
        return travel_pool.travels_by_rays if params.sensor.by_rays else travel_pool.travels_by_sector
    if len(episode.bodies.people) + len(episode.bodies.clocks) > 0:
        return steps_with_people
    if params.errors.any or len(episode.ranges) > 0:
        return steps_in_full
    return steps_by_rays if params.sensor.by_rays else steps_by_sector


def entry_point(kernel: Any, *arguments: Any) -> Callable[..., None]:
    """Return what a kernel is compiled to for arguments of such types: numba takes 20 us to find it at each call."""
    if not hasattr(kernel, "compile"):  # numba is off
        plain: Callable[..., None] = kernel
        return plain
    compiled: Callable[..., None] = kernel.compile(tuple(map(kernel.typeof_pyval, arguments)))
    return compiled


def step_one(state: State, turn_rad: float, forward_px: float, params: StepParams, scratch: Scratch) -> None:
    """Step one episode: turn, then go forward."""
    motions = np.array([[turn_rad, forward_px]])
    kernel_for(state.episode, params)(state.pool, state.sizes, motions, _ONE_STEP, params, scratch, 0, 1)


def look_round(state: State, params: StepParams, scratch: Scratch) -> None:
    """Take the first look of an episode that has just begun: a step in place, which is not counted."""
    step_one(state, 0.0, 0.0, params, scratch)
