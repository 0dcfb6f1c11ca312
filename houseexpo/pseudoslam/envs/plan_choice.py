"""Which plan an episode takes: one that is named, a random one, or the next of a list."""

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
    """Hands out the worlds of episodes.

    Parameters
    ----------
    plan_ids
        Plans that are taken; None: all of the data set.
    order
        "random": each as likely, an own draw for each episode. "in_turn": one after the other as they are listed, from
        the first again after the last one. The environments of a vector take from one list, whichever begins an
        episode next: as many episodes as there are plans, counted as they begin, have each plan once.

    ConfigError where an id is unknown, or there is none.
    """

    def __init__(self, worlds: WorldCache, plan_ids: Iterable[str] | None, order: Order) -> None:
        one_of(order, "plan_order", get_args(Order))
        self._worlds, self._order = worlds, order
        self.take(plan_ids)

    def take(self, plan_ids: Iterable[str] | None) -> None:
        """Take these plans from now on, from the first in turn; None: all."""
        self.plan_ids = None if plan_ids is None else _listed(plan_ids)
        self._numbers: Sequence[int] = range(len(self._worlds))
        if self.plan_ids is not None:
            self._numbers = [self._worlds.number_of(plan_id, "plan_ids") for plan_id in self.plan_ids]
        self._next = 0

    def start_over(self) -> None:
        """Begin the list anew."""
        self._next = 0

    def draw(self, rng: np.random.Generator, plan_id: str | None) -> World:
        """Return the world of a plan; where none is named, of the one whose turn it is, or of a random one."""
        if plan_id is not None:
            return self._worlds[self._worlds.number_of(plan_id)]
        if self._order == "random":
            return self._worlds[self._numbers[int(rng.integers(len(self._numbers)))]]
        number = self._numbers[self._next]
        self._next = (self._next + 1) % len(self._numbers)
        return self._worlds[number]


class TakesPlans:
    """An environment whose plans can be set: those of the episodes that begin from then on."""

    _choice: PlanChoice

    @property
    def plan_ids(self) -> list[str] | None:
        """The ids of the plans that are taken; None: all of the data set."""
        return self._choice.plan_ids

    @plan_ids.setter
    def plan_ids(self, plan_ids: Iterable[str] | None) -> None:
        self._choice.take(plan_ids)


def _listed(plan_ids: Iterable[str]) -> list[str]:
    """Return the ids as a list; ConfigError where they are none."""
    if isinstance(plan_ids, str) or not isinstance(plan_ids, Iterable):
        raise ConfigError(
            f"plan_ids: expected a list of plans' ids or None (all), found {plan_ids!r}; "
            "open_dataset(...).split(NAME).ids gives those of a list that comes with a data set"
        )
    ids = list(plan_ids)
    if not ids:
        raise ConfigError("plan_ids: expected at least one id, found none; leave it out to take all plans")
    return ids
