"""Make the parameters of a step from a configuration, choose the kernel and call it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from houseexpo.pseudoslam.config import Differential, NoiseConfig, Odometry, SimulatorConfig
from houseexpo.pseudoslam.kernels import step
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.planning.planner_types import PlannerRules, no_planner_rules
from houseexpo.pseudoslam.kernels.tolerances import BETWEEN_DEG, BETWEEN_M
from houseexpo.pseudoslam.kernels.types import (
    ACKERMANN,
    DIFFERENTIAL,
    NO_DRIVE,
    Drive,
    Errors,
    Floats,
    RobotBody,
    Scratch,
    Sensor,
    new_path_scratch,
)
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.moving_obstacles import make_walk_params
from houseexpo.pseudoslam.worlds.world import new_scan_buffers


def make_step_params(config: SimulatorConfig, clearance_m: float = 0.0, plan: PlannerRules | None = None) -> StepParams:
    """Return the parameters that are the same in all steps of all environments.

    ``clearance_m`` is the distance up to which the robot's clearance is measured; 0 turns this off. ``plan`` is for
    planners' actions.
    """
    ppm, laser, noise = float(config.pixels_per_metre), config.laser, config.noise  # an int would need other kernels
    half = math.radians(laser.fov_deg) / 2
    angles = np.arange(-half, half, math.radians(laser.resolution_deg))
    return StepParams(
        RobotBody(config.robot.radius_m * ppm, BETWEEN_M * ppm, math.radians(BETWEEN_DEG)),
        Sensor(laser.rule == "rays", half, laser.range_m * ppm, np.cos(angles), np.sin(angles)),
        make_noise_params(noise, ppm),
        make_walk_params(config.people, ppm),
        float(config.step_s),
        clearance_m * ppm,
        config.observation.global_size_m / config.observation.global_cells * ppm,
        plan or no_planner_rules(),
        _drive_of(config),
    )


def make_noise_params(noise: NoiseConfig, ppm: float) -> Errors:
    """Return the parameters of noise on a grid of ``ppm`` pixels per metre."""
    return Errors(
        any=noise.any,
        odometry=noise.odometry,
        beams=max(noise.drop_out, noise.max_range) > 0,
        laser_px=noise.laser_m * ppm,
        drop_out=float(noise.drop_out),
        max_range=float(noise.max_range),
        shift_px=noise.registration_m * ppm,
        turn_rad=math.radians(noise.registration_deg),
        way_share=float(noise.odometry_way),
        turn_share=float(noise.odometry_turn),
        turn_rad_px=math.radians(noise.odometry_deg_per_m) / ppm,
        modelled=noise.odometry_model is not None,
        alphas=_alphas_of(noise.odometry_model or Odometry(), ppm),
        slip=float(noise.slip),
        bias=math.radians(noise.odometry_bias_deg_s),
    )


def _alphas_of(model: Odometry, ppm: float) -> tuple[float, float, float, float]:
    """Return the parameters of the model of odometry, with lengths in pixels."""
    px2 = ppm * ppm
    return float(model.alpha1), model.alpha2 / px2, float(model.alpha3), model.alpha4 * px2


def _drive_of(config: SimulatorConfig) -> Drive:
    """Return the limits of the robot's drive."""
    drive, ppm = config.robot.drive, float(config.pixels_per_metre)
    if drive is None:
        return Drive(NO_DRIVE, 0.0, 0.0, 0.0)
    acceleration, rate = float(drive.acceleration_m_s2 * ppm), drive.turning_rate
    if isinstance(drive, Differential):
        return Drive(DIFFERENTIAL, acceleration, rate, 0.0)
    return Drive(ACKERMANN, acceleration, rate, float(drive.wheelbase_m * ppm))


def make_scratch(config: SimulatorConfig) -> Scratch:
    """Return working memory for the scans of one thread."""
    laser, range_px = config.laser, config.laser.range_m * config.pixels_per_metre
    runs, hit, slopes = new_scan_buffers(range_px)
    if laser.rule == "rays":
        rays = math.ceil(laser.fov_deg / laser.resolution_deg) + 1
        hit = np.empty(max(rays, len(hit)), np.int32)
        samples = rays * (round(range_px) + 1) if config.noise.any else 0
        runs = np.empty((max(samples, len(runs)), 2), np.int32)
    side = 2 * math.ceil(range_px) + 3
    patch = np.zeros((side, side) if config.noise.any else (1, 1), np.uint8)
    return Scratch(runs, hit, slopes, patch, new_path_scratch(0))


def enlarge_scratch(scratch: Scratch, cells: int) -> Scratch:
    """Return working memory that is also large enough for plans on grids of this many cells."""
    return scratch if cells <= len(scratch.ways.ways) else scratch._replace(ways=new_path_scratch(cells))


_ONE_STEP = np.full(1, step.STEP, np.uint8)


def choose_kernel(episode: Episode, params: StepParams, *, moves: bool | None = None) -> Any:
    """Return the compiled kernel for steps of such episodes, or for planners' actions in them.

    ``moves`` is whether it moves people and bodies on trajectories; by default, if there are any.
    """
    if moves is None:
        moves = len(episode.bodies.people) + len(episode.bodies.clocks) > 0
    return _kernel(params, travels=len(episode.plans.state) > 0, moves=moves, ranges=len(episode.ranges) > 0)


def find_kernel(name: str) -> Any:
    """Return a kernel for steps, for planners' actions or for drives, by its name."""
    if name.startswith("drive_pool"):
        from houseexpo.pseudoslam.kernels import driving  # import only what is needed

        return getattr(driving, name)
    if name.startswith("travel_pool"):
        from houseexpo.pseudoslam.kernels import planner_action

        return getattr(planner_action, name)
    return getattr(step, name)


def _kernel(params: StepParams, *, travels: bool, moves: bool, ranges: bool) -> Any:
    """Return the kernel for such steps, so that features that are not used need not be compiled."""
    driven = params.drive.kind != NO_DRIVE
    kind = "travel_pool" if travels else "drive_pool" if driven else "step_pool"
    if moves:
        return find_kernel(f"{kind}_with_people")
    if params.errors.any or ranges or driven:
        return find_kernel(f"{kind}_in_full")
    return find_kernel(f"{kind}_by_rays" if params.sensor.by_rays else f"{kind}_by_sector")


def step_episode(state: State, motion: Floats, params: StepParams, scratch: Scratch) -> None:
    """Step one episode by a motion (1, 2), or by a drive's command (1, 3), as the kernels take them."""
    choose_kernel(state.episode, params)(*kernel_arguments(state, motion, params, scratch))


def kernel_arguments(state: State, motion: Floats, params: StepParams, scratch: Scratch) -> tuple[Any, ...]:
    """Return the kernels' arguments for a step of one episode."""
    return state.binding.bind(state.pool, state.sizes, params, scratch), motion, _ONE_STEP, 0, 1


def take_first_scan(state: State, params: StepParams, scratch: Scratch) -> None:
    """Take a step in place; the first of an episode is not counted, since its count of steps begins at -1."""
    step_episode(state, np.zeros((1, 2)), params, scratch)
