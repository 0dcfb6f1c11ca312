"""The explorer of the tests sees all there is to see."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo.plan import FloorPlan
from houseexpo.plan_json import decode
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.simulator import Simulator
from tests.builders.walkers import frontier_walk


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_explores_a_corner(seed: int) -> None:
    plan = FloorPlan("corner", [(0, 0), (0, 8), (3, 8), (3, 2), (9, 2), (9, 0)], 1, {})
    assert coverage(plan, seed, most=150) == 1.0


@pytest.mark.slow
def test_it_explores_published_houses(published_lines: list[bytes]) -> None:
    for line in published_lines[:5]:
        plan = decode(line)
        assert coverage(plan, 0, most=300 + 5 * int(plan.area)) >= 0.99, plan.id


def coverage(plan: FloorPlan, seed: int, most: int) -> float:
    simulator = Simulator.of(plan, SimulatorConfig(16.0))
    state = simulator.start(np.random.default_rng(seed))
    for steps, action in enumerate(frontier_walk(simulator, state), start=1):
        simulator.step(state, action)
        assert steps <= most, (plan.id, simulator.coverage(state))
    return simulator.coverage(state)
