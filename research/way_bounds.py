"""A lower bound of the way on which an explorer sees a share of a house, for each plan of track ``quality``.

    python -m research.way_bounds DATASET [NUMBER]

A relaxation: the explorer sees all that can be seen from any place within a way of r metres of its start, without
going there. The bound is the least r within which a share of the cells that count is seen. For each cell, r is the
least way to a place from which its centre is seen, so one scan a cell is enough: who sees is seen.

R1  The way to a place is at least the straight line, and at least the way over the centres of cells to their eight
    neighbours divided by ``OCTILE``, the most by which it can be longer than a free way.
R2  Places between centres: the way is shortened, and the laser's range lengthened, by the diagonal of a cell.
R3  Cells are judged by each ``EVERY``-th row and column.

The bound takes the part that is farthest away and not the ways between parts, so that it is low in houses with many
arms. The result is written to ``docs/leaderboard`` like that of a policy of the name ``bound``, and ``benchmark
compare`` shows the share of it in each row. With a NUMBER, the means over so many plans are printed and nothing is
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
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.benchmark.cases import make_cases
from houseexpo.pseudoslam.benchmark.comparison import BOUND
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome
from houseexpo.pseudoslam.benchmark.measures import MEAN_DIGITS
from houseexpo.pseudoslam.benchmark.result import PolicyRecord, read_result, write_result
from houseexpo.pseudoslam.benchmark.run import make_result, make_run_times
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import NO_WAY, new_path_scratch
from houseexpo.pseudoslam.worlds.world import World, new_scan_buffers

Floats = npt.NDArray[np.float64]
EVERY: Final = 7
OCTILE: Final = 1.0 / math.cos(math.pi / 8)
SHARES: Final = (90, 95, 99)
RESULTS: Final = Path(__file__).parents[1] / "docs" / "leaderboard"


def bounds_m(world: World, x: float, y: float, radius_m: float, range_m: float) -> dict[int, float]:
    """Return for each share, in percent, the way in metres that no explorer from (x, y), pixels, can undercut."""
    ppm, diagonal = world.frame.pixels_per_metre, math.sqrt(2.0)
    ways = np.append(_ways_px(world, x, y, radius_m * ppm), np.inf)  # the end of the last run
    occupied = world.occupied.copy()  # the kernel is compiled for arrays that can be written
    range_px = range_m * ppm + diagonal  # R2
    runs, hit, slopes = new_scan_buffers(range_px)
    found = []
    for row, col in np.argwhere(world.observable != 0).tolist():
        if row % EVERY or col % EVERY:
            continue
        n_runs, _ = sector_scan(occupied, col + 0.5, row + 0.5, 0.0, math.pi, range_px, runs, hit, slopes)
        ends = runs[:n_runs].astype(np.int64)
        ends[:, 1] += 1
        found.append(
            np.minimum.reduceat(ways, ends.ravel())[::2].min(initial=ways[row * world.occupied.shape[1] + col])
        )
    away_m = np.sort(np.maximum(np.array(found) - diagonal, 0.0)) / ppm  # R2
    return {share: float(away_m[math.ceil(share / 100 * len(away_m)) - 1]) for share in SHARES}


def _ways_px(world: World, x: float, y: float, radius_px: float) -> Floats:
    """Return a lower bound of the way to each cell, flat (R1), infinite where the robot cannot be."""
    house = np.where(world.occupied != 0, OBSTACLE, FREE).astype(np.uint8)
    known = new_path_scratch(house.size)
    find_distances(house, x, y, radius_px, -1, known)
    ways = known.ways[: house.size].astype(np.float64)
    rows, cols = np.divmod(np.arange(house.size), house.shape[1])
    straight = np.hypot(cols + 0.5 - x, rows + 0.5 - y)
    found: Floats = np.maximum(ways / STRAIGHT / OCTILE, straight)
    found[(ways < 0) | (ways >= NO_WAY)] = np.inf
    return found


def main() -> None:
    """Write the bounds of all plans of the results of the oracle, or print the means over some of them."""
    track = find_track("quality")
    others = {name: read_result(RESULTS / f"{track.id}-{name}.json") for name in ("oracle", "chooser", "frontier")}
    oracle, plans, start = others["oracle"], open_dataset(sys.argv[1]), time.perf_counter()
    ids = oracle.episodes["plan"][: int(sys.argv[2]) if len(sys.argv) > 2 else None]
    env = ExplorationEnv(plans.only(ids), track.config)
    outcomes = []
    for case in show_progress(make_cases(track.id, ids), "bounds", len(ids)):
        env.reset(seed=case.seed, options={"plan_id": case.plan_id})
        x, y = env.state.pose_px[:2].tolist()
        found = bounds_m(env.simulator.world, x, y, track.config.robot.radius_m, track.config.laser.range_m)
        values: dict[str, float | None] = dict.fromkeys(oracle.episodes.keys() - {"plan", "seed"})
        values |= {f"metres_to_{share}": round(way, MEAN_DIGITS) for share, way in found.items()}
        outcomes.append(EpisodeOutcome(case, values))
    columns = {BOUND: {f"metres_to_{s}": [one.values[f"metres_to_{s}"] for one in outcomes] for s in SHARES}}
    columns |= {name: {key: result.column(key) for key in columns[BOUND]} for name, result in others.items()}
    for key in columns[BOUND]:
        rows = np.array([columns[name][key][: len(ids)] for name in columns], np.float64)
        means = rows[:, np.isfinite(rows).all(axis=0)].mean(axis=1)
        Console(width=160).print(key, *(f"{name} {mean:.1f}" for name, mean in zip(columns, means, strict=True)))
    if len(sys.argv) > 2:
        return
    policy = PolicyRecord(BOUND, "research.way_bounds", "", 0, True, "discrete", "map")
    result = make_result(
        track, policy, oracle.plans, outcomes, make_run_times(outcomes, time.perf_counter() - start, 1)
    )
    write_result(result, RESULTS / f"{track.id}-{BOUND}.json")


if __name__ == "__main__":
    main()
