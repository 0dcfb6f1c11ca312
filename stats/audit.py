"""Add up the audits of many plans (``houseexpo.analysis.audit``), to compare with those of nine public data sets.

The published results are all from results/summary.md and results/datasets/area_percentiles.csv of floorplan_eval
(github.com/birsakm/floorplan_eval, commit 1855c76, read in 2026), which converts each data set and measures it. The
data sets themselves are not part of houseexpo.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

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


CITED: Final = "floorplan_eval (github.com/birsakm/floorplan_eval, results/summary.md, commit 1855c76)"


class PublicSet(NamedTuple):
    """A public data set: its name, the kind of its plans (``one``), their number, mean room count, and audit results.

    ``area``, ``width`` and ``aspect`` are means over the plans of the share of rooms that break the rule, None if the
    data set has no known scale. ``any`` is the share of plans that break a rule.
    """

    name: str
    one: str
    plans: int
    rooms: float
    overlap: float
    holes: float
    pieces: float
    area: float | None
    width: float | None
    aspect: float
    any: float


PUBLIC: Final = (
    PublicSet("ProcTHOR-10k", "made house", 1000, 3.73, 0.000, 0.000, 1.00, 0.006, 0.023, 0.015, 0.125),
    PublicSet("ResPlan", "flat", 16317, 8.29, 0.003, 0.001, 1.01, 0.005, 0.011, 0.002, 0.136),
    PublicSet("LIFULL", "flat, unknown scale", 10000, 8.16, 0.004, 0.000, 1.10, None, None, 0.008, 0.139),
    PublicSet("RPLAN", "flat", 12063, 6.79, 0.000, 0.000, 1.00, 0.004, 0.027, 0.002, 0.171),
    PublicSet("Swiss Dwellings", "flat on one floor", 46830, 7.87, 0.000, 0.001, 1.04, 0.014, 0.028, 0.002, 0.250),
    PublicSet("MagicPlan", "floor", 10000, 6.12, 0.000, 0.003, 1.03, 0.040, 0.063, 0.005, 0.359),
    PublicSet("Tell2Design", "flat, from images", 2308, 6.81, 0.000, 0.000, 1.04, 0.012, 0.061, 0.004, 0.368),
    PublicSet("CubiCasa5k", "floor", 6103, 10.06, 0.003, 0.001, 1.06, 0.046, 0.056, 0.005, 0.451),
    PublicSet("MSD", "floor of a building", 4167, 31.73, 0.001, 0.005, 1.16, 0.015, 0.030, 0.002, 0.457),
)
"""The data sets, those that break fewest rules first."""

SIZES: Final[Mapping[str, Mapping[str, tuple[float, float, float, float]]]] = {
    "Swiss Dwellings": {
        "living room": (16.2, 26.7, 42.7, 4.0),
        "kitchen": (4.6, 8.0, 14.2, 2.3),
        "bedroom": (9.9, 14.3, 21.8, 3.2),
        "bathroom": (1.5, 3.8, 6.3, 1.6),
        "balcony": (2.1, 7.3, 21.3, 1.7),
        "hallway": (2.2, 7.5, 17.7, 1.8),
        "storage": (0.5, 2.2, 7.3, 1.2),
    },
    "MagicPlan": {
        "living room": (7.7, 20.1, 52.5, 3.8),
        "kitchen": (3.6, 10.3, 32.7, 2.7),
        "bedroom": (5.9, 12.2, 23.8, 3.0),
        "bathroom": (1.3, 3.9, 10.2, 1.6),
        "balcony": (1.4, 6.1, 32.9, 1.5),
        "hallway": (1.4, 6.1, 34.8, 1.6),
        "storage": (1.6, 9.7, 50.2, 2.5),
    },
}
"""Room area at 5%, 50% and 95% (m2), and the median clear width (m), by data set and type."""


def public_row(name: str, found: AuditSummary) -> PublicSet:
    """Return an audited data set as a row for the table of public data sets."""
    means = {rule: tally.moments()[0] for rule, tally in found.shares.items()}
    pieces = found.pieces.moments()[0]
    return PublicSet(name, "", found.plans, found.mean_rooms, pieces=pieces, any=found.any_share, **means)
