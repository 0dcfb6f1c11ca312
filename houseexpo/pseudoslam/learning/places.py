"""Where is learned and where is tested: environments of a task, and plans that are on one side only."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from houseexpo.dataset import Dataset
from houseexpo.dataset.splits import list_bytes
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.mapping import config_from, mapping_from
from houseexpo.pseudoslam.config.presets import with_preset
from houseexpo.pseudoslam.envs.vector import (
    ExplorationVectorEnv,
    NavigationVectorEnv,
    ObstacleAvoidanceVectorEnv,
    PseudoSlamVectorEnv,
)
from houseexpo.pseudoslam.learning.config import EnvironmentConfig
from houseexpo.pseudoslam.tasks import ROOM, Exploration, Navigation, ObstacleAvoidance, Task
from houseexpo.pseudoslam.worlds.cache import Plans

TaskName = Literal["exploration", "avoidance", "navigation"]
TASKS: Final[dict[str, tuple[type[Task], type[PseudoSlamVectorEnv]]]] = {
    "exploration": (Exploration, ExplorationVectorEnv),
    "avoidance": (ObstacleAvoidance, ObstacleAvoidanceVectorEnv),
    "navigation": (Navigation, NavigationVectorEnv),
}


@dataclass(frozen=True)
class Places:
    """Plans of a run; ids are None where there is one room only, which the task has of its own."""

    plans: Plans
    train: tuple[str, ...] | None = None
    test: tuple[str, ...] | None = None

    def record(self) -> dict[str, Any]:
        """Return how many plans there are on each side, and their lists' SHA-256."""
        lists = {"train": self.train, "test": self.test}
        return {
            side: {"plans": len(ids), "sha256": hashlib.sha256(list_bytes(ids)).hexdigest()}
            for side, ids in lists.items()
            if ids is not None
        }


def places_of(dataset: Dataset | None, config: EnvironmentConfig, test_plans: int) -> Places:
    """Return where is learned and tested; without a data set, the paper's room.

    1. Plans to learn in are all of the list ``config.train``.
    2. Plans to be tested in are ``test_plans`` of the list ``config.test``, drawn once and for all, whatever the seed.
    3. A plan is on one side only: ConfigError where both lists have it.
    """
    if dataset is None:
        return Places(ROOM)
    train, test = dataset.split(config.train).ids, dataset.split(config.test).ids  # R1
    for name, ids in ((config.train, train), (config.test, test)):
        if not ids:
            raise ConfigError(f"{dataset.path}: the list {name!r} has no plan that is there")
    if both := sorted(set(train) & set(test)):  # R3
        raise ConfigError(
            f"{dataset.path}: the lists {config.train!r} and {config.test!r} share {len(both)} of their plans, such as "
            f"{both[0]!r}; `houseexpo split` makes lists that share none"
        )
    drawn = np.random.default_rng(0).permutation(len(test))[:test_plans]  # R2
    return Places(dataset, tuple(train), tuple(test[i] for i in drawn.tolist()))


def simulator_of(task: str, config: EnvironmentConfig) -> SimulatorConfig:
    """Return the simulator's configuration: the preset's, else the task's own, with what the run changes."""
    kind, _ = TASKS[task]
    plain = with_preset(config.preset, kind.default) if config.preset else kind.default
    return config_from(SimulatorConfig, _merged(mapping_from(plain), config.simulator), "environment.simulator")


def check_options(task: str, config: EnvironmentConfig) -> None:
    """ConfigError where an option of the task, or of its simulator, is unknown or cannot be."""
    kind, _ = TASKS[task]
    config_from(kind, config.task, "environment.task")
    simulator_of(task, config)


def environments(
    task: str,
    config: EnvironmentConfig,
    plans: Plans,
    *,
    number: int,
    plan_ids: tuple[str, ...] | None = None,
    threads: int | None = None,
) -> PseudoSlamVectorEnv:
    """Return environments that begin anew in the step in which an episode ends, as Stable-Baselines3 wants them."""
    _, make = TASKS[task]
    given: dict[str, Any] = {"plan_ids": plan_ids} if plan_ids is not None else {}
    return make(
        dataset=plans,
        config=simulator_of(task, config),
        num_envs=number,
        actions=config.actions,
        observation=config.observation,
        autoreset_mode="SameStep",
        threads=threads,
        **config.task,
        **given,
    )


def _merged(plain: Any, changes: Any) -> Any:
    """Return nested mappings with some values changed; a part that was None is made of the changes alone."""
    if not (isinstance(plain, Mapping) and isinstance(changes, Mapping)):
        return changes
    return {**plain, **{key: _merged(plain.get(key), part) for key, part in changes.items()}}
