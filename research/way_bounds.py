"""Bounds that no explorer can beat: the least way to a share of a house, and the most that a budget can see.

    python -m research.way_bounds DATASET RESULT [NUMBER]

RESULT is a result of any policy on a track without noise, whose plans and starts are taken. Two relaxations:

R1  By single cells: the explorer sees all that can be seen from any place within a way of r metres of its start,
    without going there. For each cell, r is the least way to a place from which its centre is seen.
R2  By regions (``research.region_bounds``): it enters the views of so many regions that the rest is small enough, on
    one way.
R3  The way to a place is at least the straight line, and at least the way over the centres of cells to their eight
    neighbours divided by ``OCTILE``, the most by which it can be longer than a free way.
R4  Places between centres: the way is shortened, and the laser's range lengthened, by the diagonal of a cell.
R5  Cells are judged by each ``EVERY``-th row and column; in large houses by fewer, at most some ``MOST_CELLS``.
R6  A step goes ``step_m`` at most, so a way of r metres takes r / ``step_m`` steps at least; turns take none.

For each way, the share that can be seen is the smaller of both. From this, the track's measures follow as from the
trace of a policy: its result has the name ``bound`` and is written beside RESULT, and ``benchmark compare`` shows how
far policies are from it. People only hide cells, so the bounds hold with people. They do not hold with noise: a map
that drifts shows cells that were not seen. With a NUMBER, the means over so many plans are printed and nothing is
written.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from rich.console import Console

from houseexpo import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.comparison import BOUND
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, curve_sample_points
from houseexpo.pseudoslam.benchmark.measures import MEAN_DIGITS, StepsToCoverage, Trace
from houseexpo.pseudoslam.benchmark.result import PolicyRecord, read_result, write_result
from houseexpo.pseudoslam.benchmark.run import make_result, make_run_times
from houseexpo.pseudoslam.benchmark.tracks import Track, find_track
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.kernels.types import NO_WAY, new_path_scratch
from houseexpo.pseudoslam.worlds.world import World
from research.region_bounds import find_views, region_way_px

Floats = npt.NDArray[np.float64]
EVERY: Final = 7
SIDE: Final = 3
MOST_CELLS: Final = 5000
OCTILE: Final = 1.0 / math.cos(math.pi / 8)
SHARES: Final = (0.5, 0.7, 0.8, 0.9, 0.95, 0.99)
"""The shares for which ways are bounded by regions; on tracks that measure ways to shares, these shares."""


def bounds_m(
    world: World, x: float, y: float, radius_m: float, range_m: float, shares: tuple[float, ...] = SHARES
) -> tuple[Floats, Floats]:
    """Return ways in metres (n,), ascending from 0, and the share of the house that a way of each length can see (n,).

    The explorer starts at (x, y), pixels. ``shares`` are those for which regions are chosen.
    """
    ppm, diagonal = world.frame.pixels_per_metre, math.sqrt(2.0)
    ways_px = _ways_px(world, x, y, radius_m * ppm)
    coarser = math.ceil(math.sqrt(np.count_nonzero(world.observable) / EVERY**2 / MOST_CELLS))  # R5
    views = find_views(world, ways_px, range_m * ppm + diagonal, SIDE * coarser, EVERY * coarser)
    away_m = np.sort(np.maximum(views.away_px - diagonal, 0.0)) / ppm  # R4
    stands = np.isfinite(ways_px).reshape(world.occupied.shape)
    ways_m = np.array([region_way_px(views, stands, x, y, share) for share in shares]) / ppm
    ways_m = np.maximum.accumulate(ways_m)
    at = np.unique(np.concatenate([[0.0], away_m[np.isfinite(away_m)], ways_m]))
    seen = np.searchsorted(away_m, at, side="right") / len(away_m)
    limits = np.append(shares, 1.0)[np.searchsorted(ways_m, at, side="right")]  # less than the first share not reached
    limits = np.where(limits < 1.0, limits - 1e-9, 1.0)
    return at, np.minimum(seen, limits)


def _ways_px(world: World, x: float, y: float, radius_px: float) -> Floats:
    """Return a lower bound of the way to each cell, flat (R3), infinite where the robot cannot be."""
    house = np.where(world.occupied != 0, OBSTACLE, FREE).astype(np.uint8)
    known = new_path_scratch(house.size)
    find_distances(house, x, y, radius_px, -1, known)
    ways = known.ways[: house.size].astype(np.float64)
    rows, cols = np.divmod(np.arange(house.size), house.shape[1])
    straight = np.hypot(cols + 0.5 - x, rows + 0.5 - y)
    found: Floats = np.maximum(ways / STRAIGHT / OCTILE, straight)
    found[(ways < 0) | (ways >= NO_WAY)] = np.inf
    return found


def trace_of(world: World, x: float, y: float, config: SimulatorConfig, shares: tuple[float, ...] = SHARES) -> Trace:
    """Return the bounds of a house as the trace of an explorer, by R6."""
    trace = Trace()
    ways_m, seen = bounds_m(world, x, y, config.robot.radius_m, config.laser.range_m, shares)
    for way, share in zip(ways_m.tolist(), seen.tolist(), strict=True):
        trace.add(math.ceil(way / config.robot.step_m - 1e-9), way, {"coverage": share, "collisions": 0})
    return trace


def outcome_of(track: Track, case: Case, trace: Trace) -> EpisodeOutcome:
    """Return the track's measures of a bound; whether a share is reached, and what a bound lacks, have no value."""
    found = track.measure(trace)
    values = {key: None if value is None else round(value, MEAN_DIGITS) for key, value in found.items()}
    lacks = {key for key in values if key.startswith("reached_")} | {"collisions", "coverage", "steps", "metres"}
    curves = {over: trace.coverage_at(over, curve_sample_points(most)).tolist() for over, most in track.curves}
    return EpisodeOutcome(case, values | dict.fromkeys(lacks), curves)


