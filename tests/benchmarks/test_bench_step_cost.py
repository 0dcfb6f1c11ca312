"""What a step costs: a scan with its map, the size of the map, resets, the cold start.

Then what a step costs with each kind of observation (64 environments in published houses, one thread, prepared worlds),
and how many pairs of maps ``houseexpo observe`` makes per second from published plans (asked: a million per hour).
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan, open_dataset
from houseexpo.processes import count_cores
from houseexpo.pseudoslam import ObservationConfig, Simulator, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.io.pair_shards import write_pair_shards
from houseexpo.pseudoslam.io.pairs import USUAL_NOISE, PairConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, merge_cells, merge_runs
from houseexpo.pseudoslam.kernels.planning.goal_paths import DONE
from houseexpo.pseudoslam.kernels.sensing.rays import merge_ray_scan
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.worlds.world import new_scan_buffers
from tests.benchmarks.vector_runs import GMAPPING_MS, PICTURE, RUNS, arguments, id_of
from tests.builders.scans import UNASKED
from tests.builders.shared import DATA, needs_shared


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
    runs, hit, slopes = new_scan_buffers(100.0)
    for plan in houses:
        world = Simulator.of(plan, SimulatorConfig(20.0)).world
        cells = (np.random.default_rng(0).choice(np.argwhere(world.traversable), 500) + 0.5).tolist()
        known, observable, occupied = np.zeros_like(world.occupied), world.observable.copy(), world.occupied.copy()

        def sector(cells=cells, known=known, observable=observable, occupied=occupied) -> None:
            for y, x in cells:
                n_runs, n_hit = sector_scan(occupied, x, y, x + y, np.pi / 2, 100.0, runs, hit, slopes)
                merge_runs(known, observable, runs, n_runs, FREE, UNASKED)
                merge_cells(known, observable, hit, n_hit, OBSTACLE, UNASKED)

        def rays(cells=cells, known=known, observable=observable, occupied=occupied) -> None:
            for y, x in cells:
                *_, n_hit = merge_ray_scan(
                    occupied, observable, known, x, y, x + y, fan_cos, fan_sin, 100.0, hit, True, UNASKED
                )
                merge_cells(known, observable, hit, n_hit, OBSTACLE, UNASKED)

        one, other = (microseconds(call, 4) / len(cells) for call in (sector, rays))
        table.add_row(f"{plan.area:.0f}", f"{one:.1f}", f"{other:.1f}", f"{1000 * GMAPPING_MS / one:,.0f}")
        assert known.any()
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

    def first_step(cache: Path) -> float:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
        command = [sys.executable, "-c", code]
        return float(subprocess.run(command, env=environment, capture_output=True, check=True).stdout)

    times = np.array([[first_step(tmp_path / f"{run}") for _ in range(2)] for run in range(3)])
    table = Table(title="From nothing to the first step, imports included, seconds (medians of 3 that took turns)")
    for heading in ("once, compiling (asked: 12)", "afterwards (asked: 1.5)"):
        table.add_column(heading, justify="right")
    table.add_row(*(f"{seconds:.1f}" for seconds in np.median(times, axis=0)))
    Console().print(table)
    assert (times[:, 1] < times[:, 0]).all()


ENVS, STEPS, ROUNDS = 64, 100, 7
OBSERVATIONS: dict[str, dict[str, Any]] = {
    "map, 100 x 100": {},
    "dict": {"observation": "dict"},
    "scales, 4 x 100 x 100": {"observation": "scales"},
    "view-10m, 64 x 64": {"config": "view-10m"},
    "view-10m, scales, 4 x 64 x 64": {"config": "view-10m", "observation": "scales"},
    "round-10m, 80 x 80": {"config": "round-10m"},
    "round-10m, scales, 4 x 80 x 80": {"config": "round-10m", "observation": "scales"},
}


def test_steps_a_second_of_each_observation(houses: list[FloorPlan]) -> None:
    """In many environments, and in one alone."""
    alone = {
        name: gymnasium.make("PseudoSLAM/Exploration-v0", dataset=houses, success_coverage=None, **given)
        for name, given in OBSERVATIONS.items()
    }
    envs = {
        name: gymnasium.make_vec(
            "PseudoSLAM/Exploration-v0", ENVS, dataset=houses, threads=1, success_coverage=None, **given
        )
        for name, given in OBSERVATIONS.items()
    }
    speeds: dict[str, list[float]] = {name: [] for name in OBSERVATIONS}
    for env in envs.values():
        env.reset(seed=0)
    for _ in range(ROUNDS + 1):  # the first one makes houses
        for name, env in envs.items():
            blocked, rng = np.zeros(ENVS, bool), np.random.default_rng(0)
            start = time.process_time()
            for turns in rng.random((STEPS, ENVS)) > 0.8:
                *_, info = env.step((turns | blocked).astype(np.int64))
                blocked = info["collided"]
            speeds[name].append(ENVS * STEPS / (time.process_time() - start))
    by_itself = {name: [] for name in OBSERVATIONS}
    for round_ in range(ROUNDS + 1):
        for name, env in alone.items():
            by_itself[name].append(1e6 / step_us(env, round_))
    title = f"Exploration, 25 px/m, one thread, steps a second: {ENVS} environments and one alone"
    table = Table("observation", f"{ENVS}", "alone", title=title)
    for name, found in speeds.items():
        table.add_row(name, f"{median(found[1:]):,.0f}", f"{median(by_itself[name][1:]):,.0f}")
    Console().print(table)


def step_us(env: Any, seed: int, pose: tuple[float, float, float] | None = None) -> float:
    """Microseconds of processor time for each of 400 steps of a robot that keeps moving."""
    env.reset(seed=seed, options={"pose": pose} if pose else None)
    rng, blocked = np.random.default_rng(seed), False
    start = time.process_time()
    for turn in rng.random(400) > 0.8:
        *_, ended, _, info = env.step(int(turn or blocked))
        blocked = info["collided"]
        assert not ended
    return (time.process_time() - start) / 400 * 1e6


def reset_ms(env: Any, pose: tuple[float, float, float] | None) -> float:
    start = time.process_time()
    env.reset(options={"pose": pose} if pose else None)
    return (time.process_time() - start) * 1e3


def hall_in_a_map(side_m: float, hall_m: float = 12.0) -> FloorPlan:
    """The hall ``lattice(hall_m)`` in a map of ``side_m``: a passage of 1 m leads from its corner to the far one."""
    hall, least, most = lattice(hall_m), hall_m - 1.0, side_m - 1.0
    if side_m == hall_m:
        return hall
    outline = [(0, 0), (0, hall_m), (least, hall_m), (least, side_m), (side_m, side_m), (side_m, most), (hall_m, most)]
    return FloorPlan(f"hall-in-{side_m:g}", [*outline, (hall_m, 0)], 1, {}, holes=hall.holes)


def test_no_observation_costs_more_in_a_larger_map() -> None:
    """The same hall in a map of 12 m and in one of 160 m, so that the robot sees the same; the two take turns."""
    table = Table(
        "observation", "step, us", "ratio (asked: 1.2)", "reset, ms", "ratio (asked: 3)",
        title="Processor time in a hall of 12 m, in maps of 12 m and of 160 m, 25 px/m (medians)",
    )  # fmt: skip
    pose = (7.0, 7.0, 0.5)
    for name, given in {"dict, view-10m": {"config": "view-10m", "observation": "dict"}, **OBSERVATIONS}.items():
        envs = [
            gymnasium.make(
                "PseudoSLAM/Exploration-v0",
                dataset=hall_in_a_map(side),
                success_coverage=None,
                max_episode_steps=10**6,
                **given,
            )
            for side in SIDES_M
        ]
        steps = np.array([[step_us(env, seed, pose) for env in envs] for seed in range(2 * ROUNDS + 1)])[1:]
        resets = np.array([[reset_ms(env, pose) for env in envs] for _ in range(30)])[5:]
        table.add_row(name, *in_turns(steps, 0), *in_turns(resets, 2))
    Console(width=120).print(table)


SIDES_M = (12.0, 160.0)


def in_turns(found: npt.NDArray[np.float64], digits: int) -> tuple[str, str]:
    """Return the medians of two environments that took turns, and the median of the ratios."""
    one, other = np.median(found, axis=0).tolist()
    return f"{one:.{digits}f}, {other:.{digits}f}", f"{float(np.median(found[:, 1] / found[:, 0])):.2f}"


def test_navigation_in_a_larger_map() -> None:
    """To random goals: in the same hall in a larger map, and in a hall as large as the map."""
    table = Table("", "step, us", "ratio", "reset, ms", "ratio (asked: 3)", "corners, searched of all",
                  title="Navigation, processor time, 12 m and 160 m, 25 px/m (medians)")  # fmt: skip
    for name, make in (("the hall of 12 m in a map of 160 m", hall_in_a_map), ("a hall of 160 m", lattice)):
        envs = [gymnasium.make("PseudoSLAM/Navigation-v0", dataset=make(side)) for side in SIDES_M]
        steps, resets, searched = [], [], []
        for seed in range(60):
            for env in envs:
                env.reset(seed=seed)
            resets.append([reset_ms(env, None) for env in envs])
            done = envs[1].unwrapped.state.episode.paths.ways[:, DONE]
            searched.append((np.isfinite(done).sum(), len(done)))
            steps.append([some_steps_us(env, seed) for env in envs])
        counts = "{:.0f} of {:.0f}".format(*np.mean(searched[10:], axis=0))
        table.add_row(name, *in_turns(np.array(steps[10:]), 0), *in_turns(np.array(resets[10:]), 2), counts)
    Console(width=140).print(table)


def some_steps_us(env: Any, seed: int) -> float:
    """Microseconds of processor time for each of at most 100 steps."""
    rng, blocked, step = np.random.default_rng(seed), False, 0
    start = time.process_time()
    for step, turn in enumerate(rng.random(100) > 0.8, 1):  # noqa: B007  # used below
        *_, ended, _, info = env.step(int(turn or blocked))
        blocked = info["collided"]
        if ended:
            break
    return (time.process_time() - start) / step * 1e6


PUBLISHED = DATA / "houseexpo" / "plans_33717.jsonl.gz"
EACH, PAIRS = 30, 12_000  # a million pairs are 30 of each plan
ASKED = 1_000_000 / 3600
PAIRS_OF = {
    "with rooms": PairConfig(each=EACH),
    "without rooms": PairConfig(each=EACH, rooms=False),
    "with rooms and noise": PairConfig(each=EACH, simulator=SimulatorConfig(noise=USUAL_NOISE)),
}


@needs_shared
def test_pairs_a_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On all cores, unprepared: each house is made when it is visited."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    plans = open_dataset(PUBLISHED)
    write_pair_shards(plans, tmp_path / "warm", PairConfig(each=2), limit=4)  # compiled, and the data set packed
    table = Table(
        "", "pairs/s", "a million, minutes", "bytes a pair", title=f"Pairs of maps, {count_cores()} processes"
    )
    for name, config in PAIRS_OF.items():
        start = time.perf_counter()
        done = write_pair_shards(plans, tmp_path / name, config, limit=PAIRS, seed=1, workers=count_cores())
        rate = done.pairs / (time.perf_counter() - start)
        table.add_row(name, f"{rate:,.0f}", f"{1e6 / rate / 60:.0f}", f"{done.size / done.pairs:,.0f}")
        with np.load(next((tmp_path / name).glob("pairs-*.npz"))) as arrays:
            assert len(arrays["partial"])
    Console().print(table, f"asked: {ASKED:.0f} pairs/s")
