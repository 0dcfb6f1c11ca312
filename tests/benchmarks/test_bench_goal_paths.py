"""How long the simulator's paths to a goal are, against exact ones, in published plans.

Three exact lengths are compared: that of a disc among the cells that the simulator has, that of a disc between the
plan's own walls, and the library's (``plan.shortest_path``), which straightens these walls.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan, open_dataset
from houseexpo.pseudoslam.kernels.planning.goal_paths import find_goal_paths, goal_distance_at
from houseexpo.pseudoslam.worlds.world import make_world
from tests.builders.exact_paths import ARC_SEGMENTS, disc_area, exact_distance
from tests.builders.shared import DATA, needs_shared

PLANS, PAIRS, SEED = 30, 8, 7
SMALLEST_M2, LARGEST_M2 = 25.0, 120.0  # of the plans: the exact search takes minutes in larger ones
RADIUS_M, LEAST_M = 0.2, 1.0


class Lengths(NamedTuple):
    """Lengths of one path, metres."""

    simulator: float
    among_cells: float
    between_walls: float
    library: float


@needs_shared
def test_paths_to_a_goal() -> None:
    table = Table(title=f"Paths of a disc of {RADIUS_M} m in {PLANS} published plans: longer by, %")
    for heading in ("px/m", "of", "than", "paths", "median", "least", "most", "over 1%"):
        table.add_column(heading, justify="right")
    apart: list[npt.NDArray[np.float64]] = []
    for pixels_per_metre in (16.0, 25.0):
        found = np.array(list(_lengths(pixels_per_metre)))
        found = found[np.isfinite(found).all(axis=1)]  # a door that is as wide as the disc may be closed in one of them
        columns = dict(zip(Lengths._fields, found.T, strict=True))
        for one, other in (
            ("simulator", "among_cells"), ("among_cells", "between_walls"), ("library", "between_walls"),
            ("simulator", "library"),
        ):  # fmt: skip
            by = 100 * (columns[one] / columns[other] - 1)
            figures = (f"{value:.2f}" for value in (np.median(by), by.min(), by.max()))
            over = f"{(np.abs(by) > 1).mean():.1%}"
            table.add_row(f"{pixels_per_metre:g}", one, other, str(len(by)), *figures, over)
        apart.append(np.abs(columns["simulator"] / columns["among_cells"] - 1))
    Console(width=120).print(table)
    assert np.concatenate(apart).max() < 0.01


def _lengths(pixels_per_metre: float) -> Iterator[Lengths]:
    plans, rng = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz"), np.random.default_rng(SEED)
    taken, order = 0, rng.permutation(len(plans.ids)).tolist()
    while taken < PLANS:
        plan = plans[plans.ids[order.pop()]]
        if SMALLEST_M2 <= plan.area <= LARGEST_M2:
            yield from _of_plan(plan, pixels_per_metre, rng)
            taken += 1


def _of_plan(plan: FloorPlan, pixels_per_metre: float, rng: np.random.Generator) -> Iterator[Lengths]:
    world, radius_px = make_world(plan, pixels_per_metre, RADIUS_M, 5.0), RADIUS_M * pixels_per_metre
    cells, graph = np.argwhere(world.traversable), world.corner_graph(radius_px)
    among, between = disc_area(world.occupied, radius_px), plan.free_space.buffer(-RADIUS_M, quad_segs=ARC_SEGMENTS)
    for _ in range(PAIRS):
        start, goal = (tuple((cell[::-1] + 0.5).tolist()) for cell in rng.choice(cells, 2))
        if math.dist(start, goal) < LEAST_M * pixels_per_metre:
            continue
        start_m, goal_m = (tuple(world.frame.points_from_pixels(place).tolist()) for place in (start, goal))
        if not shapely.contains_xy(between, [start_m[0], goal_m[0]], [start_m[1], goal_m[1]]).all():
            continue  # nearer to a wall than to its cells
        path = plan.shortest_path(start_m, goal_m, RADIUS_M)
        yield Lengths(
            goal_distance_at(find_goal_paths(graph, *goal), *start) / pixels_per_metre,
            exact_distance(among, start, goal) / pixels_per_metre,
            exact_distance(between, start_m, goal_m),
            path.length if path else math.inf,
        )
