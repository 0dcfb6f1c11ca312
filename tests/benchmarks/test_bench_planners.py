"""How fast robots go from frontier to frontier, and how long one takes to find its frontiers.

64 environments in houses at random from 200 published plans at 25 px/m, episodes of 200 steps. One action goes to the
nearest frontier, which the observation tells, or to a point at random; steps are those that actions consist of. A
decision is all that ``MapPlanner.frontiers`` does: where the robot may stand, all ways, all frontiers and where to see
them from; it is asked for before each action in one environment. Medians of rounds in which all runs take turns.
"""

from __future__ import annotations

import gzip
import os
import time
from collections.abc import Callable

import gymnasium
import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.floorplan import decode
from houseexpo.pseudoslam import SimulatorConfig
from houseexpo.pseudoslam.planning import MapPlanner
from tests.builders.shared import DATA, needs_shared

ENVS, ACTIONS, ROUNDS, PLANS = 64, 40, 7, 200

pytestmark = needs_shared


@pytest.fixture(scope="module")
def plans() -> list[FloorPlan]:
    """Published plans, as they come."""
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        return [decode(line) for line, _ in zip(stream, range(PLANS), strict=False)]


def run_of(plans: list[FloorPlan], threads: int) -> Callable[[], tuple[int, int]]:
    """What takes ``ACTIONS`` actions everywhere, and returns how many actions and steps those were."""
    env = gymnasium.make_vec("PseudoSLAM/Exploration-v0", ENVS, dataset=plans, actions="frontier", threads=threads)
    env.reset(seed=0)

    def run() -> tuple[int, int]:
        steps = 0
        for _ in range(ACTIONS):
            *_, info = env.step(np.zeros(ENVS, np.int64))
            steps += int(info["primitive_steps"].sum())
        return ENVS * ACTIONS, steps

    return run


def test_actions_and_steps_a_second(plans: list[FloorPlan]) -> None:
    cores = min(len(os.sched_getaffinity(0)), 2)
    rows = (1, cores)
    runs = [run_of(plans, threads) for threads in rows]
    found = []
    for _ in range(ROUNDS + 1):
        found.append([])
        for run in runs:
            start = time.perf_counter()
            counts = np.array(run())
            found[-1].append(counts / (time.perf_counter() - start))
    rates = np.median(found[1:], axis=0)
    table = Table(title=f"Planners' actions, {ENVS} environments, resets included")
    for heading in ("threads", "frontiers/s", "steps/s"):
        table.add_column(heading, justify="right")
    for threads, (each, steps) in zip(rows, rates.tolist(), strict=True):
        table.add_row(f"{threads}", f"{each:,.0f}", f"{steps:,.0f}")
    Console(width=100).print(table)
    assert (rates > 0).all()


def test_time_of_a_decision(plans: list[FloorPlan]) -> None:
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=plans, actions="frontier").unwrapped
    planner = MapPlanner(SimulatorConfig())
    took_ms, numbers = [], []
    for seed in range(100):
        env.reset(seed=seed)
        ended = False
        while not ended:
            x, y, _ = env.state.believed_px.tolist()
            start = time.perf_counter()
            numbers.append(len(planner.frontiers(env.state.known, x, y)))
            took_ms.append(1e3 * (time.perf_counter() - start))
            _, _, terminated, truncated, _ = env.step(0)
            ended = terminated or truncated
    took_ms = took_ms[1:]  # the first compiles
    table = Table(title="Finding the frontiers of a map at 25 px/m, ms (asked: 1 in the median)")
    for heading in ("decisions", "frontiers", "median", "mean", "90%", "worst"):
        table.add_column(heading, justify="right")
    shares = [float(np.median(took_ms)), float(np.mean(took_ms)), float(np.quantile(took_ms, 0.9)), max(took_ms)]
    table.add_row(f"{len(took_ms):,}", f"{np.median(numbers):.0f}", *(f"{share:.2f}" for share in shares))
    Console(width=100).print(table)
