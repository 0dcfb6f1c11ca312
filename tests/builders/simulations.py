"""Small houses, and robots in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from houseexpo import FloorPlan
from houseexpo.pseudoslam.config import SimulatorConfig, StartConfig
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State

PLAIN = SimulatorConfig()


def hall(width: float = 8.0, height: float = 4.0) -> FloorPlan:
    return FloorPlan("hall", [(0, 0), (0, height), (width, height), (width, 0)], 1, {})


def corner() -> FloorPlan:
    """A room whose wall at x = 5 has 4 m of nothing behind it."""
    return FloorPlan("corner", [(0, 0), (0, 4), (5, 4), (5, 0.5), (9, 0.5), (9, 0)], 1, {})


def hall_with_cell() -> FloorPlan:
    """A hall whose right part, 2 m wide, is behind a gap of 0.3 m."""
    verts = [(0, 0), (0, 4), (5, 4), (5, 2.3), (5.1, 2.3), (5.1, 4), (7, 4), (7, 0), (5.1, 0), (5.1, 2), (5, 2), (5, 0)]
    return FloorPlan("cell", verts, 1, {})


def at(x: float, y: float, heading: float, config: SimulatorConfig = PLAIN) -> SimulatorConfig:
    return replace(config, start=StartConfig(random=False, x_m=x, y_m=y, heading_deg=heading))


def started(config: SimulatorConfig, plan: FloorPlan | None = None) -> tuple[Simulator, State, np.random.Generator]:
    rng = np.random.default_rng(0)
    simulator = Simulator.of(plan or hall(), config)
    return simulator, simulator.start(rng), rng


def wander(simulator: Simulator, state: State, rng: np.random.Generator, steps: int) -> None:
    """Forward most of the time, turn when blocked."""
    for _ in range(steps):
        simulator.step(state, "left" if state.blocked or rng.random() < 0.2 else "forward")
