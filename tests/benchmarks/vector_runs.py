"""Runs of PseudoSLAM that benchmarks measure: configurations, robots that keep moving, and how runs take turns."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from houseexpo import FloorPlan
from houseexpo.pseudoslam import LaserConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config import ScanRule
from houseexpo.pseudoslam.tasks import ObstacleAvoidance

N, RUNS, ROUNDS = 64, 9, 21
RULES: tuple[ScanRule, ...] = ("sector", "rays")
ORIGINAL = {"exploration": "360-380", "autonomous exploration": "580", "obstacle avoidance": "340-370"}
LEAST = {"exploration": 20_000, "autonomous exploration": 60_000, "obstacle avoidance": 20_000}
PICTURE = Path(__file__).parents[2] / "docs" / "images" / "step_cost.png"
GMAPPING_MS = 44.5  # a processed scan, 30 particles, 5 cm; measured between 43 and 46


def configured(name: str, rule: ScanRule) -> SimulatorConfig:
    if name == "obstacle avoidance":
        return replace(ObstacleAvoidance.default, laser=LaserConfig(5.0, 180.0, 0.7, rule))
    if name == "exploration":
        return SimulatorConfig(25.0, laser=LaserConfig(5.0, 180.0, 0.7, rule), observation=ObservationConfig(6.99))
    return SimulatorConfig(16.0, laser=LaserConfig(2.0, 180.0, 1.0, rule), observation=ObservationConfig(4.0))


def arguments(name: str, rule: ScanRule, houses: list[FloorPlan]) -> dict[str, Any]:
    config = configured(name, rule)
    return (
        {"config": config} if "avoidance" in name else {"config": config, "dataset": houses, "success_coverage": None}
    )


def id_of(name: str) -> str:
    return f"PseudoSLAM/{'ObstacleAvoidance' if 'avoidance' in name else 'Exploration'}-v0"


def in_turns(*runs: Callable[[], int], rounds: int = RUNS) -> np.ndarray:
    """Steps a second (rounds, runs), but for the first run of each. They take turns: a shared machine has its moods."""
    found = []
    for _ in range(rounds + 1):
        found.append([])
        for run in runs:
            start = time.perf_counter()
            found[-1].append(run() / (time.perf_counter() - start))
    return np.array(found[1:])


def vector_run(
    name: str, rule: ScanRule, houses: list[FloorPlan], threads: int, number: int = N, steps: int = 200
) -> Callable[[], int]:
    env = gymnasium.make_vec(id_of(name), number, threads=threads, **arguments(name, rule, houses))
    env.reset(seed=0)
    rng, blocked = np.random.default_rng(0), [np.zeros(number, bool)]

    def run() -> int:
        for turns in rng.random((steps, number)) > 0.8:  # drawn at once, for it is not the policy that is measured
            *_, info = env.step((turns | blocked[0]).astype(np.int64))
            blocked[0] = info["collided"]
        return number * steps

    return run


def single_run(name: str, rule: ScanRule, houses: list[FloorPlan], steps: int = 1000) -> Callable[[], int]:
    env = gymnasium.make(id_of(name), **arguments(name, rule, houses))
    env.reset(seed=0)
    rng, blocked = np.random.default_rng(0), [False]

    def run() -> int:
        for _ in range(steps):
            *_, truncated, info = env.step(1 if blocked[0] or rng.random() > 0.8 else 0)
            blocked[0] = info["collided"]
            if truncated:
                env.reset()
        return steps

    return run
