"""Compute how far two data sets differ in each measure: Wasserstein-1, total variation, or difference of shares."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from stats.record import MEASURES
from stats.summary import PlanSummary
from stats.tally import Tally

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
