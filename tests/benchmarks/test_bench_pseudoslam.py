"""How many steps a second the simulator makes, and where the time goes.

The policy goes forward (0.8) and turns left when it is blocked: one that keeps moving. Houses are two published ones of
57 and 117 m2, the original's; obstacles are drawn anew at each reset, every 200 steps. Rates are medians of 9
or 21 rounds, in which all runs take turns. Beside what two threads make of one stands what two processes make of one,
each with half of the environments and nothing in common: that is what two cores of this machine, which others may
share, gave just then.
"""

from __future__ import annotations

import gzip
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam
from houseexpo import FloorPlan
from houseexpo.floorplan import decode
from houseexpo.pseudoslam import LaserConfig, ObservationConfig, Simulator, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.config import ScanRule
from houseexpo.pseudoslam.envs.batch import Batch
from houseexpo.pseudoslam.kernels.mapping.crop import crop
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, merge_cells, merge_runs
from houseexpo.pseudoslam.kernels.sensing.rays import ray_merge
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.step_params import step_params_of
from houseexpo.pseudoslam.tasks import ObstacleAvoidance
from houseexpo.pseudoslam.worlds.world import scan_buffers
from tests.benchmarks.straightforward import steps as straightforward
from tests.builders.shared import DATA, needs_shared

N, RUNS, ROUNDS, AREAS = 64, 9, 21, (57.0, 117.0)
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


@pytest.fixture(scope="module")
def houses() -> list[FloorPlan]:
    """Two published houses of 57 and 117 m2, or nearly."""
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        plans = [decode(line) for line, _ in zip(stream, range(300), strict=False)]
    return [min(plans, key=lambda plan: abs(plan.area - area)) for area in AREAS]


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


def rates(*runs: Callable[[], int]) -> list[float]:
    """Steps a second, medians."""
    return np.median(in_turns(*runs), axis=0).tolist()


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


