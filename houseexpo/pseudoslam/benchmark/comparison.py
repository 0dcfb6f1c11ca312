"""Read result files, group them by track, and compute the rows of tables: means, intervals, tests against the baseline.

R1  Results of one family with different training seeds form one row: means over seeds and plans.
R2  Policies are compared with the baseline, if there is one, plan by plan. This is more informative than overlapping
    intervals, since plans differ more than policies.
R3  The p-value of this difference is corrected for the number of rows that are compared with the baseline (Holm). With
    several trainings, the means over their seeds are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.benchmark.measures import Metric
from houseexpo.pseudoslam.benchmark.prediction import TABLE, prediction_metrics
from houseexpo.pseudoslam.benchmark.result import Column, MeanCurve, Result, read_result
from houseexpo.pseudoslam.benchmark.statistics import (
    Estimate,
    estimate_mean_over_seeds,
    holm_correction,
    paired_p_value,
)
from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, TRACKS, Track, find_track
from houseexpo.pseudoslam.benchmark.verification import is_verified
from houseexpo.words import count_noun

ORACLE: Final = "oracle"
"""The policy whose path lengths are the reference."""
BOUND: Final = "bound"
"""The name of lower bounds of path lengths, a reference that is stored like a result (``research.way_bounds``)."""
BASELINE: Final = "frontier"
"""The policy that others are compared with (R2)."""
_REFERENCES: Final = {BOUND: "bound as a share of the way", ORACLE: "share of the oracle's way"}
_LESS, _SHARE, _P = "less_", "share_of_", "p_"


@dataclass(frozen=True)
class ComparisonRow:
    """A row: one result, or the results of one family in the order of their seeds (R1)."""

    results: tuple[Result, ...]
    verified: bool = False
    """Whether replaying the actions of all results gave the same values (``verification``)."""

    @property
    def name(self) -> str:
        """The name of the row."""
        policy = self.results[0].policy
        if len(self.results) > 1:
            return f"{policy.family} ({count_noun(len(self.results), 'training')}){self._predicts}"
        seed = f", seed {policy.seed}" if policy.seed else ""
        return f"{policy.name}{seed}{self._predicts}"

    @property
    def prediction(self) -> str:
        """The name of the scored predicted map, "" if no map was scored."""
        return self.results[0].policy.prediction or ""

    @property
    def key(self) -> tuple[str, str, int]:
        """A key that is equal for rows whose policies differ only in the prediction."""
        policy = self.results[0].policy
        return (policy.name, policy.source, policy.seed)

    @property
    def _predicts(self) -> str:
        return f", prediction {self.prediction}" if self.prediction else ""

    @property
    def sees_truth(self) -> bool:
        """Whether the policies are given the world."""
        return self.results[0].policy.sees_truth

    @property
    def decision_ms(self) -> float | None:
        """The median time of a decision, as the mean over seeds; None if there were no decisions."""
        medians = [one.times.decision_ms.get("median") for one in self.results]
        known = [median for median in medians if median is not None]
        return sum(known) / len(known) if known else None

    def columns(self, key: str) -> list[Column]:
        """Return the values of all episodes, for each seed."""
        return [one.column(key) for one in self.results]

    def has_curve(self, over: str) -> bool:
        """Whether the results have curves over steps or metres; those of earlier versions may lack them."""
        return all(over in one.curves for one in self.results)

    def curve(self, over: str) -> MeanCurve:
        """Return the mean of the seeds' curves; its band covers the bands of all seeds."""
        parts = [one.curves[over] for one in self.results]
        if len(parts) == 1:
            return parts[0]
        means = [sum(values) / len(values) for values in zip(*(part.mean for part in parts), strict=True)]
        low = [min(values) for values in zip(*(part.low for part in parts), strict=True)]
        high = [max(values) for values in zip(*(part.high for part in parts), strict=True)]
        return MeanCurve(parts[0].at, means, low, high)


@dataclass(frozen=True)
class Interval:
    """The interval that contains the mean of the best possible values of a metric.

    Parameters
    ----------
    bound
        The mean of the values that no policy can beat.
    known
        The mean of the best value of any row on each plan.
    plans
        The number of plans that have both.
    """

    metric: Metric
    bound: float
    known: float
    plans: int


