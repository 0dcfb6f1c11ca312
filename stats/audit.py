"""Add up the audits of many plans (``houseexpo.analysis.audit``)."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import Any, Final

from houseexpo.analysis.audit import RULES, PlanAudit
from stats.tally import Tally

_HALLWAY: Final = {"entrance": "hallway", "corridor": "hallway"}
"""Types that data sets do not tell apart, and what both are in tables of sizes."""

_SHARE: Final = 1e-4
"""The precision of stored shares."""


class AuditSummary:
    """Audits of many plans; two summaries can be merged in any order.

    ``any`` counts the plans that break one of the rules that public data sets are held to, all but "light". ``broken``
    counts the plans that break each rule, and ``rooms`` the rooms of each type. ``broken_rooms`` counts the
    rooms of a type that break a rule.
    """

    def __init__(self) -> None:
        self.plans = 0
        self.any = 0
        self.broken: Counter[str] = Counter()
        self.rooms: Counter[str] = Counter()
        self.broken_rooms: Counter[tuple[str, str]] = Counter()
        self.shares = {name: Tally(_SHARE, 0.05) for name in ("overlap", "holes", "area", "width", "aspect")}
        self.pieces = Tally()
        self.areas: defaultdict[str, Tally] = defaultdict(lambda: Tally(0.01, 1.0))
        self.widths: defaultdict[str, Tally] = defaultdict(lambda: Tally(0.01, 0.1))

    def take(self, found: PlanAudit) -> None:
        """Add the audit of one plan."""
        broken = found.broken_rules()
        self.plans += 1
        self.any += bool(broken - {"light"})
        self.broken.update(broken)
        of_rooms = [(room, set(room.broken_rules())) for room in found.rooms]
        self.rooms.update(room.type for room in found.rooms)
        self.broken_rooms.update((room.type, rule) for room, rules in of_rooms for rule in rules)
        self.shares["overlap"].add(found.overlap)
        self.shares["holes"].add(found.holes)
        for rule in ("area", "width", "aspect"):
            self.shares[rule].add(sum(rule in rules for _, rules in of_rooms) / len(of_rooms))
        self.pieces.add(found.pieces)
        for room in found.rooms:
            kind = _HALLWAY.get(room.type, room.type)
            self.areas[kind].add(room.area_m2)
            self.widths[kind].add(room.width_m)

    def merge(self, other: AuditSummary) -> None:
        """Add the plans of another summary."""
        self.plans += other.plans
        self.any += other.any
        for name in ("broken", "rooms", "broken_rooms"):
            getattr(self, name).update(getattr(other, name))
        for name in ("shares", "areas", "widths"):
            for key, tally in getattr(other, name).items():
                getattr(self, name)[key].merge(tally)
        self.pieces.merge(other.pieces)

    @property
    def mean_rooms(self) -> float:
        """The mean number of rooms in a plan."""
        return self.rooms.total() / self.plans if self.plans else 0.0

    @property
    def any_share(self) -> float:
        """The share of plans that break a rule."""
        return self.any / self.plans if self.plans else 0.0

    def report(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "plans": self.plans,
            "break_a_rule": self.any,
            "break_a_rule_share": round(self.any_share, 6),
            "rules": {rule: self.broken[rule] for rule in RULES},
            "mean_shares": {name: round(tally.moments()[0], 6) for name, tally in self.shares.items() if tally.count},
            "pieces": self.pieces.report(),
            "rooms": {
                kind: {
                    "count": count,
                    **{rule: self.broken_rooms[kind, rule] for rule in ("area", "width", "aspect", "light")},
                }
                for kind, count in sorted(self.rooms.items())
            },
            "areas_m2": {kind: tally.report() for kind, tally in sorted(self.areas.items())},
            "widths_m": {kind: tally.report() for kind, tally in sorted(self.widths.items())},
        }
