"""The policies of ``experiments``, and what each scores in twenty episodes.

``experiments/paper`` has those of the paper's two experiments, ``experiments/beyond`` those that go beyond its setting:
a view of 10 m, with a memory and without, and PPO that chooses frontiers.

``python -m tests.builders.trained_policies`` writes ``scores.json`` of both anew, after they were learned anew.
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

EXPERIMENTS = {
    "avoidance": "paper",
    "exploration": "paper",
    "exploration-view-10m": "beyond",
    "exploration-view-10m-cnn": "beyond",
    "exploration-frontiers": "beyond",
}
"""The trained experiments, and the folder of each."""
HERE = Path(__file__).parents[2] / "experiments"
EPISODES = 20
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


def folder_of(experiment: str, seed: int) -> Path:
    """The folder of one training."""
    return HERE / EXPERIMENTS[experiment] / f"{experiment}-{seed}"


def scores_of(
    experiment: str, seed: int, plans: Plans, ids: Sequence[str] | None, episodes: int, number: int
) -> list[dict[str, float]]:
    """What came of so many episodes of a policy, in plans of these ids, ``number`` of them at a time."""
    from houseexpo.pseudoslam.learning.environments import make_environments
    from houseexpo.pseudoslam.learning.policy_file import read_policy
    from houseexpo.pseudoslam.learning.training import score_episodes

    task = task_of(experiment)
    trained = read_policy(folder_of(experiment, seed) / "policy.pt", task)
    envs = make_environments(task, trained.config.environment, plans, number=number)
    given = tuple(ids) if ids is not None else None
    found = score_episodes(
        trained.network.policy, envs, given, episodes, deterministic=trained.config.evaluation.deterministic
    )
    envs.close()
    return found


def score(experiment: str, seed: int) -> dict[str, float]:
    """Means over the episodes; those of exploration are in plans of the published test list."""
    task = task_of(experiment)
    plans, ids = held_out() if task == "exploration" else (ROOM, None)
    rows = scores_of(experiment, seed, plans, ids, EPISODES, EPISODES)
    return {name: round(float(np.mean([row[name] for row in rows])), 4) for name in MEASURES[task]}


if __name__ == "__main__":
    for part in sorted(set(EXPERIMENTS.values())):
        names = [name for name, its in EXPERIMENTS.items() if its == part]
        told = {f"{name}-{seed}": score(name, seed) for name in names for seed in SEEDS}
        (HERE / part / "scores.json").write_text(json.dumps(told, indent=2) + "\n")
