"""Measure a data set for its report, compare it with another data set; return plain values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import permutations
from typing import Any

from houseexpo.dataset.store.stored_plans import BrokenPlan
from stats.audit import PublicSet, public_row
from stats.measure import DataSetSummary
from stats.record import MEASURES
from stats.summary import PlanSummary
from stats.tally import Tally


@dataclass(frozen=True)
class Report:
    """The report on one data set, optionally compared with another one.

    ``broken`` are the plans of the first data set that cannot be read.
    """

    one: DataSetSummary
    other: DataSetSummary | None = None
    broken: tuple[BrokenPlan, ...] = ()

    @property
    def distances(self) -> list[Distance]:
        """The distances between the two data sets; empty without a second data set."""
        return [] if self.other is None else measure_distances(self.one.whole, self.other.whole)

    def values(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        found: dict[str, Any] = _values(self.one)
        if self.broken:
            found["broken"] = [str(broken) for broken in self.broken]
        if self.other is not None:
            found["compared_with"] = _values(self.other)
            found["distances"] = distances_report(self.distances)
        return found


def audited_data_sets(report: Report) -> list[PublicSet]:
    """Return the audited data sets of a report as rows for the table of public data sets."""
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


# Compute how far two data sets differ in each measure: Wasserstein-1, total variation, or difference of shares.


WASSERSTEIN = "Wasserstein-1"
TOTAL_VARIATION = "total variation"
DIFFERENCE = "difference of shares"


@dataclass(frozen=True)
class Distance:
    """One measure of two data sets: a mean or a share of each, and the distance of the two distributions.

    ``kind`` names the distance and ``unit`` its unit. ``deviations`` is a Wasserstein distance divided by the standard
    deviation of the first data set; it is None for other kinds, and if that deviation is 0.
    """

    name: str
    title: str
    kind: str
    value: float
    unit: str = ""
    one: float | None = None
    other: float | None = None
    deviations: float | None = None


def measure_distances(one: PlanSummary, other: PlanSummary) -> list[Distance]:
    """Return the distance in every measure that both data sets have.

    1. Numbers: the Wasserstein-1 distance in the unit of the measure, which is the mean change of a plan's number that
       would make the two distributions equal.
    2. Labels, and kinds of doors: total variation, which is half the sum of the differences of the shares, from 0
       (equal) to 1 (disjoint).
    3. Plans in which a robot of a given radius can reach everything: the difference of the shares.
    """
    return [*_numbers(one, other), *_words(one, other), *_reaches(one, other)]


def wasserstein_distance(one: Tally, other: Tally) -> float:
    """Return the Wasserstein-1 distance of two non-empty tallies, in their unit."""
    from scipy.stats import wasserstein_distance

    (values, counts), (values_, counts_) = one.values(), other.values()
    return float(wasserstein_distance(values, values_, counts, counts_))


def total_variation(one: Mapping[str, int], other: Mapping[str, int]) -> float:
    """Return half the sum of the differences between the shares of two non-empty counts."""
    total, total_ = sum(one.values()), sum(other.values())
    words = sorted({*one, *other})
    return sum(abs(one.get(word, 0) / total - other.get(word, 0) / total_) for word in words) / 2


def distances_report(distances: list[Distance]) -> dict[str, Any]:
    """Return plain values by the measures' names."""
    return {d.name: {key: _round(value) for key, value in asdict(d).items() if key != "name"} for d in distances}


def _numbers(one: PlanSummary, other: PlanSummary) -> Iterator[Distance]:
    for measure in MEASURES:
        here, there = one.tallies[measure.key], other.tallies[measure.key]
        if here.count and there.count:
            value, (mean, std), (mean_, _) = wasserstein_distance(here, there), here.moments(), there.moments()
            relative = value / std if std else None
            yield Distance(measure.key, measure.title, WASSERSTEIN, value, measure.unit, mean, mean_, relative)


def _words(one: PlanSummary, other: PlanSummary) -> Iterator[Distance]:
    for name, title in (("labels", "Labels"), ("door_kinds", "Kinds of doors")):
        here, there = getattr(one, name), getattr(other, name)
        if here and there:
            yield Distance(name, title, TOTAL_VARIATION, total_variation(here, there))


def _reaches(one: PlanSummary, other: PlanSummary) -> Iterator[Distance]:
    for radius in sorted(one.reach.keys() & other.reach.keys()):
        share, share_ = one.reach[radius].connected_share, other.reach[radius].connected_share
        title = f"Connected for a robot of {radius} m"
        yield Distance(f"connected_{radius}", title, DIFFERENCE, abs(share - share_), "", share, share_)


def _round(value: Any) -> Any:
    return round(value, 6) if isinstance(value, float) else value
