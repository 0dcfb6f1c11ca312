"""Choose plans for training and for evaluation, none in both, and make the vector environments of a training task."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from houseexpo.configuration import config_from_mapping, config_to_mapping
from houseexpo.dataset import Dataset
from houseexpo.dataset.splits import encode_id_list
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.simulator import with_preset
from houseexpo.pseudoslam.envs.vector import (
    ExplorationVectorEnv,
    NavigationVectorEnv,
    ObstacleAvoidanceVectorEnv,
    PseudoSlamVectorEnv,
)
from houseexpo.pseudoslam.learning.config import EnvironmentConfig
from houseexpo.pseudoslam.tasks import ROOM, Exploration, Navigation, ObstacleAvoidance, Task
from houseexpo.pseudoslam.worlds.maps import Plans

TaskName = Literal["exploration", "avoidance", "navigation"]
TASKS: Final[dict[str, tuple[type[Task], Callable[..., PseudoSlamVectorEnv]]]] = {
    "exploration": (Exploration, ExplorationVectorEnv),
    "avoidance": (ObstacleAvoidance, ObstacleAvoidanceVectorEnv),
    "navigation": (Navigation, NavigationVectorEnv),
}


@dataclass(frozen=True)
class RunPlans:
    """The plans of a run and the data set that holds them; ids are None if there is only the task's own room."""

    source: Plans
    train: tuple[str, ...] | None = None
    test: tuple[str, ...] | None = None

    def record(self) -> dict[str, Any]:
        """Return the numbers of plans for training and evaluation, and the SHA-256 of their lists."""
        lists = {"train": self.train, "test": self.test}
        return {
            side: {"plans": len(ids), "sha256": hashlib.sha256(encode_id_list(ids)).hexdigest()}
            for side, ids in lists.items()
            if ids is not None
        }


def choose_plans(dataset: Dataset | None, config: EnvironmentConfig, test_plans: int) -> RunPlans:
    """Return the plans for training and evaluation; without a data set, the paper's room.

    1. The plans for training are all of the list ``config.train``.
    2. The plans for evaluation are ``test_plans`` of the list ``config.test``; the choice does not depend on the seed.
    3. The lists must not have common plans, otherwise ConfigError is raised.
    """
    if dataset is None:
        return RunPlans(ROOM)
    train, test = dataset.split(config.train).ids, dataset.split(config.test).ids  # R1
    for name, ids in ((config.train, train), (config.test, test)):
        if not ids:
            raise ConfigError(
                f"{dataset.path}: expected plans in the list {name!r}, found none of them in the data set"
            )
    if both := sorted(set(train) & set(test)):  # R3
        raise ConfigError(
            f"{dataset.path}: the lists {config.train!r} and {config.test!r} share {len(both)} of their plans, such as "
            f"{both[0]!r}; `houseexpo split` makes lists that share none"
        )
    drawn = np.random.default_rng(0).permutation(len(test))[:test_plans]  # R2
    return RunPlans(dataset, tuple(train), tuple(test[i] for i in drawn.tolist()))


def make_simulator_config(task: str, config: EnvironmentConfig) -> SimulatorConfig:
    """Return the simulator's configuration: that of the preset or else of the task, with the run's changes."""
    kind, _ = TASKS[task]
    plain = with_preset(config.preset, kind.default) if config.preset else kind.default
    return config_from_mapping(
        SimulatorConfig, _merge(config_to_mapping(plain), config.simulator), "environment.simulator"
    )


def check_task_options(task: str, config: EnvironmentConfig) -> None:
    """Raise ConfigError if an option of the task or of its simulator is unknown or invalid."""
    kind, _ = TASKS[task]
    config_from_mapping(kind, config.task, "environment.task")
    make_simulator_config(task, config)


def make_environments(
    task: str,
    config: EnvironmentConfig,
    plans: Plans,
    *,
    number: int,
    plan_ids: tuple[str, ...] | None = None,
    threads: int | None = None,
) -> PseudoSlamVectorEnv:
    """Return environments that reset in the step in which an episode ends, as Stable-Baselines3 requires."""
    _, make = TASKS[task]
    given: dict[str, Any] = {"plan_ids": plan_ids} if plan_ids is not None else {}
    return make(
        dataset=plans,
        config=make_simulator_config(task, config),
        num_envs=number,
        actions=config.actions,
        observation=config.observation,
        motion=config.motion,
        action_mask=config.action_mask,
        autoreset_mode="SameStep",
        threads=threads,
        **config.task,
        **given,
    )


def _merge(plain: Any, changes: Any) -> Any:
    """Return nested mappings with some values changed; a part that was None consists only of the changes."""
    if not (isinstance(plain, Mapping) and isinstance(changes, Mapping)):
        return changes
    return {**plain, **{key: _merge(plain.get(key), part) for key, part in changes.items()}}
