"""What a data set is like: measures of its plans, added up."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import Any

from houseexpo.plan import FloorPlan
from stats import measures
from stats.tally import Tally


class PlanSummary:
    """Rooms, areas, labels, doors and navigability of many plans; two summaries add up (``houseexpo.summaries``)."""

    def __init__(self) -> None:
        self._rooms = Tally()
        self._area = Tally(step=0.01, bin_width=20.0)
        self._doors = Tally()
        self._labels: Counter[str] = Counter()
        self._kinds: Counter[str] = Counter()
        self._cut = 0
        self._connected: Counter[str] = Counter()
        self._largest_share: defaultdict[str, Tally] = defaultdict(lambda: Tally(step=0.0001, bin_width=0.05))

    def add(self, plan: FloorPlan) -> None:
        """Take one plan in."""
        kinds = measures.doors(plan)
        self._rooms.add(measures.rooms(plan))
        self._area.add(measures.area_m2(plan))
        self._doors.add(kinds.total())
        self._labels.update(measures.labels(plan))
        self._kinds.update(kinds)
        self._cut += bool(kinds["cut"])
        for radius, found in (plan.navigability or {}).items():
            self._connected[radius] += found.components == 1
            self._largest_share[radius].add(found.largest_share)

    def merge(self, other: PlanSummary) -> None:
        """Take in the plans of another summary."""
        self._rooms.merge(other._rooms)
        self._area.merge(other._area)
        self._doors.merge(other._doors)
        self._labels.update(other._labels)
        self._kinds.update(other._kinds)
        self._cut += other._cut
        self._connected.update(other._connected)
        for radius, tally in other._largest_share.items():
            self._largest_share[radius].merge(tally)

    def report(self) -> dict[str, Any]:
        """Return plain values; ``connected`` counts the plans in which a robot reaches all places that it fits into."""
        return {
            "rooms": self._rooms.report(),
            "area_m2": self._area.report(),
            "labels": dict(sorted(self._labels.items(), key=lambda pair: (-pair[1], pair[0]))),
            "doors": self._doors.report(),
            "door_kinds": dict(sorted(self._kinds.items())),
            "plans_with_cuts": self._cut,
            "navigability": {
                radius: {"connected": self._connected[radius], "largest_share": tally.report()}
                for radius, tally in sorted(self._largest_share.items())
            },
        }
