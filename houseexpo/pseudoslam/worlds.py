"""Plans as worlds, each rasterised once and shared."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias, Union

from houseexpo.dataset import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.plan import FloorPlan
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.world import World, make_world

Plans: TypeAlias = Union[str, "os.PathLike[str]", FloorPlan, Sequence[FloorPlan]]

_KEPT = 512  # worlds; a house of 120 m2 at 25 px/m takes 0.4 MB


class Worlds:
    """The worlds of a data set for one configuration; the last used ones are kept.

    ``plans`` is a data set or its path, a plan, or a list of plans.
    """

    def __init__(self, plans: Plans, config: SimulatorConfig) -> None:
        found = open_dataset(plans) if isinstance(plans, (str, os.PathLike)) else plans
        self._plans: Sequence[FloorPlan] = [found] if isinstance(found, FloorPlan) else found
        if not len(self._plans):
            raise ConfigError("dataset: expected at least one plan, found none")
        self._config = config
        self._make = lru_cache(maxsize=_KEPT)(self._world)

    def __len__(self) -> int:
        return len(self._plans)

    def __getitem__(self, number: int) -> World:
        """Return the world of a plan; ConfigError and PlanError as ``make_world`` raises them."""
        return self._make(number)

    def number_of(self, plan_id: str) -> int:
        """Return the number of a plan; ConfigError where there is none of that id."""
        ids: Sequence[str] = getattr(self._plans, "ids", None) or [plan.id for plan in self._plans]
        if plan_id not in ids:
            raise ConfigError(f"plan_id: none of the {len(ids)} plans has the id {plan_id!r}")
        return ids.index(plan_id)

    def _world(self, number: int) -> World:
        config = self._config
        return make_world(self._plans[number], config.pixels_per_metre, config.robot.radius_m, config.laser.range_m)
