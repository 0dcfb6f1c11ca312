"""The result of a policy on a track: write it, read it and compare it.

Everything but ``times`` is independent of the number of processes.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo.errors import ConfigError
from houseexpo.files import write_whole
from houseexpo.pseudoslam.benchmark.episodes import Outcome, places
from houseexpo.pseudoslam.benchmark.statistics import Estimate, estimate, means
from houseexpo.pseudoslam.benchmark.tracks import Track

FORMAT: Final = "houseexpo benchmark 1"
Column = list[float | None]


class PolicyRecord(msgspec.Struct, frozen=True):
    """The policy: its name, its origin, the hash of that file, its seed, and whether it sees the truth.

    A trained policy also has its family and the seed of its training; results of one family are one row of a table.
    """

    name: str
    source: str
    sha256: str
    seed: int
    sees_truth: bool
    actions: str
    observation: str
    family: str = ""
    training_seed: int | None = None


class PlansRecord(msgspec.Struct, frozen=True):
    """The plans: the list from which they were chosen, their number, and hashes of their ids and of their contents."""

    split: str
    number: int
    ids_sha256: str
    content_sha256: str


class Curve(msgspec.Struct, frozen=True):
    """The mean coverage over plans and its interval, over steps or metres."""

    at: list[float]
    mean: list[float]
    low: list[float]
    high: list[float]


class Times(msgspec.Struct, frozen=True):
    """The times of a run, which differ between runs: of decisions, ms, and of the whole, s; and the machine."""

    decision_ms: dict[str, float]
    wall_s: float
    workers: int
    machine: dict[str, str | int | float]


class Result(msgspec.Struct, frozen=True):
    """The output of ``houseexpo benchmark run``; ``episodes`` has a column for each value, in the plans' order."""

    format: str
    track: dict[str, Any]
    policy: PolicyRecord
    plans: PlansRecord
    versions: dict[str, str]
    summary: dict[str, Estimate]
    curves: dict[str, Curve]
    episodes: dict[str, Any]
    times: Times

    @property
    def track_id(self) -> str:
        """The track's id."""
        return str(self.track["id"])

    def column(self, key: str) -> Column:
        """Return a column: the values of all episodes."""
        return list(self.episodes[key])


def summary_of(track: Track, outcomes: Sequence[Outcome]) -> dict[str, Estimate]:
    """Return the mean of each metric over plans, with its interval."""
    return {metric.key: estimate([each.values[metric.key] for each in outcomes]) for metric in track.metrics}


def curves_of(track: Track, outcomes: Sequence[Outcome]) -> dict[str, Curve]:
    """Return the mean curves."""
    found = {}
    for over, most in track.curves:
        mean, low, high = means(_matrix([each.curves[over] for each in outcomes]))
        found[over] = Curve(places(most).tolist(), mean.tolist(), low.tolist(), high.tolist())
    return found


def episodes_of(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return the columns of all episodes: the plan, the start's seed, and each value."""
    columns: dict[str, Any] = {
        "plan": [each.case.plan_id for each in outcomes],
        "seed": [each.case.seed for each in outcomes],
    }
    for key in sorted(outcomes[0].values):
        columns[key] = [each.values[key] for each in outcomes]
    return columns


def encoded(result: Result) -> bytes:
    """Return a result as JSON, with each key and each list on one line."""
    return ("\n".join(_lines(msgspec.to_builtins(result))) + "\n").encode()


def write_result(result: Result, file: Path) -> None:
    """Write a result atomically."""
    write_whole(file, encoded(result))


def read_result(file: Path) -> Result:
    """Read a result; raise ConfigError if the file is not a complete result."""
    try:
        found = msgspec.json.decode(file.read_bytes(), type=Result)
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read ({error.strerror}); check the path") from None
    except msgspec.DecodeError as error:
        raise ConfigError(f"{file}: expected a result of `houseexpo benchmark run`, found {error}") from None
    if found.format != FORMAT:
        raise ConfigError(f"{file}: expected {FORMAT!r}, found {found.format!r}; run the benchmark again")
    return found


def _matrix(rows: Sequence[Sequence[float]]) -> Any:
    import numpy as np

    return np.array(rows, np.float64)


def _lines(value: dict[str, Any], indent: str = "  ") -> list[str]:
    lines = ["{"]
    for number, (key, part) in enumerate(value.items(), start=1):
        inner = _lines(part, indent + "  ") if isinstance(part, dict) and part else [json.dumps(part)]
        inner[0] = f"{indent}{json.dumps(key)}: {inner[0]}"
        inner[-1] += "," if number < len(value) else ""
        lines += inner
    return [*lines, f"{indent[2:]}}}"]