@dataclass(frozen=True)
class TrackComparison:
    """The results of a track, the best first."""

    track: Track
    entries: tuple[ComparisonRow, ...]

    def tables(self) -> list[tuple[Metric, ...]]:
        """The metrics of each table."""
        found: dict[str, list[Metric]] = {}
        for metric in self.track.metrics:
            if metric.table is not None:
                found.setdefault(metric.table, []).append(metric)
                if metric.paired and self._entry_named(BASELINE) and len(self.plain) > 1:
                    less = Metric(_LESS + metric.key, f"less {BASELINE}'s", metric.unit, metric.better)
                    found[metric.table] += [less, Metric(_P + metric.key, "p, Holm", "p", "low")]
        tables = [tuple(metrics) for metrics in found.values()]
        if any(entry.prediction for entry in self.entries):
            tables.append(prediction_metrics(self.track.budgets_m))
        return [tables[0] + self._shares(), *tables[1:]]

    @cached_property
    def plain(self) -> tuple[ComparisonRow, ...]:
        """The rows of all tables except that of predictions, and the lines of curves: all runs without a prediction.

        A policy whose runs all have a prediction is shown by the best of them.
        """
        shown = {entry.key for entry in self.entries if not entry.prediction}
        rows: list[ComparisonRow] = []
        for entry in self.entries:
            if not entry.prediction or entry.key not in shown:
                shown.add(entry.key)
                rows.append(entry)
        return tuple(rows)

    def rows(self, metrics: Sequence[Metric]) -> tuple[ComparisonRow, ...]:
        """Return the rows of a table, the best first."""
        if metrics and metrics[0].table == TABLE:
            return tuple(entry for entry in self.entries if entry.prediction)
        return self.plain

    def value(self, entry: ComparisonRow, metric: Metric) -> Estimate:
        """Return the estimate of a metric for a row."""
        if metric.key.startswith(_LESS):
            return self._difference(entry, metric.key.removeprefix(_LESS))
        if metric.key.startswith(_P):
            return self._p(entry, metric.key.removeprefix(_P))
        if metric.key.startswith(_SHARE):
            return self._share(entry, metric.key.removeprefix(_SHARE))
        if any(metric.key not in each.summary for each in entry.results):  # no prediction, or a newer score
            return Estimate(None, None, None, 0)
        if len(entry.results) == 1:
            return entry.results[0].summary[metric.key]
        return estimate_mean_over_seeds(entry.columns(metric.key))

    def intervals(self) -> list[Interval]:
        """Return the intervals of the best possible values; an empty list without a result of bounds."""
        bound = self._entry_named(BOUND)
        if bound is None:
            return []
        others = [entry for entry in self.plain if entry is not bound]
        found = []
        for metric in self.track.metrics:
            column = bound.results[0].column(metric.key)
            choose = min if metric.better == "low" else max
            rows = zip(*(values for entry in others for values in entry.columns(metric.key)), strict=True)
            best = [choose((value for value in row if value is not None), default=None) for row in rows]
            pairs = [
                (one, other) for one, other in zip(column, best, strict=False) if one is not None and other is not None
            ]
            if pairs and metric.table is not None:
                bounds, known = (sum(values) / len(pairs) for values in zip(*pairs, strict=True))
                found.append(Interval(metric, bounds, known, len(pairs)))
        return found

    def _shares(self) -> tuple[Metric, ...]:
        """Return the metrics relative to the bound and to the oracle's path, if they have results."""
        keys = [metric.key for metric in self.track.metrics if metric.key.startswith("metres_to_")]
        return tuple(
            Metric(f"{_SHARE}{name}_{key}", f"{title}, {key.removeprefix('metres_to_')}%", "%", "high")
            for name, title in _REFERENCES.items()
            for key in keys
            if self._entry_named(name) is not None
        )

    def _share(self, entry: ComparisonRow, key: str) -> Estimate:
        """Return a reference's metres as a share of a policy's, at most 1; 0 on plans where the policy did not arrive.

        Plans in which the reference did not arrive are left out. ``key`` is the name of the reference followed by the
        name of the metric.
        """
        name, _, key = key.partition("_")
        reference = self._entry_named(name)
        best = [] if reference is None else reference.results[0].column(key)
        return estimate_mean_over_seeds(
            [
                [
                    None if one is None else 0.0 if other is None else 1.0 if other <= one else one / other
                    for one, other in zip(best, column, strict=True)
                ]
                for column in entry.columns(key)
            ]
        )

    def _difference(self, entry: ComparisonRow, key: str) -> Estimate:
        """Return a value minus the baseline's, over plans that have both (R2); empty for the baseline itself."""
        return (
            estimate_mean_over_seeds(found)
            if (found := self._differences(entry, key))
            else Estimate(None, None, None, 0)
        )

    def _p(self, entry: ComparisonRow, key: str) -> Estimate:
        """Return the corrected p-value of the difference from the baseline (R3); empty for the baseline itself."""
        rows = self._p_values[key]
        if (p := rows.get(id(entry))) is None:
            return Estimate(None, None, None, 0)
        return Estimate(p, p, p, len(rows))

    @cached_property
    def _p_values(self) -> dict[str, dict[int, float]]:
        """The corrected p-values of the rows, by their ``id``, for each metric that is compared plan by plan (R3)."""
        found = {}
        for metric in self.track.metrics:
            if metric.paired:
                raw: dict[int, float] = {}
                for entry in self.plain:
                    over_seeds = [
                        None if None in values else sum(value for value in values if value is not None) / len(values)
                        for values in zip(*self._differences(entry, metric.key), strict=True)
                    ]
                    if (p := paired_p_value(over_seeds)) is not None:
                        raw[id(entry)] = p
                found[metric.key] = dict(zip(raw, holm_correction(list(raw.values())), strict=True))
        return found

    def _differences(self, entry: ComparisonRow, key: str) -> list[Column]:
        """Return a row's values minus the baseline's, for each seed; empty for the baseline itself."""
        baseline = self._entry_named(BASELINE)
        if baseline is None or entry is baseline or entry.results[0].policy.name == BOUND:
            return []
        base = baseline.results[0].column(key)
        return [
            [None if one is None or other is None else one - other for one, other in zip(column, base, strict=True)]
            for column in entry.columns(key)
        ]

    def _entry_named(self, name: str) -> ComparisonRow | None:
        return next((entry for entry in self.plain if entry.results[0].policy.name == name), None)


