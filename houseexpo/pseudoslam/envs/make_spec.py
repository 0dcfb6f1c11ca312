"""Make the ``EnvSpec`` of an environment from its arguments."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import get_args

from gymnasium.vector import AutoresetMode

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import one_of, whole
from houseexpo.pseudoslam.config.planning import PlanningConfig
from houseexpo.pseudoslam.config.presets import PRESETS, with_preset
from houseexpo.pseudoslam.envs.options import Layout
from houseexpo.pseudoslam.envs.plan_choice import Order, PlanChoice
from houseexpo.pseudoslam.envs.planners import make_planner_spec
from houseexpo.pseudoslam.envs.spec import Actions, EnvSpec, Kind
from houseexpo.pseudoslam.step_kernels import prepare_kernel
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.cache import Plans, WorldCache

MAX_ENVS = (1 << 20) - 1  # in one vector


def make_env_spec(
    task: Task,
    dataset: Plans,
    config: SimulatorConfig | str | None,
    actions: Actions,
    observation: Kind,
    *,
    planning: PlanningConfig | None = None,
    layout: Layout = "CHW",
    plan_ids: Iterable[str] | None = None,
    plan_order: Order = "random",
    max_episode_steps: int | None = None,
) -> EnvSpec:
    """Return the specification of an environment; raise ConfigError if an argument is invalid."""
    for name, value, kinds in (
        ("actions", actions, Actions),
        ("observation", observation, Kind),
        ("layout", layout, Layout),
    ):
        one_of(value, name, get_args(kinds))
    config = _configured(task, config, observation, max_episode_steps)
    planner = make_planner_spec(actions, observation, planning, config, task)
    choice = PlanChoice(WorldCache(dataset, config), plan_ids, plan_order)
    spec = EnvSpec(task, config, choice, actions, observation, layout, planner)
    prepare_kernel(config, spec.params(), travels=planner is not None, ranges=spec.complete)
    return spec


def _configured(
    task: Task, config: SimulatorConfig | str | None, observation: Kind, max_episode_steps: int | None
) -> SimulatorConfig:
    """Return the configuration; raise ConfigError if it is invalid or does not fit the observation."""
    if isinstance(config, str):
        config = with_preset(config, task.configured(None))
    if config is not None and not isinstance(config, SimulatorConfig):
        raise ConfigError(f"config: expected a SimulatorConfig, one of {', '.join(PRESETS)}, or None; found {config!r}")
    config = task.configured(config)
    if max_episode_steps is not None:
        whole(max_episode_steps, "max_episode_steps", at_least=1)
        config = replace(config, max_steps=max_episode_steps)
    view = config.observation
    if observation == "scales" and view.far_size_m <= view.size_m:
        raise ConfigError(
            f"observation.far_size_m: expected more than size_m, {view.size_m:g}, for several scales, "
            f"found {view.far_size_m:g}"
        )
    return config


def checked_vector(
    num_envs: int, threads: int | None, autoreset_mode: AutoresetMode | str, render_mode: str | None
) -> AutoresetMode:
    """Return the autoreset mode of a vector environment; raise ConfigError if an argument is invalid."""
    whole(num_envs, "num_envs", at_least=1, at_most=MAX_ENVS)
    whole(1 if threads is None else threads, "threads", at_least=1)
    if autoreset_mode not in set(AutoresetMode) | {mode.value for mode in AutoresetMode}:
        modes = ", ".join(mode.value for mode in AutoresetMode)
        raise ConfigError(f"autoreset_mode: expected one of {modes}; found {autoreset_mode!r}")
    if render_mode not in {None, "rgb_array"}:
        raise ConfigError(f"render_mode: expected 'rgb_array' or None, found {render_mode!r}")
    return AutoresetMode(autoreset_mode)
