"""The explorer sees all there is to see."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan, decode
from houseexpo.pseudoslam.agents.explorers import yield_frontier_actions
from houseexpo.pseudoslam.config import SimulatorConfig, StartConfig
from houseexpo.pseudoslam.config.moving_obstacles import Trajectory
from houseexpo.pseudoslam.config.obstacles import Circle
from houseexpo.pseudoslam.simulator import Simulator


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
    for steps, action in enumerate(yield_frontier_actions(simulator, state), start=1):
        simulator.step(state, action)
        assert steps <= most, (plan.id, simulator.coverage(state))
    return simulator.coverage(state)


def test_people_in_its_way_do_not_end_it() -> None:
    """A body that stands in the only passage for a while."""
    plan = FloorPlan(
        "neck", [(0, 0), (0, 3), (3, 3), (3, 2), (4, 2), (4, 3), (7, 3), (7, 0), (4, 0), (4, 1), (3, 1), (3, 0)], 2, {}
    )
    blocker = Trajectory(Circle(0.3), times_s=(0, 30, 40), poses=((3.5, 1.5, 0), (3.5, 1.5, 0), (5.5, 1.5, 0)))
    config = SimulatorConfig(16.0, trajectories=(blocker,), start=StartConfig(random=False, x_m=1.0, y_m=1.5))
    simulator = Simulator.of(plan, config)
    state = simulator.start(np.random.default_rng(0))
    while simulator.coverage(state) < 0.98:  # what the body covers stays unseen
        for action in yield_frontier_actions(simulator, state):
            simulator.step(state, action)
            assert state.counts.steps < 300
    assert state.counts.steps > 60  # the passage was closed till then