def read_results(files: Sequence[Path]) -> list[TrackComparison]:
    """Read results from files and folders and group them by track, in the order of the tracks.

    Raises
    ------
    ConfigError
        A file is not a result, or results of one track are for different plans.
    """
    named = [inner for file in files for inner in (sorted(file.glob("*.json")) if file.is_dir() else [file])]
    if not named:
        raise ConfigError(f"{', '.join(map(str, files))}: expected results of `houseexpo benchmark run`, found none")
    by_track: dict[str, list[tuple[Path, Result]]] = {}
    for file in named:
        result = read_result(file)
        by_track.setdefault(_known_track(result, file), []).append((file, result))
    return [_compare_track(track, by_track[track.id]) for track in (*TRACKS, *MAP_TRACKS) if track.id in by_track]


def _known_track(result: Result, file: Path) -> str:
    try:
        return find_track(result.track_id).id
    except ConfigError:
        known = ", ".join(track.id for track in (*TRACKS, *MAP_TRACKS))
        raise ConfigError(f"{file}: a result of track {result.track_id!r}; this version knows {known}") from None


def _compare_track(track: Track, named: Sequence[tuple[Path, Result]]) -> TrackComparison:
    first_file, first = named[0]
    for file, result in named[1:]:
        for what, one, other in (
            ("plans", first.plans, result.plans),
            ("starts", first.episodes["seed"], result.episodes["seed"]),
        ):
            if one != other:
                raise ConfigError(
                    f"{file}: expected the {what} of {first_file}, found others; {track.id} is compared on the same "
                    "plans: run both with the same --split and --plans, on the same data set"
                )
    verified = {id(result) for file, result in named if is_verified(file)}
    unordered = TrackComparison(
        track,
        tuple(
            ComparisonRow(group, all(id(result) in verified for result in group))
            for group in _group_by_family([result for _, result in named])
        ),
    )
    metric = track.metrics[0]
    sign = -1.0 if metric.better == "high" else 1.0

    def rank(entry: ComparisonRow) -> tuple[Any, ...]:
        mean = unordered.value(entry, metric).mean
        policy = entry.results[0].policy
        return (mean is None, 0.0 if mean is None else sign * mean, policy.name, policy.seed)

    return TrackComparison(track, tuple(sorted(unordered.entries, key=rank)))


def _group_by_family(results: Sequence[Result]) -> list[tuple[Result, ...]]:
    """Return results grouped by family (R1), one for each training seed; other results are alone in a group."""
    groups: dict[tuple[Any, ...], list[Result]] = {}
    for number, result in enumerate(results):
        policy = result.policy
        family = (policy.family, policy.prediction or "")
        seeds = {other.policy.training_seed for other in groups.get(family, ())}
        is_one_more = policy.family and policy.training_seed not in seeds
        groups.setdefault(family if is_one_more else ("", number), []).append(result)
    return [tuple(sorted(group, key=lambda one: one.policy.training_seed or 0)) for group in groups.values()]
