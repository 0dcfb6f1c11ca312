"""Choose the plan of an episode: a given one, a random one, or the next of a list."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, get_args

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.checks import one_of
from houseexpo.pseudoslam.worlds.cache import WorldCache
from houseexpo.pseudoslam.worlds.world import World

Order = Literal["random", "in_turn"]


class PlanChoice:
    """Chooses the worlds of episodes.

    Parameters
    ----------
    plan_ids
        Ids of the plans; None for all plans of the data set.
    order
        "random": a plan is drawn for each episode, all equally likely. "in_turn": plans are used in the order of the
        list, again from the first after the last one. All environments of a vector share one list, so that any
        successive episodes, in the order in which they begin, have different plans until all were used.

    Raises
    ------
    ConfigError
        An id is unknown, or there is no plan.
    """

    def __init__(self, worlds: WorldCache, plan_ids: Iterable[str] | None, order: Order) -> None:
        one_of(order, "plan_order", get_args(Order))
        self._worlds, self._order = worlds, order
        self.take(plan_ids)

    def take(self, plan_ids: Iterable[str] | None) -> None:
        """Use these plans from now on, starting with the first; None for all."""
        self.plan_ids = None if plan_ids is None else _listed(plan_ids)
        self._numbers: Sequence[int] = range(len(self._worlds))
        if self.plan_ids is not None:
            self._numbers = [self._worlds.number_of(plan_id, "plan_ids") for plan_id in self.plan_ids]
        self._next = 0

    def start_over(self) -> None:
        """Start again with the first plan."""
        self._next = 0

    def draw(self, rng: np.random.Generator, plan_id: str | None) -> World:
        """Return the world of the given plan; if none is given, that of the next or of a random one."""
        if plan_id is not None:
            return self._worlds[self._worlds.number_of(plan_id)]
        if self._order == "random":
            return self._worlds[self._numbers[int(rng.integers(len(self._numbers)))]]
        number = self._numbers[self._next]
        self._next = (self._next + 1) % len(self._numbers)
        return self._worlds[number]


class TakesPlans:
    """An environment with a settable list of plans, which applies to all later episodes."""

    _choice: PlanChoice

    @property
    def plan_ids(self) -> list[str] | None:
        """The ids of the plans for episodes; None for all plans of the data set."""
        return self._choice.plan_ids

    @plan_ids.setter
    def plan_ids(self, plan_ids: Iterable[str] | None) -> None:
        self._choice.take(plan_ids)


def _listed(plan_ids: Iterable[str]) -> list[str]:
    """Return the ids as a list; raise ConfigError if they are not ids."""
    if isinstance(plan_ids, str) or not isinstance(plan_ids, Iterable):
        raise ConfigError(
            f"plan_ids: expected a list of plans' ids or None (all), found {plan_ids!r}; "
            "open_dataset(...).split(NAME).ids gives those of a list that comes with a data set"
        )
    ids = list(plan_ids)
    if not ids:
        raise ConfigError("plan_ids: expected at least one id, found none; leave it out to take all plans")
    return ids