def main() -> None:
    """Write the bounds for all plans of a result, or print the means over some of them beside the result's own.

    The command's arguments are DATASET RESULT [NUMBER].
    """
    file = Path(sys.argv[2])
    like, number = read_result(file), int(sys.argv[3]) if len(sys.argv) > 3 else None
    track, start = find_track(like.track_id), time.perf_counter()
    if track.task != "exploration" or track.config.noise.any or track.slam:
        raise ConfigError(f"{file}: expected a track of exploration without noise, found {track.id}")
    shares = tuple(s / 100 for s in track.measure.shares) if isinstance(track.measure, StepsToCoverage) else SHARES
    cases = list(map(Case, like.episodes["plan"], like.episodes["seed"]))[:number]
    env = ExplorationEnv(open_dataset(sys.argv[1]).only([case.plan_id for case in cases]), track.config)
    outcomes = []
    for case in show_progress(cases, BOUND, len(cases)):
        env.reset(seed=case.seed, options={"plan_id": case.plan_id})
        x, y = env.state.pose_px[:2].tolist()
        outcomes.append(outcome_of(track, case, trace_of(env.simulator.world, x, y, track.config, shares)))
    for metric in track.metrics:
        pairs = [
            (one, other)
            for one, other in zip([each.values[metric.key] for each in outcomes], like.column(metric.key), strict=False)
            if one is not None and other is not None
        ]
        if pairs:
            one, other = np.mean(pairs, axis=0).tolist()
            text = f"{metric.key}: {BOUND} {one:.3f}, {like.policy.name} {other:.3f}, {len(pairs)} plans"
            Console(width=160).print(text, highlight=False)
    if number is None:
        policy = PolicyRecord(BOUND, "research.way_bounds", "", 0, True, "discrete", "map")
        times = make_run_times(outcomes, time.perf_counter() - start, 1)
        result = make_result(track, policy, like.plans, outcomes, times)
        write_result(result, file.with_name(f"{track.id}-{BOUND}.json"))


if __name__ == "__main__":
    main()
