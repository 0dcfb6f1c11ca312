"""Runs of PseudoSLAM that benchmarks measure: configurations, robots that keep moving, and how runs take turns.

``straightforward`` is a batched step as one writes it first: every sample of every ray, every pixel of the crop, one
after the other. Its maps are those of the ``rays`` scan, cell by cell.
"""

from __future__ import annotations

import math
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
import numpy.typing as npt
from numba import njit

from houseexpo import FloorPlan
from houseexpo.pseudoslam import LaserConfig, ObservationConfig, Simulator, SimulatorConfig
from houseexpo.pseudoslam.config import ScanRule
from houseexpo.pseudoslam.envs.episode_batch import EpisodeBatch
from houseexpo.pseudoslam.kernels.collision import free_distance
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams, slice_episode
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid
from houseexpo.pseudoslam.step_kernels import make_step_params
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


def batch_of(config: SimulatorConfig, houses: list[FloorPlan]) -> EpisodeBatch:
    rng, params = np.random.default_rng(0), make_step_params(config)
    batch = EpisodeBatch(N, config, params, threads=1)
    simulators = [Simulator.of(house, config) for house in houses]
    for i in range(N):
        batch.put(i, simulators[i % len(houses)].start(rng))
    return batch


def kernel_run(
    config: SimulatorConfig, houses: list[FloorPlan], step: Callable[[EpisodeBatch, np.ndarray], None], steps: int = 60
) -> Callable[[], int]:
    batch, rng = batch_of(config, houses), np.random.default_rng(0)
    turn, way = np.array([np.radians(10.0), 0.0]), np.array([0.0, 0.3 * config.pixels_per_metre])

    def run() -> int:
        for _ in range(steps):
            turns = (batch.arrays.counts["blocked"][:, 0] != 0) | (rng.random(N) > 0.8)
            step(batch, np.where(turns[:, None], turn, way))
        return N * steps

    return run


@njit
def straightforward(pool: Episode, sizes: Counts, motions: Floats, params: StepParams) -> None:
    """Turn, go, scan, crop: one environment after the other."""
    for i in range(len(sizes)):
        episode = slice_episode(pool, sizes, i)
        pose, sensor = episode.pose, params.sensor
        pose.heading += motions[i, 0]
        if pose.heading > math.pi:
            pose.heading -= 2.0 * math.pi
        right, down = math.cos(pose.heading), -math.sin(pose.heading)
        way = motions[i, 1]
        if way > 0:
            way = free_distance(episode.occupied, pose.x, pose.y, right, down, way, params.robot.radius_px)
        episode.counts.blocked = 1 if way < motions[i, 1] else 0
        pose.x += way * right
        pose.y += way * down
        scan(episode, sensor.fan_cos, sensor.fan_sin, sensor.range_px)
        crop(episode.known, pose.x, pose.y, pose.heading, episode.shown)


@njit
def scan(episode: Episode, fan_cos: Floats, fan_sin: Floats, range_px: float) -> None:
    """Follow each ray by unit pixels up to the first obstacle, and draw it."""
    occupied, observable, known = episode.occupied, episode.observable, episode.known
    pose, counts = episode.pose, episode.counts
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    for i in range(len(fan_cos)):
        right, up = fan_cos[i] * cos - fan_sin[i] * sin, fan_sin[i] * cos + fan_cos[i] * sin
        for k in range(int(np.rint(range_px)) + 1):
            row, col = int(np.rint(pose.y - 0.5 - k * up)), int(np.rint(pose.x - 0.5 + k * right))
            if not (0 <= row < occupied.shape[0] and 0 <= col < occupied.shape[1]):
                break
            if known[row, col] == UNKNOWN:
                counts.known += 1
                counts.covered += observable[row, col]
            if occupied[row, col] != 0:
                known[row, col] = OBSTACLE
                break
            known[row, col] = FREE


@njit
def crop(known: Grid, x: float, y: float, heading: float, out: npt.NDArray[np.uint8]) -> None:
    """Take the nearest cell for each pixel of the view."""
    side = len(out)
    cos, sin = math.cos(heading), math.sin(heading)
    for i in range(side):
        for j in range(side):
            ahead, right = (side - 1) / 2 - i, j - (side - 1) / 2
            row, col = math.floor(y - ahead * sin + right * cos), math.floor(x + ahead * cos + right * sin)
            inside = 0 <= row < known.shape[0] and 0 <= col < known.shape[1]
            out[i, j] = known[row, col] if inside else UNKNOWN
