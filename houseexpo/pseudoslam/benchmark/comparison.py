"""Results side by side: those of one track, on the same plans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.benchmark.measures import Metric
from houseexpo.pseudoslam.benchmark.result import Result, read_result
from houseexpo.pseudoslam.benchmark.statistics import Estimate, estimate
from houseexpo.pseudoslam.benchmark.tracks import TRACKS, Track, track_of

ORACLE: Final = "oracle"
"""The policy whose ways others are measured by."""


@dataclass(frozen=True)
class Compared:
    """The results of a track, the best first."""

    track: Track
    results: tuple[Result, ...]

    def tables(self) -> list[tuple[Metric, ...]]:
        """Return the metrics of each table."""
        found: dict[str, list[Metric]] = {}
        for metric in self.track.metrics:
            if metric.table is not None:
                found.setdefault(metric.table, []).append(metric)
        tables = [tuple(metrics) for metrics in found.values()]
        return [tables[0] + self._shares(), *tables[1:]]

    def value(self, result: Result, metric: Metric) -> Estimate:
        """Return a metric of a result."""
        if metric.key in result.summary:
            return result.summary[metric.key]
        return self._share(result, metric.key.removeprefix("share_of_"))

    def _shares(self) -> tuple[Metric, ...]:
        """Return the shares of the oracle's way, where there is an oracle's result."""
        if self._oracle is None:
            return ()
        keys = [metric.key for metric in self.track.metrics if metric.key.startswith("metres_to_")]
        return tuple(
            Metric(f"share_of_{key}", f"share of the oracle's way, {key.removeprefix('metres_to_')}%", "%", "high")
            for key in keys
        )

    def _share(self, result: Result, key: str) -> Estimate:
        """Return the oracle's metres as a share of a policy's, at most 1, over plans: 0 where the policy got nowhere.

        Plans in which the oracle did not get so far are left out.
        """
        best = [] if self._oracle is None else self._oracle.column(key)
        shares = [
            None if one is None else 0.0 if other is None else one / max(other, one, 1e-9)
            for one, other in zip(best, result.column(key), strict=True)
        ]
        return estimate(shares)

    @property
    def _oracle(self) -> Result | None:
        return next((result for result in self.results if result.policy.name == ORACLE), None)


def read_results(files: Sequence[Path]) -> list[Compared]:
    """Read results, and put those of one track together, in the tracks' order; those of a folder: all in it.

    Raises
    ------
    ConfigError
        A file is no result, or results of one track are of different plans.
    """
    named = [inner for file in files for inner in (sorted(file.glob("*.json")) if file.is_dir() else [file])]
    if not named:
        raise ConfigError(f"{', '.join(map(str, files))}: expected results of `houseexpo benchmark run`, found none")
    by_track: dict[str, list[tuple[Path, Result]]] = {}
    for file in named:
        result = read_result(file)
        by_track.setdefault(_known(result, file), []).append((file, result))
    return [_compared(track, by_track[track.id]) for track in TRACKS if track.id in by_track]


def _known(result: Result, file: Path) -> str:
    try:
        return track_of(result.track_id).id
    except ConfigError:
        known = ", ".join(track.id for track in TRACKS)
        raise ConfigError(f"{file}: a result of track {result.track_id!r}; this version knows {known}") from None


def _compared(track: Track, named: Sequence[tuple[Path, Result]]) -> Compared:
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
    metric = track.metrics[0]
    sign = -1.0 if metric.better == "high" else 1.0

    def rank(result: Result) -> tuple[Any, ...]:
        mean = result.summary[metric.key].mean
        return (mean is None, 0.0 if mean is None else sign * mean, result.policy.name, result.policy.seed)

    return Compared(track, tuple(sorted((result for _, result in named), key=rank)))
