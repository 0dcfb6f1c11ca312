"""Steps of teams of 4 robots in a vector, beside those of as many single robots in theirs (asked: 0.8 of the rate).

One thread and processor time, so that other processes of the machine weigh less; episodes of 200 steps with their
starts, and steps alone. All kinds have the same share of each house, and take turns of a few steps. The median counts.
"""

from __future__ import annotations

import time
from statistics import median
from typing import Any

import gymnasium
import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.pseudoslam import SimulatorConfig, parallel_env, parallel_vector_env
from houseexpo.pseudoslam.envs.single import ExplorationEnv

TEAMS, ROBOTS, STEPS, ROUNDS, TURN = 16, 4, 200, 5, 5
Kinds = dict[str, tuple[Any, tuple[int, ...]]]


def microseconds(kinds: Kinds, houses: list[FloorPlan], seed: int, steps: int) -> dict[str, tuple[float, float]]:
    """Return the processor time of a robot's step in an episode with its start, and in the steps alone."""
    starts, times, infos = {}, dict.fromkeys(kinds, 0.0), {}
    for name, (envs, _) in kinds.items():
        number = envs.num_envs
        plan_ids = [houses[i * len(houses) // number].id for i in range(number)]
        start = time.process_time()
        _, infos[name] = envs.reset(seed=seed, options={"plan_id": plan_ids})
        starts[name] = time.process_time() - start
    for _ in range(steps // TURN):
        for name, (envs, shape) in kinds.items():
            info, start = infos[name], time.process_time()
            for _ in range(TURN):
                _, _, _, _, info = envs.step(np.where(info["collided"], 1, 0).reshape(shape))
            times[name] += time.process_time() - start
            infos[name] = info
    each = 1e6 / (steps * TEAMS * ROBOTS)
    return {name: ((starts[name] + times[name]) * each, times[name] * each) for name in kinds}


def test_a_robot_of_a_team_beside_a_single_robot(houses: list[FloorPlan]) -> None:
    """Print microseconds of a robot's step, and the ratio of rates."""
    config = SimulatorConfig(max_steps=STEPS + 1)
    single = gymnasium.make_vec(
        "PseudoSLAM/Exploration-v0", num_envs=TEAMS * ROBOTS, dataset=houses, config=config, success_coverage=None,
        threads=1,
    )  # fmt: skip
    kinds: Kinds = {"single robots": (single, (TEAMS * ROBOTS,))}
    for radio in ("none", "sight", "always"):
        envs = parallel_vector_env(
            num_envs=TEAMS, robots=ROBOTS, dataset=houses, config=config, success_coverage=None, radio=radio, threads=1
        )
        kinds[f"teams of {ROBOTS}, radio {radio}"] = envs, (TEAMS, ROBOTS)
    microseconds(kinds, houses, 0, TURN)  # compile, and prepare the houses
    found = [microseconds(kinds, houses, seed, STEPS) for seed in range(ROUNDS)]
    table = Table(title=f"A robot's step, one thread, {TEAMS * ROBOTS} robots (microseconds of processor time)")
    for heading in ("robots", "episodes of 200 steps", "steps alone", "rate of steps / single"):
        table.add_column(heading, justify="right")
    for name in kinds:
        with_start, steps = (median(one[name][k] for one in found) for k in (0, 1))
        whole, alone = (median(one["single robots"][k] / one[name][k] for one in found) for k in (0, 1))
        table.add_row(name, f"{with_start:.1f}", f"{steps:.1f}", f"{alone:.2f} ({whole:.2f})")
    Console().print(table)
    for envs, _ in kinds.values():
        envs.close()


def test_a_robot_of_one_team_beside_the_single_environment(houses: list[FloorPlan]) -> None:
    """Print microseconds of a robot's step in ``parallel_env`` and in the single environment."""
    pytest.importorskip("pettingzoo")
    options: dict[str, Any] = {"config": SimulatorConfig(max_steps=STEPS + 1), "success_coverage": None}
    single = ExplorationEnv(houses, **options)
    teams = {name: parallel_env(robots=ROBOTS, dataset=houses, radio=name, **options) for name in ("none", "sight")}

    def alone(steps: int) -> float:
        _, info = single.reset(seed=0)
        start = time.process_time()
        for _ in range(steps):
            *_, info = single.step(1 if info["collided"] else 0)
        return (time.process_time() - start) * 1e6 / steps

    def together(name: str, steps: int) -> float:
        env = teams[name]
        _, infos = env.reset(seed=0)
        start = time.process_time()
        for _ in range(steps):
            *_, infos = env.step({agent: 1 if infos[agent]["collided"] else 0 for agent in env.agents})
        return (time.process_time() - start) * 1e6 / steps / ROBOTS

    alone(3)
    for name in teams:
        together(name, 3)
    rounds = [(alone(STEPS), *(together(name, STEPS // 2) for name in teams)) for _ in range(ROUNDS)]
    one, *rest = (median(each) for each in zip(*rounds, strict=True))
    for name, found in zip(teams, rest, strict=True):
        print(f"radio {name}: {found:.0f} microseconds, single {one:.0f}, rate {one / found:.2f}")  # noqa: T201
