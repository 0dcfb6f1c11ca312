"""Rings that are not simple, and plans that occur more than once, as counts that can be merged."""

from __future__ import annotations

from collections import Counter
from typing import Any

from stats.record import Record


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

    def shared_with(self, other: Rings) -> int:
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
