"""How many steps a second the simulator makes; the policy goes forward (0.8) and turns when it is blocked."""

from __future__ import annotations

import gzip
import time
from collections.abc import Callable

import gymnasium
import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam  # registers the environments
from houseexpo import FloorPlan
from houseexpo.plan_json import decode
from houseexpo.pseudoslam.config import LaserConfig, ObservationConfig, ScanRule, SimulatorConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, merge
from houseexpo.pseudoslam.kernels.sector import sector_scan
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.world import scan_buffers
from tests.builders.shared import DATA, needs_shared

STEPS, AREAS = 4000, (57.0, 117.0)
ORIGINAL = {"exploration": "360-380", "autonomous exploration": "580"}
SETTINGS = {
    "exploration": (25.0, 5.0, 0.7, 6.99),
    "autonomous exploration": (16.0, 2.0, 1.0, 4.0),
}


def configured(name: str, rule: ScanRule) -> SimulatorConfig:
    ppm, range_m, resolution, size = SETTINGS[name]
    laser = LaserConfig(range_m=range_m, resolution_deg=resolution, rule=rule)
    return SimulatorConfig(ppm, laser=laser, observation=ObservationConfig(size), max_steps=10**9)


@pytest.fixture(scope="module")
def houses() -> list[FloorPlan]:
    """Two published houses of 57 and 117 m2, or nearly."""
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        plans = [decode(line) for line, _ in zip(stream, range(300), strict=False)]
    return [min(plans, key=lambda plan: abs(plan.area - area)) for area in AREAS]


def rate(step: Callable[[int], bool], steps: int = STEPS) -> float:
    """Steps a second of processor time, warm; ``step`` takes an action and says whether it was blocked."""
    rng = np.random.default_rng(0)
    ahead = (rng.random(steps) < 0.8).tolist()
    blocked = step(0)
    start = time.process_time()
    for forward in ahead:
        blocked = step(1 if blocked or not forward else 0)
    return steps / (time.process_time() - start)


@needs_shared
def test_steps_a_second(houses: list[FloorPlan]) -> None:
    table = Table(title="Steps a second, one environment, one core: mean of two houses, warm")
    for heading in ("configuration", "scan", "view", "original", "Simulator.step", "gymnasium.make"):
        table.add_column(heading, justify="left" if heading in {"configuration", "scan"} else "right")
    for name, original in ORIGINAL.items():
        for rule in ("sector", "rays"):
            config = configured(name, rule)
            inner, outer = [], []
            for plan in houses:
                simulator, rng = Simulator.of(plan, config), np.random.default_rng(0)
                state = simulator.start(rng)

                def bare(action: int, simulator=simulator, state=state, rng=rng) -> bool:
                    simulator.step(state, ("forward", "left")[action], rng)
                    return state.blocked

                env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=plan, config=config, success_coverage=None)
                env.reset(seed=0)
                inner.append(rate(bare))
                outer.append(rate(lambda action, env=env: env.step(action)[4]["collided"]))
            rates = (f"{np.mean(found):,.0f}" for found in (inner, outer))
            table.add_row(name, rule, f"{config.side_px} x {config.side_px}", original, *rates)
            assert np.mean(outer) > 1000
    Console(width=140).print(table)
    assert houseexpo.pseudoslam.__all__


@needs_shared
def test_one_scan_with_its_map(houses: list[FloorPlan]) -> None:
    """20 px/m, 5 m, half a circle, from anywhere; gMapping takes 43-46 ms."""
    table = Table(title="One scan with map update, 20 px/m, 5 m, 180 degrees (microseconds, mean)", min_width=90)
    table.add_column("house (m2)")
    table.add_column("us", justify="right")
    free, hit, slopes = scan_buffers(100.0)
    for plan in houses:
        world = Simulator.of(plan, SimulatorConfig(20.0)).world
        rng = np.random.default_rng(0)
        cells = rng.choice(np.argwhere(world.stand), 2000) + 0.5
        known = np.zeros_like(world.solid)
        sector_scan(world.solid, 1.5, 1.5, 0.0, np.pi / 2, 100.0, free, hit, slopes)  # compile
        merge(known, world.countable, free, 0, FREE)
        start = time.process_time()
        for y, x in cells.tolist():
            counts = sector_scan(world.solid, x, y, x + y, np.pi / 2, 100.0, free, hit, slopes)
            merge(known, world.countable, free, counts[0], FREE)
            merge(known, world.countable, hit, counts[1], OBSTACLE)
        table.add_row(f"{plan.area:.0f}", f"{1e6 * (time.process_time() - start) / len(cells):.1f}")
        assert known.any()
    Console().print(table)
