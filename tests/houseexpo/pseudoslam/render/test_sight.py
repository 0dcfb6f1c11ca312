"""What a robot sees, as numbers: how far its beams reach."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.render.sight import measure_sight
from houseexpo.pseudoslam.simulator import Simulator

ROOM = FloorPlan("room", [(0, 0), (0, 4), (6, 4), (6, 0)], 1, {})
CELL_M = 0.04


def test_beams_reach_the_walls_or_as_far_as_the_laser() -> None:
    start = StartConfig(random=False, x_m=2.0, y_m=2.0, heading_deg=0.0)
    simulator = Simulator.of(ROOM, SimulatorConfig(start=start, laser=LaserConfig(range_m=3.0)))
    found = measure_sight(simulator, simulator.start(np.random.default_rng(0)), 3)
    assert found.ranges * CELL_M == pytest.approx([2.0, 3.0, 2.0], abs=1.5 * CELL_M)  # right, ahead, left
    assert found.bodies.shape == (0, 6)
