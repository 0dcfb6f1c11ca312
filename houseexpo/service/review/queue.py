"""In which order plans are judged: the least sure first, and two people at one server are not sent to the same one."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Final, Literal

from houseexpo.dataset import Dataset
from houseexpo.plan.parts import SURE
from houseexpo.service.review.decisions import Judged

Move = Literal["here", "next", "previous", "open"]
LOOKED_AT_S: Final = 90.0
"""For so long nobody else is sent to a plan that somebody was sent to, unless it was judged."""


class Queue:
    """The plans of a data set by their quality; of those without one, by their id, at the end."""

    def __init__(self, dataset: Dataset) -> None:
        qualities = [math.inf if value is None else value for value in dataset.column("quality")]
        self.dataset = dataset
        self.order = [name for _, name in sorted(zip(qualities, dataset.ids, strict=True))]
        self.places = {name: place for place, name in enumerate(self.order)}
        self.doubtful = sum(quality < SURE for quality in qualities)
        self._looked_at: dict[str, tuple[str, float]] = {}

    def move(self, start: str | None, how: Move, reviewer: str, judged: Mapping[str, Judged]) -> str | None:
        """Return the plan that is "next" to one, "previous" to it, the next "open" one, or the one "here".

        Without a plan to start from that is there, it is the first one. None where none is left, or there are no plans.
        """
        size = len(self.order)
        if not size:
            return None
        if start is None or start not in self.places:
            return self.order[0] if how != "open" else self._open(-1, reviewer, judged)
        place = self.places[start]
        if how == "open":
            return self._open(place, reviewer, judged)
        step = {"here": 0, "next": 1, "previous": -1}[how]
        return self.order[min(max(place + step, 0), size - 1)]

    def _open(self, place: int, reviewer: str, judged: Mapping[str, Judged]) -> str | None:
        now, others = time.monotonic(), None
        for step in range(1, len(self.order) + 1):
            name = self.order[(place + step) % len(self.order)]
            if name in judged:
                continue
            who, when = self._looked_at.get(name, ("", -math.inf))
            if who in {"", reviewer} or now - when > LOOKED_AT_S:
                self._looked_at[name] = reviewer, now
                return name
            others = others or name
        return others

    def progress(self, judged: Mapping[str, Judged]) -> dict[str, int]:
        """Return how many plans there are and are judged, of the doubtful ones, too."""
        doubtful = self.order[: self.doubtful]
        return {
            "plans": len(self.order),
            "judged": sum(name in self.places for name in judged),
            "doubtful": self.doubtful,
            "doubtful_judged": sum(name in judged for name in doubtful),
        }
