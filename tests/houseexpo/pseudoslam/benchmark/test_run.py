"""Runs in processes: the same bytes however many there are, and nothing where a policy fails."""

from __future__ import annotations

import json
import multiprocessing
from pathlib import Path
from typing import Any

import msgspec
import pytest

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, PolicyError
from houseexpo.pseudoslam.benchmark.result import Result, encode_result, read_result, write_result
from houseexpo.pseudoslam.benchmark.run import RunSettings, run_benchmark
from houseexpo.pseudoslam.benchmark.tracks import TRACKS, find_track
from tests.builders.simulations import flat, hut
from tests.houseexpo.pseudoslam.benchmark.test_benchmark_cases import data_set
from tests.houseexpo.pseudoslam.benchmark.test_comparison import budget_result

AVOIDANCE = find_track("avoidance")
MINE = "tests.builders.policies"


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    huts = [hut(f"hut_{side}", float(side)) for side in (3, 4, 5)]
    return data_set(tmp_path_factory.mktemp("run") / "plans", {"test": huts})


def without_times(result: Result) -> bytes:
    said = json.loads(encode_result(result))
    del said["times"]
    return json.dumps(said).encode()


@pytest.mark.slow
def test_processes_make_no_difference() -> None:
    one, two = (run_benchmark(AVOIDANCE, "forward", None, RunSettings(number=3, workers=workers)) for workers in (1, 2))
    assert without_times(one) == without_times(two)
    assert (one.times.workers, two.times.workers) == (1, 2)
    assert one.plans.number == 3
    assert len(set(one.column("return"))) == 3


@pytest.mark.slow
def test_another_seed_is_another_policy_on_the_same_starts() -> None:
    one, other = (run_benchmark(AVOIDANCE, "random", None, RunSettings(number=2, seed=seed)) for seed in (0, 1))
    assert one.column("seed") == other.column("seed")
    assert one.column("return") != other.column("return")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("dies", r"policy 'tests.builders.policies:dies': plan 'room-5.5x3.2', step 3: its process died, exit code 7"),
        ("sleeps", r"plan 'room-5.5x3.2', step 2: expected an answer within 3 s, found none; --decision-limit"),
        ("raises", r"plan 'room-5.5x3.2', step 1: it raised KeyError: 'no such key'"),
        ("not_a_number", r"plan 'room-5.5x3.2', step 4: action: expected 0 .* or 2 \(right\), found .*nan"),
    ],
)
def test_a_policy_that_fails_ends_the_run(name: str, said: str) -> None:
    with pytest.raises(PolicyError, match=said):
        run_benchmark(AVOIDANCE, f"{MINE}:{name}", None, RunSettings(number=2, decision_limit_s=3.0))
    assert not multiprocessing.active_children()


@pytest.mark.slow
def test_compiling_is_no_time_of_the_policy() -> None:
    result = run_benchmark(AVOIDANCE, f"{MINE}:compiles", None, RunSettings(number=1, decision_limit_s=3.0))
    assert len(result.column("seed")) == 1


@pytest.mark.slow
@pytest.mark.parametrize("track", TRACKS, ids=lambda track: track.id)
def test_every_track_runs_and_is_read_back(track: Any, plans: Dataset, tmp_path: Path) -> None:
    if track.config.goal_region:
        plans = data_set(tmp_path / "plans", {"test": [flat("one"), hut("two", 4.0)]})
    result = run_benchmark(track, "random", plans, RunSettings(number=2))
    write_result(result, tmp_path / "result.json")
    assert read_result(tmp_path / "result.json") == result
    assert set(result.summary) == {metric.key for metric in track.metrics}
    assert all(estimate.number <= 2 for estimate in result.summary.values())
    assert set(result.curves) == {over for over, _ in track.curves}


def test_what_cannot_be_is_refused(plans: Dataset) -> None:
    with pytest.raises(ConfigError, match="policy 'greedy': made for navigation; track exploration-budget-v1 is"):
        run_benchmark(find_track("budget"), "greedy", plans, RunSettings(number=1))
    with pytest.raises(ConfigError, match="track exploration-quality-v1: expected a data set"):
        run_benchmark(find_track("quality"), "random", None, RunSettings(number=1))
    with pytest.raises(ConfigError, match="--track: expected one of budget, quality"):
        find_track("speed")


def test_a_result_that_was_cut_off_is_refused(tmp_path: Path) -> None:
    whole = encode_result(budget_result("mine", 0.5))
    file = tmp_path / "result.json"
    file.write_bytes(whole[:-100])
    with pytest.raises(ConfigError, match=r"result.json: expected a result of `houseexpo benchmark run`, found"):
        read_result(file)
    said = msgspec.json.decode(whole)
    file.write_bytes(msgspec.json.encode({**said, "format": "houseexpo benchmark 0"}))
    with pytest.raises(ConfigError, match="found 'houseexpo benchmark 0'; run the benchmark again"):
        read_result(file)
    with pytest.raises(ConfigError, match=r"none.json: cannot be read \(No such file"):
        read_result(tmp_path / "none.json")
