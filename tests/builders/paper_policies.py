"""The policies of the paper's two experiments, ``experiments/paper``, and what each scores in twenty episodes.

``python -m tests.builders.paper_policies`` writes ``experiments/paper/scores.json`` anew, after they were learned anew.
"""

from __future__ import annotations

import json
from pathlib import Path

from houseexpo import open_dataset
from tests.builders.shared import DATA

PAPER = Path(__file__).parents[2] / "experiments" / "paper"
SCORES = PAPER / "scores.json"
EPISODES = 20
TASKS = ("avoidance", "exploration")
SEEDS = (0, 1, 2)
MEASURES = {"avoidance": ("return", "collisions"), "exploration": ("coverage", "explored_m2")}


def score(task: str, seed: int) -> dict[str, float]:
    """Means over the episodes; those of exploration are in plans of the published test list."""
    from houseexpo.pseudoslam.learning.evaluation import evaluate
    from houseexpo.pseudoslam.learning.places import environments
    from houseexpo.pseudoslam.learning.policy_file import read_policy
    from houseexpo.pseudoslam.tasks import ROOM

    trained = read_policy(PAPER / f"{task}-{seed}" / "policy.pt", task)
    plans, ids = ROOM, None
    if task == "exploration":
        plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
        listed = (DATA / "houseexpo" / "map_id_test.txt").read_text().split()
        ids = tuple(name for name in listed if name in plans)[:EPISODES]
    envs = environments(task, trained.config.environment, plans, number=EPISODES)
    found = evaluate(trained.policy, envs, ids, EPISODES, deterministic=trained.config.evaluation.deterministic)
    envs.close()
    return {name: round(found[name], 4) for name in MEASURES[task]}


if __name__ == "__main__":
    told = {f"{task}-{seed}": score(task, seed) for task in TASKS for seed in SEEDS}
    SCORES.write_text(json.dumps(told, indent=2) + "\n")