def run_when_told(pipe: Connection, name: str, rule: ScanRule, houses: list[FloorPlan]) -> None:
    """Make runs of half of the environments in a process of its own."""
    run = vector_run(name, rule, houses, 1, N // 2)
    with suppress(EOFError):  # until the other end is closed
        while pipe.recv():
            pipe.send(run())


@contextmanager
def processes(
    name: str, rule: ScanRule, houses: list[FloorPlan]
) -> Iterator[tuple[Callable[[], int], Callable[[], int]]]:
    """Yield runs of one process and of two at once."""
    context, pipes, children = get_context("spawn"), [], []
    for _ in range(2):
        ours, its = context.Pipe()
        pipes.append(ours)
        children.append(context.Process(target=run_when_told, args=(its, name, rule, houses), daemon=True))
        children[-1].start()
        its.close()

    def run(pipes: list[Connection]) -> int:
        for pipe in pipes:
            pipe.send(True)
        return sum(pipe.recv() for pipe in pipes)

    try:
        yield lambda: run(pipes[:1]), lambda: run(pipes)
    finally:
        for pipe, child in zip(pipes, children, strict=True):
            pipe.close()
            child.join()


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


def batch_of(config: SimulatorConfig, houses: list[FloorPlan]) -> Batch:
    rng, params = np.random.default_rng(0), step_params_of(config)
    batch = Batch(N, config, params, threads=1)
    simulators = [Simulator.of(house, config) for house in houses]
    for i in range(N):
        batch.put(i, simulators[i % len(houses)].start(rng))
    return batch


def kernel_run(
    config: SimulatorConfig, houses: list[FloorPlan], step: Callable[[Batch, np.ndarray], None], steps: int = 60
) -> Callable[[], int]:
    batch, rng = batch_of(config, houses), np.random.default_rng(0)
    turn, way = np.array([np.radians(10.0), 0.0]), np.array([0.0, 0.3 * config.pixels_per_metre])

    def run() -> int:
        for _ in range(steps):
            turns = (batch.arrays.counts["blocked"][:, 0] != 0) | (rng.random(N) > 0.8)
            step(batch, np.where(turns[:, None], turn, way))
        return N * steps

    return run


@needs_shared
def test_steps_a_second(houses: list[FloorPlan]) -> None:
    table = Table(title=f"Environment steps a second, {N} environments, copies of observations, resets included")
    for heading in (
        "configuration",
        "scan",
        "view",
        "original",
        "1 core",
        "2 cores",
        "ratio",
        "2 processes",
        "asked, 1 core",
        "alone",
    ):
        table.add_column(heading, justify="left" if heading in {"configuration", "scan"} else "right")
    cores = len(os.sched_getaffinity(0))
    for name, original in ORIGINAL.items():
        for rule in RULES:
            threads = [vector_run(name, rule, houses, number) for number in (1, min(cores, 2))]
            with processes(name, rule, houses) as programs:
                found = in_turns(*threads, *programs, single_run(name, rule, houses), rounds=ROUNDS)
            one, two, _, _, alone = np.median(found, axis=0)
            two = two if cores > 1 else float("nan")
            ratio, machine = np.median(found[:, [1, 3]] / found[:, [0, 2]], axis=0)
            side = configured(name, rule).side_px
            table.add_row(
                name, rule, f"{side} x {side}", original, f"{one:,.0f}", f"{two:,.0f}", f"{ratio:.2f}",
                f"{machine:.2f}", f"{LEAST[name]:,}", f"{alone:,.0f}",
            )  # fmt: skip
            assert one > 1000
    table.caption = (
        "ratio: two threads against one, median of the rounds; 2 processes: so for programs with nothing in common\n"
        "alone: one environment through gymnasium.make (asked: 5,000 in the first configuration)"
    )
    Console(width=150).print(table)
    assert houseexpo.pseudoslam.__all__


@needs_shared
def test_beside_a_straightforward_kernel(houses: list[FloorPlan]) -> None:
    table = Table(title="The batched kernel beside a straightforward one (rays), one core, steps a second")
    for heading in ("configuration", "straightforward", "rays", "ratio", "sector", "ratio"):
        table.add_column(heading, justify="left" if heading == "configuration" else "right")
    for name in ("exploration", "autonomous exploration"):
        config = configured(name, "rays")
        one, other = batch_of(config, houses), batch_of(config, houses)
        for k in range(30):
            motions = np.tile((0.1, 0.0) if k % 3 else (0.0, 3.0), (N, 1))
            one.step(motions, np.ones(N, np.uint8))
            straightforward(other.arrays, other.sizes, motions, step_params_of(config))
        assert (one.arrays.known == other.arrays.known).all()
        params = step_params_of(config)
        slow, rays, sector = rates(
            kernel_run(config, houses, lambda b, m, r=params: straightforward(b.arrays, b.sizes, m, r)),
            *(
                kernel_run(configured(name, rule), houses, lambda b, m: b.step(m, np.ones(N, np.uint8)))
                for rule in ("rays", "sector")
            ),
        )
        table.add_row(
            name, f"{slow:,.0f}", f"{rays:,.0f}", f"{rays / slow:.2f}", f"{sector:,.0f}", f"{sector / slow:.2f}"
        )
    Console(width=120).print(table)


def microseconds(call: Callable[[], object], times: int) -> float:
    call()
    found = []
    for _ in range(RUNS):
        start = time.process_time()
        for _ in range(times):
            call()
        found.append((time.process_time() - start) / times * 1e6)
    return float(np.median(found))


@needs_shared
def test_one_scan_with_its_map(houses: list[FloorPlan]) -> None:
    """20 px/m, 5 m, half a circle, from anywhere; beside gMapping's time."""
    table = Table(title="One scan with map update, 20 px/m, 5 m, 180 rays (microseconds, mean of 500 places)")
    for heading in ("house (m2)", "sector", "rays", "gMapping / sector"):
        table.add_column(heading, justify="right")
    fan = np.arange(-np.pi / 2, np.pi / 2, np.pi / 180)
    fan_cos, fan_sin = np.cos(fan), np.sin(fan)
    runs, hit, slopes = scan_buffers(100.0)
    for plan in houses:
        world = Simulator.of(plan, SimulatorConfig(20.0)).world
        cells = (np.random.default_rng(0).choice(np.argwhere(world.traversable), 500) + 0.5).tolist()
        known, observable, occupied = np.zeros_like(world.occupied), world.observable.copy(), world.occupied.copy()

        def sector(cells=cells, known=known, observable=observable, occupied=occupied) -> None:
            for y, x in cells:
                n_runs, n_hit = sector_scan(occupied, x, y, x + y, np.pi / 2, 100.0, runs, hit, slopes)
                merge_runs(known, observable, runs, n_runs, FREE)
                merge_cells(known, observable, hit, n_hit, OBSTACLE)

        def rays(cells=cells, known=known, observable=observable, occupied=occupied) -> None:
            for y, x in cells:
                *_, n_hit = ray_merge(occupied, observable, known, x, y, x + y, fan_cos, fan_sin, 100.0, hit, True)
                merge_cells(known, observable, hit, n_hit, OBSTACLE)

        one, other = (microseconds(call, 4) / len(cells) for call in (sector, rays))
        table.add_row(f"{plan.area:.0f}", f"{one:.1f}", f"{other:.1f}", f"{1000 * GMAPPING_MS / one:,.0f}")
        assert known.any()
    Console().print(table)


@needs_shared
def test_where_the_time_goes(houses: list[FloorPlan]) -> None:
    config = configured("exploration", "sector")
    table = Table(title="Where a step's time goes, exploration, microseconds (medians)")
    for heading in ("house (m2)", "whole step", "crop", "scan and map", "motion and the rest"):
        table.add_column(heading, justify="right")
    for plan in houses:
        batch = batch_of(config, [plan])
        state, sensor = batch.state(0), step_params_of(config).sensor
        shown, pose, occupied = state.view.copy(), state.pose_px, state.occupied
        runs, hit, slopes = scan_buffers(sensor.range_px)
        known, observable = state.known.copy(), state.episode.observable
        whole = 1e6 / rates(kernel_run(config, [plan], lambda b, m: b.step(m, np.ones(N, np.uint8))))[0]
        cut = microseconds(lambda: crop(known, pose[0], pose[1], pose[2], shown), 500)  # noqa: B023  # called at once

        def scan(
            batch=batch, known=known, observable=observable, occupied=occupied, runs=runs, hit=hit, slopes=slopes
        ) -> None:
            for x, y, heading in batch.arrays.pose.view(np.float64)[:, :3].tolist():
                n_runs, n_hit = sector_scan(occupied, x, y, heading, np.pi / 2, 125.0, runs, hit, slopes)
                merge_runs(known, observable, runs, n_runs, FREE)
                merge_cells(known, observable, hit, n_hit, OBSTACLE)

        look = microseconds(scan, 20) / N
        table.add_row(f"{plan.area:.0f}", f"{whole:.1f}", f"{cut:.1f}", f"{look:.1f}", f"{whole - cut - look:.1f}")
    Console().print(table)


def lattice(side_m: float) -> FloorPlan:
    """A hall with a pillar every 4 m: a robot sees as much of a small one as of a big one."""
    at = np.arange(2.0, side_m - 1, 4.0)
    holes = [[(x, y), (x + 0.5, y), (x + 0.5, y + 0.5), (x, y + 0.5)] for x in at for y in at]
    return FloorPlan(f"hall-{side_m:g}", [(0, 0), (0, side_m), (side_m, side_m), (side_m, 0)], 1, {}, holes=holes)


def test_the_cost_of_a_step_does_not_grow_with_the_map() -> None:
    sides, costs = (10, 12, 20, 50, 100, 200), []
    for side in sides:
        middle = side / 2 + (0.0 if side in {10, 50} else 1.0)
        start = StartConfig(random=False, x_m=middle, y_m=middle, heading_deg=30.0)
        config = SimulatorConfig(20.0, observation=ObservationConfig(4.0), start=start)
        simulator = Simulator.of(lattice(side), config)
        state = simulator.start(np.random.default_rng(0))
        costs.append(microseconds(lambda: simulator.step(state, "left"), 2000))  # noqa: B023  # called at once
    table = Table(title="Microseconds a step against the side of the map (20 px/m, 5 m; Simulator.step)")
    for side in sides:
        table.add_column(f"{side} m", justify="right")
    table.add_row(*(f"{cost:.1f}" for cost in costs))
    table.caption = f"200 m: {costs[-1] / costs[1]:.2f} times 12 m (asked: 1.3)"
    Console().print(table)
    draw(sides, costs)


def draw(sides: tuple[int, ...], costs: list[float]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.semilogy(sides, np.array(costs) / 1000, "o-", color="#0b6e99", label="PseudoSLAM, a step")
    axes.axhline(GMAPPING_MS, color="#b5651d", linestyle="--", label="gMapping, a processed scan")
    axes.set(xlabel="side of the map (m)", ylabel="milliseconds", ylim=(1e-3, 2e2))
    axes.legend(frameon=False, loc="center right")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(PICTURE, dpi=150)


@needs_shared
def test_resets(houses: list[FloorPlan]) -> None:
    table = Table(title="A reset, rasters cached, milliseconds (medians of 50)")
    for heading in ("environment", "house", "ms"):
        table.add_column(heading, justify="right" if heading == "ms" else "left")
    big = lattice(20.0)
    for name, plan in (("exploration", houses[1]), ("exploration", big), ("obstacle avoidance", None)):
        kwargs = arguments(name, "sector", [plan] if plan else [])
        env = gymnasium.make(id_of(name), **kwargs)
        env.reset(seed=0)
        found = []
        for _ in range(50):
            start = time.perf_counter()
            env.reset()
            found.append(time.perf_counter() - start)
        table.add_row(name, plan.id[:12] if plan else "the paper's room", f"{1000 * np.median(found):.2f}")
    table.caption = "asked: 1 ms"
    Console().print(table)


def test_cold_start(tmp_path: Path) -> None:
    """The first reset and step in a fresh process: compiled anew, and from the cache."""
    code = (
        "import time; start = time.perf_counter()\n"
        "import gymnasium, houseexpo.pseudoslam\n"
        "env = gymnasium.make('PseudoSLAM/ObstacleAvoidance-v0'); env.reset(seed=0); env.step(0)\n"
        "print(time.perf_counter() - start)"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    times = [
        float(subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True).stdout)
        for _ in range(2)
    ]
    table = Table(title="From nothing to the first step, imports included, seconds")
    table.add_column("once, compiling (asked: 20)", justify="right")
    table.add_column("afterwards (asked: 2)", justify="right")
    table.add_row(*(f"{seconds:.1f}" for seconds in times))
    Console().print(table)
    assert times[1] < times[0]
