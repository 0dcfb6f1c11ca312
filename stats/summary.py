"""The summary of a data set: the measures of its plans, added up."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import Any

from houseexpo.floorplan import FloorPlan
from stats.catalogue import MEASURES
from stats.reach import Reach
from stats.record import Record, record
from stats.rings import Rings
from stats.tally import Tally


class PlanSummary:
    """All measures of many plans; two summaries can be merged in any order (``houseexpo.summaries``)."""

    def __init__(self) -> None:
        self.plans = 0
        self.tallies = {measure.name: Tally(measure.step, measure.bin_width) for measure in MEASURES}
        self.labels: Counter[str] = Counter()
        self.door_kinds: Counter[str] = Counter()
        self.with_cuts = 0
        self.reach: defaultdict[str, Reach] = defaultdict(Reach)
        self.rings = Rings()

    def add(self, plan: FloorPlan) -> None:
        """Measure one plan and add it."""
        self.take(record(plan))

    def take(self, found: Record) -> None:
        """Add the record of one plan."""
        self.plans += 1
        for name, numbers in found.numbers.items():
            tally = self.tallies[name]
            for number in numbers:
                tally.add(number)
        self.labels.update(found.labels)
        self.door_kinds.update(found.door_kinds)
        self.with_cuts += "cut" in found.door_kinds
        for radius, values in found.reach.items():
            self.reach[radius].take(*values)
        self.rings.take(found)

    def merge(self, other: PlanSummary) -> None:
        """Add the plans of another summary."""
        self.plans += other.plans
        for name, tally in other.tallies.items():
            self.tallies[name].merge(tally)
        self.labels.update(other.labels)
        self.door_kinds.update(other.door_kinds)
        self.with_cuts += other.with_cuts
        for radius, reach in other.reach.items():
            self.reach[radius].merge(reach)
        self.rings.merge(other.rings)

    def report(self) -> dict[str, Any]:
        """Return plain values; ``connected`` is the number of plans in which a robot can reach every place it fits."""
        return {
            "count": self.plans,
            **{name: tally.report() for name, tally in self.tallies.items()},
            "labels": dict(sorted(self.labels.items(), key=lambda pair: (-pair[1], pair[0]))),
            "door_kinds": dict(sorted(self.door_kinds.items())),
            "plans_with_cuts": self.with_cuts,
            "navigability": {radius: reach.report() for radius, reach in sorted(self.reach.items())},
            "rings": self.rings.report(),
        }
