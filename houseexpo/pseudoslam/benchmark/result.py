"""Compute the result of a policy on a track from its episodes' outcomes; write it as JSON, read it back and check it.

Everything but ``times`` is independent of the number of processes.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo.errors import ConfigError
from houseexpo.files import decode_json, read_json, write_atomically
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, curve_sample_points
from houseexpo.pseudoslam.benchmark.prediction import TABLE, prediction_metrics
from houseexpo.pseudoslam.benchmark.statistics import Estimate, estimate_column_means, estimate_mean
from houseexpo.pseudoslam.benchmark.tracks import Track

FORMAT: Final = "houseexpo benchmark 1"
CURVE_DIGITS: Final = 4
_LONGEST_ACTIONS: Final = 1 << 24  # bytes of JSON; 10,000 actions of two numbers have 0.4 MB
Column = list[float | None]


class PolicyRecord(msgspec.Struct, frozen=True):
    """The policy: its name, its origin, the hash of that file, its seed, and whether it sees the truth.

    A trained policy also has its family and the seed of its training; results of one family are one row of a table.
    With ``--prediction``, ``prediction`` names the predicted map that was scored.
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
    prediction: str | msgspec.UnsetType = msgspec.UNSET


class PlansRecord(msgspec.Struct, frozen=True):
    """The plans: the list from which they were chosen, their number, and hashes of their ids and of their contents."""

    split: str
    number: int
    ids_sha256: str
    content_sha256: str


class MeanCurve(msgspec.Struct, frozen=True):
    """The mean coverage over plans and its interval, over steps or metres."""

    at: list[float]
    mean: list[float]
    low: list[float]
    high: list[float]


class RunTimes(msgspec.Struct, frozen=True):
    """The times of a run, which differ between runs: of decisions, ms, and of the whole, s; and the machine."""

    decision_ms: dict[str, float]
    wall_s: float
    workers: int
    machine: dict[str, str | int | float]


class Result(msgspec.Struct, frozen=True):
    """The output of ``houseexpo benchmark run``; ``episodes`` has a column for each value, in the plans' order.

    On tracks of maps, ``map_curves`` has the coverage of each episode at the places of ``curves``. ``actions`` has the
    actions of each episode (``encode_actions``), which ``benchmark verify`` plays again; results of 0.2.0 have none.
    """

    format: str
    track: dict[str, Any]
    policy: PolicyRecord
    plans: PlansRecord
    versions: dict[str, str]
    summary: dict[str, Estimate]
    curves: dict[str, MeanCurve]
    episodes: dict[str, list[Any]]
    times: RunTimes
    map_curves: dict[str, list[list[float]]] | msgspec.UnsetType = msgspec.UNSET
    actions: list[str] | msgspec.UnsetType = msgspec.UNSET

    @property
    def track_id(self) -> str:
        """The track's id."""
        return str(self.track["id"])

    def column(self, key: str) -> Column:
        """Return a column: the values of all episodes."""
        return list(self.episodes[key])


def compute_summary(track: Track, outcomes: Sequence[EpisodeOutcome]) -> dict[str, Estimate]:
    """Return the mean of each metric over plans, with its interval."""
    metrics = [*track.metrics, *prediction_metrics(track.budgets_m)]
    return {
        metric.key: estimate_mean([each.values[metric.key] for each in outcomes])
        for metric in metrics
        if metric.table != TABLE or metric.key in outcomes[0].values
    }


def compute_mean_curves(track: Track, outcomes: Sequence[EpisodeOutcome]) -> dict[str, MeanCurve]:
    """Return the mean curves."""
    found = {}
    for over, most in track.curves:
        mean, low, high = estimate_column_means(_matrix([each.curves[over] for each in outcomes]))
        found[over] = MeanCurve(curve_sample_points(most).tolist(), mean.tolist(), low.tolist(), high.tolist())
    return found


def round_episode_curves(track: Track, outcomes: Sequence[EpisodeOutcome]) -> dict[str, list[list[float]]]:
    """Return the curves of each episode, rounded."""
    return {
        over: [[round(value, CURVE_DIGITS) for value in each.curves[over]] for each in outcomes]
        for over, _ in track.curves
    }


def make_episode_columns(outcomes: Sequence[EpisodeOutcome]) -> dict[str, Any]:
    """Return the columns of all episodes: the plan, the start's seed, and each value."""
    columns: dict[str, Any] = {
        "plan": [each.case.plan_id for each in outcomes],
        "seed": [each.case.seed for each in outcomes],
    }
    for key in sorted(outcomes[0].values):
        columns[key] = [each.values[key] for each in outcomes]
    return columns


def encode_actions(actions: Sequence[Any]) -> str:
    """Return the actions of an episode, numbers and lists of numbers, as base64 of deflated JSON."""
    return base64.b64encode(zlib.compress(msgspec.json.encode(actions), 9)).decode()


def decode_actions(text: str) -> list[Any]:
    """Return the actions of an episode; raise ConfigError if the text is not from ``encode_actions``."""
    try:
        unpacked = zlib.decompressobj()
        data = unpacked.decompress(base64.b64decode(text, validate=True), _LONGEST_ACTIONS)
        return decode_json(data if unpacked.eof else b"", list[Any])
    except (ValueError, zlib.error, msgspec.DecodeError) as error:
        raise ConfigError(
            f"actions: expected those of an episode as `houseexpo benchmark run` writes them ({error})"
        ) from None


def encode_result(result: Result) -> bytes:
    """Return a result as JSON, with each key and each list on one line."""
    return ("\n".join(_lines(msgspec.to_builtins(result))) + "\n").encode()


def write_result(result: Result, file: Path) -> None:
    """Write a result atomically."""
    write_atomically(file, encode_result(result))


def read_result(file: Path) -> Result:
    """Read a result; raise ConfigError if the file is not a complete one. ``verify_result`` says whether it is true."""
    try:
        found = read_json(file, Result)
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read ({error.strerror}); check the path") from None
    except msgspec.DecodeError as error:
        raise ConfigError(f"{file}: expected a result of `houseexpo benchmark run`, found {error}") from None
    if found.format != FORMAT:
        raise ConfigError(f"{file}: expected {FORMAT!r}, found {found.format!r}; run the benchmark again")
    columns = [*found.episodes.values(), *([] if found.actions is msgspec.UNSET else [found.actions])]
    if not found.episodes.get("plan") or len({len(column) for column in columns}) != 1:
        raise ConfigError(f"{file}: expected columns of one length, a row for each plan; run the benchmark again")
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
