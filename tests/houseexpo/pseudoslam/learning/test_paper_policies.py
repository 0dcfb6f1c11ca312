"""The policies of the paper's two experiments still score what is written down beside them."""

from __future__ import annotations

import json

import pytest

from tests.builders.paper_policies import PAPER, SCORES, SEEDS, TASKS, score
from tests.builders.shared import needs_shared


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("task", TASKS)
def test_weights_come_with_what_made_them(task: str, seed: int) -> None:
    folder = PAPER / f"{task}-{seed}"
    assert (folder / "policy.pt").stat().st_size < 5_000_000
    about = json.loads((folder / "policy.json").read_bytes())
    assert (about["task"], about["seed"]) == (task, seed)
    assert len(about["commit"]) == 40  # a "+" behind it would say that the tree had been changed
    last = (folder / "evaluation.csv").read_text().splitlines()[-1]
    assert int(last.partition(",")[0]) == about["steps"] >= about["config"]["steps"]


@pytest.mark.slow
@pytest.mark.usefixtures("learn")
def test_trainings_that_differ_by_their_seed_are_one_row_of_a_table() -> None:
    from houseexpo.pseudoslam.agents.loading import load_policy

    rows = {}
    for task in TASKS:
        found = [load_policy(str(PAPER / f"{task}-{seed}" / "policy.pt")).training for seed in SEEDS]
        assert [each.seed for each in found if each] == list(SEEDS)
        [rows[task]] = {each.family for each in found if each}
        assert rows[task].startswith("cnn-lstm ")
    assert rows["avoidance"] != rows["exploration"]


@pytest.mark.slow
@pytest.mark.usefixtures("learn")
@needs_shared
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("task", TASKS)
def test_policies_score_what_is_written_down(task: str, seed: int) -> None:
    """Twenty episodes; a processor that rounds otherwise may take another of two actions that are as likely."""
    told = json.loads(SCORES.read_bytes())[f"{task}-{seed}"]
    found = score(task, seed)
    measure = "return" if task == "avoidance" else "coverage"
    assert found[measure] == pytest.approx(told[measure], rel=0.1)
