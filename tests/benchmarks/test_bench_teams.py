"""Steps of teams of 4 robots in a vector, beside those of as many single robots in theirs (asked: 0.8 of the rate).

One thread and processor time, so that other processes of the machine weigh less; episodes of 200 steps with their
starts, and steps alone. All kinds take turns, and the median counts.
"""

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
from houseexpo.pseudoslam import SimulatorConfig, parallel_vector_env

TEAMS, ROBOTS, STEPS, ROUNDS = 16, 4, 200, 5


def microseconds(envs: Any, shape: tuple[int, ...], steps: int) -> tuple[float, float]:
    """Return the processor time of a robot's step in an episode with its start, and in the steps alone."""
    start = time.process_time()
    _, infos = envs.reset(seed=0)
    begun = time.process_time()
    for _ in range(steps):
        _, _, _, _, infos = envs.step(np.where(infos["collided"], 1, 0).reshape(shape))
    end = time.process_time()
    each = 1e6 / (steps * TEAMS * ROBOTS)
    return (end - start) * each, (end - begun) * each


def test_a_robot_of_a_team_beside_a_single_robot(houses: list[FloorPlan]) -> None:
    """Print microseconds of a robot's step, and the ratio of rates."""
    config = SimulatorConfig(max_steps=STEPS + 1)
    single = gymnasium.make_vec(
        "PseudoSLAM/Exploration-v0", num_envs=TEAMS * ROBOTS, dataset=houses, config=config, success_coverage=None,
        threads=1,
    )  # fmt: skip
    kinds: dict[str, tuple[Any, tuple[int, ...]]] = {"single robots": (single, (TEAMS * ROBOTS,))}
    for radio in ("none", "sight", "always"):
        envs = parallel_vector_env(
            num_envs=TEAMS, robots=ROBOTS, dataset=houses, config=config, success_coverage=None, radio=radio, threads=1
        )
        kinds[f"teams of {ROBOTS}, radio {radio}"] = envs, (TEAMS, ROBOTS)
    for envs, shape in kinds.values():  # compile, and prepare the houses
        microseconds(envs, shape, 5)
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in kinds}
    for _ in range(ROUNDS):
        for name, (envs, shape) in kinds.items():
            found[name].append(microseconds(envs, shape, STEPS))
    table = Table(title=f"A robot's step, one thread, {TEAMS * ROBOTS} robots (microseconds of processor time)")
    for heading in ("robots", "episodes of 200 steps", "steps alone", "rate of steps / single"):
        table.add_column(heading, justify="right")
    whole, alone = (median(one[k] for one in found["single robots"]) for k in (0, 1))
    for name, times in found.items():
        with_start, steps = (median(one[k] for one in times) for k in (0, 1))
        table.add_row(name, f"{with_start:.1f}", f"{steps:.1f}", f"{alone / steps:.2f} ({whole / with_start:.2f})")
    Console().print(table)
    for envs, _ in kinds.values():
        envs.close()
