"""The additional arguments of each task's environments, single and vector."""

from __future__ import annotations

from typing import Any

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.tasks import (
    ROOM,
    AvoidanceReward,
    Exploration,
    ExplorationReward,
    Navigation,
    ObstacleAvoidance,
)
from houseexpo.pseudoslam.worlds.cache import Plans


class ExplorationMixin:
    """Arguments of exploration."""

    def __init__(
        self,
        dataset: Plans | None = None,  # gymnasium.make passes on what it is given; None is refused in plain words
        config: SimulatorConfig | str | None = None,
        *,
        success_coverage: float | None = 0.95,
        reward: ExplorationReward = "area",
        cost_per_metre: float = 0.0,
        cost_per_turn: float = 0.0,
        **kwargs: Any,
    ) -> None:
        task = Exploration(success_coverage, reward, cost_per_metre, cost_per_turn)
        super().__init__(task, dataset, config, **kwargs)  # type: ignore[call-arg]  # the next base's


class ObstacleAvoidanceMixin:
    """Arguments of obstacle avoidance."""

    def __init__(
        self,
        dataset: Plans = ROOM,
        config: SimulatorConfig | str | None = None,
        *,
        terminate_on_collision: bool = False,
        safe_m: float = 0.5,
        reward: AvoidanceReward = "paper",
        **kwargs: Any,
    ) -> None:
        task = ObstacleAvoidance(terminate_on_collision, safe_m, reward)
        super().__init__(task, dataset, config, **kwargs)  # type: ignore[call-arg]  # the next base's


class NavigationMixin:
    """Arguments of navigation."""

    def __init__(
        self,
        dataset: Plans | None = None,  # gymnasium.make passes on what it is given; None is refused in plain words
        config: SimulatorConfig | str | None = None,
        *,
        success_reward: float = 2.5,
        **kwargs: Any,
    ) -> None:
        super().__init__(Navigation(success_reward), dataset, config, **kwargs)  # type: ignore[call-arg]  # the next base's
