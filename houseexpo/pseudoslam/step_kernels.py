"""Which kernel takes the steps of an episode, and how it is called."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from houseexpo.pseudoslam.ahead import compile_ahead, wait_for
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels import step_pool
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.types import Scratch
from houseexpo.pseudoslam.state import State

_ONE_STEP = np.full(1, step_pool.STEP, np.uint8)


def kernel_for(episode: Episode, params: StepParams) -> Any:
    """Return the kernel that steps such episodes, or makes planners' actions of them, ready to be called."""
    moves = len(episode.bodies.people) + len(episode.bodies.clocks) > 0
    kernel = _kernel(params, travels=len(episode.plans.state) > 0, moves=moves, ranges=len(episode.ranges) > 0)
    wait_for(kernel)
    return kernel


def prepare_kernel(config: SimulatorConfig, params: StepParams, *, travels: bool = False, ranges: bool = False) -> None:
    """Begin to compile the kernel that steps such episodes, where that is to be done yet: before worlds are made.

    Parameters
    ----------
    travels
        Whether actions are planners'.
    ranges
        Whether ranges and the overview are observed.
    """
    moves = config.people.number > 0 or len(config.trajectories) > 0
    compile_ahead(_kernel(params, travels=travels, moves=moves, ranges=ranges))


def kernel_named(name: str) -> Any:
    """Return a kernel of steps, or of planners' actions."""
    if name.startswith("travels"):
        from houseexpo.pseudoslam.kernels import travel_pool  # what is not asked for need not be read

        return getattr(travel_pool, name)
    return getattr(step_pool, name)


def _kernel(params: StepParams, *, travels: bool, moves: bool, ranges: bool) -> Any:
    """Return the kernel of such steps: what is not asked for need not be compiled."""
    kind = "travels" if travels else "steps"
    if moves:
        return kernel_named(f"{kind}_with_people")
    if params.errors.any or ranges:
        return kernel_named(f"{kind}_in_full")
    return kernel_named(f"{kind}_by_rays" if params.sensor.by_rays else f"{kind}_by_sector")


def entry_point(kernel: Any, *arguments: Any) -> Callable[..., None]:
    """Return what a kernel is compiled to for arguments of such types: numba takes 20 us to find it at each call."""
    if not hasattr(kernel, "compile"):  # numba is off
        plain: Callable[..., None] = kernel
        return plain
    compiled: Callable[..., None] = kernel.compile(tuple(map(kernel.typeof_pyval, arguments)))
    return compiled


def step_one(state: State, turn_rad: float, forward_px: float, params: StepParams, scratch: Scratch) -> None:
    """Step one episode: turn, then go forward."""
    kernel_for(state.episode, params)(*arguments_of(state, turn_rad, forward_px, params, scratch))


def arguments_of(
    state: State, turn_rad: float, forward_px: float, params: StepParams, scratch: Scratch
) -> tuple[Any, ...]:
    """Return what the kernels take to step one episode."""
    return state.pool, state.sizes, np.array([[turn_rad, forward_px]]), _ONE_STEP, params, scratch, 0, 1


def look_round(state: State, params: StepParams, scratch: Scratch) -> None:
    """Take the first look of an episode that has just begun: a step in place, which is not counted."""
    step_one(state, 0.0, 0.0, params, scratch)
