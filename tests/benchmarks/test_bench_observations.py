"""What a step costs with each kind of observation: 64 environments in published houses, one thread, prepared worlds."""

from __future__ import annotations

import time
from statistics import median
from typing import Any

import gymnasium
import numpy as np
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan

ENVS, STEPS, ROUNDS = 64, 100, 7
RUNS: dict[str, dict[str, Any]] = {
    "map, 100 x 100": {},
    "dict": {"observation": "dict"},
    "scales, 4 x 100 x 100": {"observation": "scales"},
    "view-10m, 64 x 64": {"config": "view-10m"},
    "view-10m, scales, 4 x 64 x 64": {"config": "view-10m", "observation": "scales"},
    "round-10m, 80 x 80": {"config": "round-10m"},
    "round-10m, scales, 4 x 80 x 80": {"config": "round-10m", "observation": "scales"},
}


def test_steps_a_second_of_each_observation(houses: list[FloorPlan]) -> None:
    envs = {
        name: gymnasium.make_vec(
            "PseudoSLAM/Exploration-v0", ENVS, dataset=houses, threads=1, success_coverage=None, **given
        )
        for name, given in RUNS.items()
    }
    rates: dict[str, list[float]] = {name: [] for name in RUNS}
    for env in envs.values():
        env.reset(seed=0)
    for _ in range(ROUNDS + 1):  # the first one makes houses
        for name, env in envs.items():
            blocked, rng = np.zeros(ENVS, bool), np.random.default_rng(0)
            start = time.perf_counter()
            for turns in rng.random((STEPS, ENVS)) > 0.8:
                *_, info = env.step((turns | blocked).astype(np.int64))
                blocked = info["collided"]
            rates[name].append(ENVS * STEPS / (time.perf_counter() - start))
    table = Table("observation", "steps/s", title="Exploration, 25 px/m, 64 environments, one thread")
    for name, found in rates.items():
        table.add_row(name, f"{median(found[1:]):,.0f}")
    Console().print(table)
