"""Add up the Records of many plans (measures, a robot's reach, ring faults, repeats); summaries can be merged."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import Any

from houseexpo.analysis.measures import Measure
from houseexpo.floorplan import FloorPlan
from stats.audit import AuditSummary
from stats.record import BY_KEY, MEASURES, Record, measure_plan
from stats.tally import Tally


class Reach:
    """The number of plans in which a robot can reach everything, the share that it reaches, the narrowest passages."""

    def __init__(self) -> None:
        self.plans = 0
        self.connected = 0
        self.nowhere = 0
        self.largest_share = Tally(step=0.0001, bin_width=0.05)
        self.narrowest = Tally(step=0.01, bin_width=0.1)

    def take(self, components: int, largest_share: float, narrowest: float) -> None:
        """Add one plan; if the robot fits nowhere, there is no passage."""
        self.plans += 1
        self.connected += components == 1
        self.nowhere += components == 0
        self.largest_share.add(largest_share)
        if components:
            self.narrowest.add(narrowest)

    def merge(self, other: Reach) -> None:
        """Add the plans of another one."""
        self.plans += other.plans
        self.connected += other.connected
        self.nowhere += other.nowhere
        self.largest_share.merge(other.largest_share)
        self.narrowest.merge(other.narrowest)

    @property
    def connected_share(self) -> float:
        """Share of the plans in which the robot can reach every place where it fits."""
        return self.connected / self.plans if self.plans else 0.0

    def report(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "plans": self.plans,
            "connected": self.connected,
            "connected_share": round(self.connected_share, 6),
            "nowhere": self.nowhere,
            "largest_share": self.largest_share.report(),
            "narrowest": self.narrowest.report(),
        }


class Rings:
    """Counts of ring faults by kind, of each ring, and of each shape up to rotation and mirroring."""

    def __init__(self) -> None:
        self.faults: Counter[str] = Counter()
        self.rings: Counter[str] = Counter()
        self.shapes: Counter[str] = Counter()

    def take(self, record: Record) -> None:
        """Add one plan."""
        if record.fault is not None:
            self.faults[record.fault] += 1
        self.rings[record.ring] += 1
        self.shapes[record.shape] += 1

    def merge(self, other: Rings) -> None:
        """Add the plans of another one."""
        self.faults.update(other.faults)
        self.rings.update(other.rings)
        self.shapes.update(other.shapes)

    def count_shared(self, other: Rings) -> int:
        """Return how many plans have a shape that also occurs in ``other``, possibly rotated or mirrored."""
        return sum(n for shape, n in self.shapes.items() if shape in other.shapes)

    def report(self) -> dict[str, Any]:
        """Return plain values; ``repeats`` is plans minus distinct rings, ``groups`` the rings of several plans."""
        groups = [n for n in self.rings.values() if n > 1]
        return {
            "invalid": self.faults.total(),
            "touching": self.faults["touches"],
            "crossing": self.faults["crosses"],
            "repeats": self.rings.total() - len(self.rings),
            "groups": len(groups),
            "plans_in_groups": sum(groups),
            "largest_group": max(groups, default=0),
            "repeats_turned_or_mirrored": self.shapes.total() - len(self.shapes),
        }


class PlanSummary:
    """All measures of many plans; two summaries can be merged in any order."""

    def __init__(self) -> None:
        self.plans = 0
        self.tallies = {measure.key: Tally(measure.step, measure.bin_width) for measure in MEASURES}
        self.labels: Counter[str] = Counter()
        self.door_kinds: Counter[str] = Counter()
        self.with_cuts = 0
        self.reach: defaultdict[str, Reach] = defaultdict(Reach)
        self.rings = Rings()
        self.audit = AuditSummary()

    @property
    def room_measure(self) -> Measure:
        """The measure of rooms in a report's first lines: the source's count if no plan records rooms."""
        return BY_KEY["rooms" if self.tallies["rooms"].count else "source_rooms"]

    def add(self, plan: FloorPlan) -> None:
        """Measure one plan and add it."""
        self.take(measure_plan(plan))

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
        if found.audit is not None:
            self.audit.take(found.audit)

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
        self.audit.merge(other.audit)

    def report(self) -> dict[str, Any]:
        """Return plain values; ``connected`` is the number of plans in which a robot can reach every place it fits.

        The key ``audit`` is there if any plan was audited.
        """
        return {
            "count": self.plans,
            **{name: tally.report() for name, tally in self.tallies.items()},
            "labels": dict(sorted(self.labels.items(), key=lambda pair: (-pair[1], pair[0]))),
            "door_kinds": dict(sorted(self.door_kinds.items())),
            "plans_with_cuts": self.with_cuts,
            "navigability": {radius: reach.report() for radius, reach in sorted(self.reach.items())},
            "rings": self.rings.report(),
            **({"audit": self.audit.report()} if self.audit.plans else {}),
        }
