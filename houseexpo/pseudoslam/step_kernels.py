"""Choose and call the kernel for the steps of an episode."""

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
    """Return the compiled kernel for steps of such episodes, or for planners' actions in them."""
    moves = len(episode.bodies.people) + len(episode.bodies.clocks) > 0
    kernel = _kernel(params, travels=len(episode.plans.state) > 0, moves=moves, ranges=len(episode.ranges) > 0)
    wait_for(kernel)
    return kernel


def prepare_kernel(config: SimulatorConfig, params: StepParams, *, travels: bool = False, ranges: bool = False) -> None:
    """Start to compile the kernel for steps of such episodes if needed; call this before making worlds.

    Parameters
    ----------
    travels
        Whether the actions are those of planners.
    ranges
        Whether ranges and the overview are observed.
    """
    moves = config.people.number > 0 or len(config.trajectories) > 0
    compile_ahead(_kernel(params, travels=travels, moves=moves, ranges=ranges))


def kernel_named(name: str) -> Any:
    """Return a kernel for steps or for planners' actions, by its name."""
    if name.startswith("travels"):
        from houseexpo.pseudoslam.kernels import travel_pool  # import only what is needed

        return getattr(travel_pool, name)
    return getattr(step_pool, name)


def _kernel(params: StepParams, *, travels: bool, moves: bool, ranges: bool) -> Any:
    """Return the kernel for such steps, so that features that are not used need not be compiled."""
    kind = "travels" if travels else "steps"
    if moves:
        return kernel_named(f"{kind}_with_people")
    if params.errors.any or ranges:
        return kernel_named(f"{kind}_in_full")
    return kernel_named(f"{kind}_by_rays" if params.sensor.by_rays else f"{kind}_by_sector")


def entry_point(kernel: Any, *arguments: Any) -> Callable[..., None]:
    """Return the compiled function of a kernel for such arguments, which numba needs 20 us to find at each call."""
    if not hasattr(kernel, "compile"):  # numba is disabled
        plain: Callable[..., None] = kernel
        return plain
    compiled: Callable[..., None] = kernel.compile(tuple(map(kernel.typeof_pyval, arguments)))
    return compiled


def step_one(state: State, turn_rad: float, forward_px: float, params: StepParams, scratch: Scratch) -> None:
    """Step one episode: turn, then move forward."""
    kernel_for(state.episode, params)(*arguments_of(state, turn_rad, forward_px, params, scratch))


def arguments_of(
    state: State, turn_rad: float, forward_px: float, params: StepParams, scratch: Scratch
) -> tuple[Any, ...]:
    """Return the kernels' arguments for a step of one episode."""
    return state.pool, state.sizes, np.array([[turn_rad, forward_px]]), _ONE_STEP, params, scratch, 0, 1


def look_round(state: State, params: StepParams, scratch: Scratch) -> None:
    """Take the first scan of an episode that has just begun: a step in place, which is not counted."""
    step_one(state, 0.0, 0.0, params, scratch)
