"""What each task's environments take beside what all take; single and vector ones alike."""

from __future__ import annotations

from typing import Any

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.tasks import ROOM, Exploration, Navigation, ObstacleAvoidance
from houseexpo.pseudoslam.worlds.cache import Plans


class ExplorationMixin:
    """Explore."""

    def __init__(
        self,
        dataset: Plans,
        config: SimulatorConfig | None = None,
        *,
        success_coverage: float | None = 0.95,
        **kwargs: Any,
    ) -> None:
        super().__init__(Exploration(success_coverage), dataset, config, **kwargs)  # type: ignore[call-arg]  # the next base's


class ObstacleAvoidanceMixin:
    """Keep off obstacles."""

    def __init__(
        self,
        dataset: Plans = ROOM,
        config: SimulatorConfig | None = None,
        *,
        terminate_on_collision: bool = False,
        safe_m: float = 0.5,
        **kwargs: Any,
    ) -> None:
        task = ObstacleAvoidance(terminate_on_collision, safe_m)
        super().__init__(task, dataset, config, **kwargs)  # type: ignore[call-arg]  # the next base's


class NavigationMixin:
    """Go to a goal."""

    def __init__(
        self,
        dataset: Plans,
        config: SimulatorConfig | None = None,
        *,
        success_reward: float = 2.5,
        **kwargs: Any,
    ) -> None:
        super().__init__(Navigation(success_reward), dataset, config, **kwargs)  # type: ignore[call-arg]  # the next base's
