"""The policies of ``experiments`` still score what is written down beside them."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from houseexpo.configuration import read_config
from houseexpo.pseudoslam.learning.config import TrainConfig
from tests.builders.shared import needs_shared
from tests.builders.trained_policies import EXPERIMENTS, HERE, SEEDS, folder_of, score, task_of


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_weights_come_with_what_made_them(experiment: str, seed: int) -> None:
    folder = folder_of(experiment, seed)
    assert (folder / "policy.pt").stat().st_size < 5_000_000
    about = json.loads((folder / "policy.json").read_bytes())
    assert (about["task"], about["seed"]) == (task_of(experiment), seed)
    assert len(about["commit"]) == 40  # a "+" behind it would say that the tree had been changed
    last = (folder / "evaluation.csv").read_text().splitlines()[-1]
    assert int(last.partition(",")[0]) == about["steps"] >= about["config"]["steps"]


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_a_training_of_today_goes_on_with_them_and_is_a_row_with_them(experiment: str) -> None:
    """Checkpoints and rows of tables ask whether the records of two trainings are the same."""
    told = json.loads((folder_of(experiment, 0) / "policy.json").read_bytes())["config"]
    config = read_config(TrainConfig, HERE / f"{experiment}.toml")
    dataset = told["environment"]["dataset"]
    assert replace(config, environment=replace(config.environment, dataset=dataset)).record() == told


@pytest.mark.slow
@pytest.mark.usefixtures("learn")
def test_trainings_that_differ_by_their_seed_are_one_row_of_a_table() -> None:
    from houseexpo.pseudoslam.agents.loading import load_policy

    rows = {}
    for experiment in EXPERIMENTS:
        found = [load_policy(str(folder_of(experiment, seed) / "policy.pt")).training for seed in SEEDS]
        assert [each.seed for each in found if each] == list(SEEDS)
        [rows[experiment]] = {each.family for each in found if each}
        network = {"cnn": "cnn", "frontiers": "set"}.get(experiment.rpartition("-")[2], "cnn-lstm")
        assert rows[experiment].startswith(f"PPO {network} ")
    assert len(set(rows.values())) == len(rows)


@pytest.mark.slow
@pytest.mark.usefixtures("learn")
@needs_shared
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_policies_score_what_is_written_down(experiment: str, seed: int) -> None:
    """Twenty episodes; a processor that rounds otherwise may take another of two actions that are as likely."""
    told = json.loads((HERE / EXPERIMENTS[experiment] / "scores.json").read_bytes())[f"{experiment}-{seed}"]
    found = score(experiment, seed)
    measure = "return" if task_of(experiment) == "avoidance" else "coverage"
    assert found[measure] == pytest.approx(told[measure], rel=0.1)
