"""Measure a data set for its report, beside another, public ones, or a list of unusable plans; give plain values."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from typing import Any

from houseexpo.dataset.store.stored_plans import BrokenPlan
from stats import compare
from stats.bad_plans import ListComparison
from stats.measure import DataSetSummary
from stats.public_sets import PublicSet, public_row


@dataclass(frozen=True)
class Report:
    """The report on one data set, optionally compared with another one and with a list of unusable plans.

    ``broken`` are the plans of the first data set that cannot be read.
    """

    one: DataSetSummary
    other: DataSetSummary | None = None
    verdict: ListComparison | None = None
    broken: tuple[BrokenPlan, ...] = ()

    @property
    def distances(self) -> list[compare.Distance]:
        """Distances between the two data sets, none if there is only one."""
        return [] if self.other is None else compare.measure_distances(self.one.whole, self.other.whole)

    def values(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        found: dict[str, Any] = _values(self.one)
        if self.broken:
            found["broken"] = [str(broken) for broken in self.broken]
        if self.other is not None:
            found["compared_with"] = _values(self.other)
            found["distances"] = compare.distances_report(self.distances)
        if self.verdict is not None:
            found["list"] = self.verdict.report()
        return found


def audited_data_sets(report: Report) -> list[PublicSet]:
    """Return the audited data sets of a report as rows beside the public ones."""
    sets = (report.one, report.other)
    return [public_row(each.name, each.whole.audit) for each in sets if each is not None and each.whole.audit.plans]


def count_leaks(gathered: DataSetSummary) -> dict[str, dict[str, int]]:
    """Return for each split how many of its plans also occur in each other split, possibly rotated or mirrored."""
    found: dict[str, dict[str, int]] = {}
    for name, other in permutations(sorted(gathered.splits), 2):
        found.setdefault(name, {})[other] = gathered.splits[name].rings.count_shared(gathered.splits[other].rings)
    return found


def _values(gathered: DataSetSummary) -> dict[str, Any]:
    repeated = count_leaks(gathered)
    return {
        "data_set": gathered.name,
        "rooms_and_doors_found": gathered.geometry,
        "plans": gathered.whole.report(),
        "splits": {
            name: {
                "listed": gathered.listed.get(name, summary.plans),
                "also_in": repeated.get(name, {}),
                **summary.report(),
            }
            for name, summary in sorted(gathered.splits.items())
        },
    }
