"""The policies of the paper's two experiments, ``experiments/paper``, and what each scores in twenty episodes.

``python -m tests.builders.paper_policies`` writes ``experiments/paper/scores.json`` anew, after they were learned anew.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from houseexpo import Dataset, open_dataset
from houseexpo.pseudoslam.tasks import ROOM
from houseexpo.pseudoslam.worlds.cache import Plans
from tests.builders.shared import DATA

PAPER = Path(__file__).parents[2] / "experiments" / "paper"
SCORES = PAPER / "scores.json"
EPISODES = 20
TASKS = ("avoidance", "exploration")
SEEDS = (0, 1, 2)
MEASURES = {"avoidance": ("return", "collisions"), "exploration": ("coverage", "explored_m2")}


def held_out() -> tuple[Dataset, list[str]]:
    """The published plans, and the ids of those on the official test list, in its order."""
    plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
    listed = (DATA / "houseexpo" / "map_id_test.txt").read_text().split()
    return plans, [name for name in listed if name in plans]


def scores_of(
    task: str, seed: int, plans: Plans, ids: Sequence[str] | None, episodes: int, number: int
) -> list[dict[str, float]]:
    """What came of so many episodes of a policy, in plans of these ids, ``number`` of them at a time."""
    from houseexpo.pseudoslam.learning.evaluation import scores
    from houseexpo.pseudoslam.learning.places import environments
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    trained = read_policy(PAPER / f"{task}-{seed}" / "policy.pt", task)
    envs = environments(task, trained.config.environment, plans, number=number)
    given = tuple(ids) if ids is not None else None
    found = scores(trained.policy, envs, given, episodes, deterministic=trained.config.evaluation.deterministic)
    envs.close()
    return found


def score(task: str, seed: int) -> dict[str, float]:
    """Means over the episodes; those of exploration are in plans of the published test list."""
    plans, ids = held_out() if task == "exploration" else (ROOM, None)
    rows = scores_of(task, seed, plans, ids, EPISODES, EPISODES)
    return {name: round(float(np.mean([row[name] for row in rows])), 4) for name in MEASURES[task]}


if __name__ == "__main__":
    told = {f"{task}-{seed}": score(task, seed) for task in TASKS for seed in SEEDS}
    SCORES.write_text(json.dumps(told, indent=2) + "\n")
