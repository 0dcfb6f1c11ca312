"""A result can be played again: forged values, starts and actions are refused; a mark goes with its bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.benchmark.cases import policy_seed_at_start
from houseexpo.pseudoslam.benchmark.comparison import read_results
from houseexpo.pseudoslam.benchmark.result import Result, decode_actions, encode_actions, read_result, write_result
from houseexpo.pseudoslam.benchmark.run import RunSettings, run_benchmark
from houseexpo.pseudoslam.benchmark.statistics import Estimate
from houseexpo.pseudoslam.benchmark.tables import format_markdown
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.benchmark.verification import is_verified, mark_verified, verify_result
from tests.builders.simulations import hut
from tests.houseexpo.pseudoslam.benchmark.test_benchmark_cases import data_set
from tests.houseexpo.pseudoslam.benchmark.test_comparison import budget_result, written

PLANS = [hut(f"hut_{side}", float(side)) for side in (3, 4)]


@pytest.mark.parametrize("actions", [[], [0, 2, 1, 0], [[0.3, -0.1], [0.0, 1 / 3]], [[12, 7]]])
def test_actions_come_back_as_they_were(actions: list[Any]) -> None:
    assert decode_actions(encode_actions(actions)) == actions


@pytest.mark.parametrize("text", ["", "no base64", encode_actions([1] * 100)[:-8], "eJwDAAAAAAE="])
def test_damaged_actions_are_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="actions: expected those of an episode as `houseexpo benchmark run` writes"):
        decode_actions(text)


def test_the_seed_of_a_policy_depends_on_what_it_sees_alone() -> None:
    map_at_start = np.zeros((4, 5), np.uint8)
    other = map_at_start.copy()
    other[2, 2] = 127
    assert policy_seed_at_start(3, map_at_start) == policy_seed_at_start(3, map_at_start.copy())
    seeds = {policy_seed_at_start(run, known) for run in (0, 1) for known in (map_at_start, other, map_at_start.T)}
    assert len(seeds) == 6


def forge(result: Result, **columns: list[Any]) -> Result:
    return msgspec.structs.replace(result, episodes={**result.episodes, **columns})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("track", "policy"),
    [("budget", "frontier"), ("quality", "random"), ("avoidance", "random"), ("people", "wall"), ("slam", "forward")],
)
def test_runs_are_verified_and_forged_ones_are_not(track: str, policy: str, tmp_path: Path) -> None:
    plans = data_set(tmp_path / "plans", {"test": PLANS})
    result = run_benchmark(find_track(track), policy, plans, RunSettings(number=2, workers=2))
    verify_result(result, plans, 1)
    key = next(key for key in sorted(result.episodes) if key not in {"plan", "seed"})
    better = [value if value is None else value + 0.01 for value in result.column(key)]
    with pytest.raises(ConfigError, match=f"{key}: the result says .*, the replay gives .*; its actions do not give"):
        verify_result(forge(result, **{key: better}), plans, 1)
    summary = {**result.summary, next(iter(result.summary)): Estimate(2.0, 2.0, 2.0, 2)}
    with pytest.raises(ConfigError, match=r"summary of .*: the result says .*mean=2.0.*, the replay gives"):
        verify_result(msgspec.structs.replace(result, summary=summary), plans, 1)
    with pytest.raises(ConfigError, match="its starts are not those of track"):
        verify_result(forge(result, seed=[1, 2]), plans, 1)
    fewer = msgspec.structs.replace(result, actions=[encode_actions([]), *result.actions[1:]])
    with pytest.raises(ConfigError, match="its actions do not give its values, so it is refused"):
        verify_result(fewer, plans, 1)


@pytest.mark.slow
def test_other_plans_and_missing_actions_are_named(tmp_path: Path) -> None:
    plans = data_set(tmp_path / "plans", {"test": PLANS})
    other = data_set(tmp_path / "other", {"test": [hut("hut_3", 3.5), hut("hut_4", 4.0)]})
    result = run_benchmark(find_track("budget"), "forward", plans, RunSettings(number=2))
    with pytest.raises(ConfigError, match="is for other plans than these"):
        verify_result(result, other, 1)
    with pytest.raises(ConfigError, match="name them with --dataset"):
        verify_result(result, None, 1)
    with pytest.raises(ConfigError, match="mine: has no actions, so that it cannot be played again; run the benchmark"):
        verify_result(msgspec.structs.replace(result, actions=msgspec.UNSET), plans, 1, "mine")


@pytest.mark.slow
def test_a_result_that_states_other_settings_or_another_list_is_refused(tmp_path: Path) -> None:
    plans = data_set(tmp_path / "plans", {"test": PLANS, "train": [hut("hut_5", 5.0)]})
    result = run_benchmark(find_track("budget"), "forward", plans, RunSettings(number=2))
    verify_result(result, plans, 1)
    config = result.track["config"]
    for part, said in (("laser", {"range_m": 20.0}), ("robot", {"radius_m": 0.1})):
        other = {**result.track, "config": {**config, part: {**config[part], **said}}}
        with pytest.raises(ConfigError, match="its settings are not those of track exploration-budget-v1"):
            verify_result(msgspec.structs.replace(result, track=other), plans, 1)
    with pytest.raises(ConfigError, match="expected the settings of track exploration-budget-v1, found"):
        verify_result(msgspec.structs.replace(result, track={"id": result.track_id}), plans, 1)
    train = msgspec.structs.replace(result, plans=msgspec.structs.replace(result.plans, split="train"))
    with pytest.raises(ConfigError, match="its plans are not those of the list 'train'"):
        verify_result(train, plans, 1)


def test_a_mark_is_lost_when_the_result_changes(tmp_path: Path) -> None:
    result = budget_result("mine", 0.5)
    (file,) = written(tmp_path, result)
    assert not is_verified(file)
    assert mark_verified(file, result).name == "exploration-budget-v1-mine.verified"
    assert is_verified(file)
    assert read_results([tmp_path])[0].entries[0].verified
    assert "verified |" in format_markdown(read_results([tmp_path]))
    write_result(budget_result("mine", 0.6), file)
    assert not is_verified(file)
    file.with_suffix(".verified").write_text("no mark")
    assert not is_verified(file)


@pytest.mark.parametrize(
    ("key", "value"), [("actions", ["", ""]), ("episodes", {"plan": ["a", "b"], "seed": [1]}), ("episodes", {})]
)
def test_columns_of_several_lengths_are_refused(key: str, value: Any, tmp_path: Path) -> None:
    (file,) = written(tmp_path, budget_result("mine", 0.5))
    file.write_bytes(msgspec.json.encode(msgspec.json.decode(file.read_bytes()) | {key: value}))
    with pytest.raises(ConfigError, match="expected columns of one length, a row for each plan"):
        read_result(file)
