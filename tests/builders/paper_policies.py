"""The policies of ``experiments/paper``, and what each scores in twenty episodes.

They are those of the paper's two experiments, with the paper's memory and without, and of PPO that chooses frontiers.

``python -m tests.builders.paper_policies`` writes ``experiments/paper/scores.json`` anew, after they were learned anew.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from houseexpo import Dataset, open_dataset
from houseexpo.pseudoslam.tasks import ROOM
from houseexpo.pseudoslam.worlds.maps import Plans
from tests.builders.shared import DATA

PAPER = Path(__file__).parents[2] / "experiments" / "paper"
SCORES = PAPER / "scores.json"
EPISODES = 20
EXPERIMENTS = ("avoidance", "exploration", "avoidance-cnn", "exploration-cnn", "exploration-frontiers")
SEEDS = (0, 1, 2)
MEASURES = {"avoidance": ("return", "collisions"), "exploration": ("coverage", "explored_m2")}


def held_out() -> tuple[Dataset, list[str]]:
    """The published plans, and the ids of those on the official test list, in its order."""
    plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
    listed = (DATA / "houseexpo" / "map_id_test.txt").read_text().split()
    return plans, [name for name in listed if name in plans]


def task_of(experiment: str) -> str:
    """The task of an experiment."""
    return experiment.partition("-")[0]


def scores_of(
    experiment: str, seed: int, plans: Plans, ids: Sequence[str] | None, episodes: int, number: int
) -> list[dict[str, float]]:
    """What came of so many episodes of a policy, in plans of these ids, ``number`` of them at a time."""
    from houseexpo.pseudoslam.learning.environments import make_environments
    from houseexpo.pseudoslam.learning.evaluation import score_episodes
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    task = task_of(experiment)
    trained = read_policy(PAPER / f"{experiment}-{seed}" / "policy.pt", task)
    envs = make_environments(task, trained.config.environment, plans, number=number)
    given = tuple(ids) if ids is not None else None
    found = score_episodes(trained.policy, envs, given, episodes, deterministic=trained.config.evaluation.deterministic)
    envs.close()
    return found


def score(experiment: str, seed: int) -> dict[str, float]:
    """Means over the episodes; those of exploration are in plans of the published test list."""
    task = task_of(experiment)
    plans, ids = held_out() if task == "exploration" else (ROOM, None)
    rows = scores_of(experiment, seed, plans, ids, EPISODES, EPISODES)
    return {name: round(float(np.mean([row[name] for row in rows])), 4) for name in MEASURES[task]}


if __name__ == "__main__":
    told = {f"{name}-{seed}": score(name, seed) for name in EXPERIMENTS for seed in SEEDS}
    SCORES.write_text(json.dumps(told, indent=2) + "\n")
