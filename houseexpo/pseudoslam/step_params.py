"""A configuration as the kernels take it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.step import (
    step_episode,
    step_episode_by_rays,
    step_episode_in_full,
    step_episode_with_people,
)
from houseexpo.pseudoslam.kernels.step_pool import (
    transitions,
    transitions_by_rays,
    transitions_in_full,
    transitions_with_people,
)
from houseexpo.pseudoslam.kernels.types import Errors, Robot, Scratch, Sensor
from houseexpo.pseudoslam.precompile import Kernel, precompile, wait_for
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.people import walk_of
from houseexpo.pseudoslam.worlds.world import scan_buffers

EPISODE_KERNELS = (step_episode, step_episode_by_rays, step_episode_in_full, step_episode_with_people)
POOL_KERNELS = (transitions, transitions_by_rays, transitions_in_full, transitions_with_people)
_KERNELS: tuple[Any, ...] = (*EPISODE_KERNELS, *POOL_KERNELS)
KERNELS: dict[str, Kernel] = {kernel.__name__: kernel for kernel in _KERNELS}
"""All kernels of steps, by their names: those of one episode, and those of a pool of them."""
BETWEEN_M, BETWEEN_DEG = 0.3, 10.0
"""A robot looks at least so often on its way (section III-B: a map is built at each sub-pose)."""


def step_params_of(config: SimulatorConfig, clearance_m: float = 0.0) -> StepParams:
    """Return what is the same in all steps of all environments.

    ``clearance_m`` is how far round the robot its clearance is measured; 0: it is not.
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
    return Scratch(runs, hit, slopes, np.zeros((side, side) if config.noise.any else (1, 1), np.uint8))


def kernel_of(params: StepParams, *, moving: bool, complete: bool, pooled: bool) -> Kernel:
    """Return the kernel of such steps: what is not asked for need not be compiled.

    Parameters
    ----------
    moving
        People or other things move by themselves.
    complete
        Ranges and an overview are wanted.
    pooled
        Many environments step together, on several threads.
    """
    kernels: tuple[Any, ...] = POOL_KERNELS if pooled else EPISODE_KERNELS
    by_sector, by_rays, in_full, with_people = kernels
    if moving:
        return with_people  # type: ignore[no-any-return]  # numba's functions have no types
    if params.errors.any or complete:
        return in_full  # type: ignore[no-any-return]
    return by_rays if params.sensor.by_rays else by_sector  # type: ignore[no-any-return]


def kernel_for(episode: Episode, params: StepParams, *, pooled: bool = False) -> Kernel:
    """Return the kernel that steps such episodes, ready."""
    moving = len(episode.bodies.people) + len(episode.bodies.clocks) > 0
    kernel = kernel_of(params, moving=moving, complete=len(episode.ranges) > 0, pooled=pooled)
    wait_for(kernel)
    return kernel


def prepare(config: SimulatorConfig, params: StepParams, *, complete: bool = False, pooled: bool = False) -> None:
    """Begin to compile what the steps of such episodes take, where that is to be done yet."""
    moving = config.people.number > 0 or len(config.trajectories) > 0
    precompile(kernel_of(params, moving=moving, complete=complete, pooled=pooled))


def step_one(state: State, turn_rad: float, forward_px: float, params: StepParams, scratch: Scratch) -> None:
    """Step one episode: turn, then go forward."""
    kernel_for(state.episode, params)(state.episode, turn_rad, forward_px, params, scratch)


def look_round(state: State, params: StepParams, scratch: Scratch) -> None:
    """Take the first look of an episode that has just begun: a step in place, which is not counted."""
    step_one(state, 0.0, 0.0, params, scratch)
