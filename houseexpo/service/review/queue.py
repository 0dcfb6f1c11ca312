"""Order the plans of a data set for its reviewers, and sum up what was decided."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, Final, Literal

from houseexpo.dataset import Dataset
from houseexpo.plan.ids import parts_of
from houseexpo.plan.parts import SURE
from houseexpo.service.review.decisions import PlanDecisions

Move = Literal["here", "next", "previous", "open"]
LOOKED_AT_S: Final = 90.0
"""For this time, a plan that one reviewer was sent to is not offered to others."""


_MOST_STOREYS: Final = 40


class ReviewQueue:
    """The plans of a data set, the least certain first; plans without a quality come last, by id."""

    def __init__(self, dataset: Dataset) -> None:
        qualities = [math.inf if value is None else value for value in dataset.column("quality")]
        self.dataset = dataset
        self.order = [name for _, name in sorted(zip(qualities, dataset.ids, strict=True))]
        self.places = {name: place for place, name in enumerate(self.order)}
        self.doubtful = sum(quality < SURE for quality in qualities)
        self._looked_at: dict[str, tuple[str, float]] = {}

    def move(self, start: str | None, how: Move, reviewer: str, judged: Mapping[str, PlanDecisions]) -> str | None:
        """Return the "next" or "previous" plan, the next "open" one (neither kept nor dropped), or the plan "here".

        If ``start`` is not in the data set, the queue starts at the first plan. The result is None if no plan is left.
        """
        size = len(self.order)
        if not size:
            return None
        if start is None or start not in self.places:
            return self.order[0] if how != "open" else self._next_open(-1, reviewer, judged)
        place = self.places[start]
        if how == "open":
            return self._next_open(place, reviewer, judged)
        step = {"here": 0, "next": 1, "previous": -1}[how]
        return self.order[min(max(place + step, 0), size - 1)]

    def _next_open(self, place: int, reviewer: str, judged: Mapping[str, PlanDecisions]) -> str | None:
        now, others = time.monotonic(), None
        for step in range(1, len(self.order) + 1):
            name = self.order[(place + step) % len(self.order)]
            if name in judged and not {"keep", "drop"}.isdisjoint(judged[name].actions):
                continue
            who, when = self._looked_at.get(name, ("", -math.inf))
            if who in {"", reviewer} or now - when > LOOKED_AT_S:
                self._looked_at[name] = reviewer, now
                return name
            others = others or name
        return others

    def storeys(self, name: str) -> list[dict[str, str]]:
        """Return the plans of one house, by level: the id and a title of each; none if the house has one plan."""
        house, level = parts_of(name).of_building, parts_of(name).level
        ids = sorted(each for each in self.order if parts_of(each).of_building == house) if level else []
        told = [(each, (self.dataset[each].provenance or {}).get("storey")) for each in ids[:_MOST_STOREYS]]
        return [{"plan": each, "title": str(title or parts_of(each).level[1:])} for each, title in told if len(ids) > 1]

    def progress(self, judged: Mapping[str, PlanDecisions]) -> dict[str, int]:
        """Return the number of plans and of judged ones, in all and among the doubtful ones; a note decides nothing."""
        doubtful = self.order[: self.doubtful]
        judged = {name: each for name, each in judged.items() if set(each.actions) != {"note"}}
        return {
            "plans": len(self.order),
            "judged": sum(name in self.places for name in judged),
            "doubtful": self.doubtful,
            "doubtful_judged": sum(name in judged for name in doubtful),
        }


def summarise_review(ids: Iterable[str], judged: Mapping[str, PlanDecisions]) -> dict[str, Any]:
    """Return the result of a review: the plans by kind of decision, the reviewers, and the time from first to last."""
    there = {name: judged[name] for name in ids if name in judged}
    actions: dict[str, list[str]] = {}
    for name, found in there.items():
        for action in dict.fromkeys(found.actions):
            actions.setdefault(action, []).append(name)
    times = sorted(found.last.time for found in there.values())
    return {
        "actions": actions,
        "reviewers": dict(Counter(found.last.reviewer for found in there.values()).most_common()),
        "from": times[0] if times else None,
        "to": times[-1] if times else None,
    }
