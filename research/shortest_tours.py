"""The shortest way on which an explorer that knows the house sees a share of it, on a lattice: exact, or an interval.

    python -m research.shortest_tours DATASET [NUMBER]

It is a watchman route with a share (Chin and Ntafos, 1988, for all of a polygon). The assumptions:

A1  The robot moves between nodes: its start, and in each square of ``STEP_M`` the place nearest to its middle. From a
    node it goes to those of the same and of the eight squares around, on the straight line or, where its disc does not
    pass, on the shortest way of the simulator's planner. A way off these nodes may be shorter.
A2  At each node it sees all round, as far as its laser reaches: a turn on the spot is no way. Between nodes it sees
    nothing. Cells are judged by each ``EVERY``-th row and column.

A* over (node, seen cells) finds the shortest way. From a node, the way still to go is at least the radius within which
all nodes together see enough; this bound never exceeds the truth and is consistent. A label is dropped if another one
at its node has seen at least as much on a way that is not longer. After ``MOST_LABELS`` labels, the least bound of
those that are left is a lower bound, and a way by A* with a weighted bound is an upper one.
"""

from __future__ import annotations

import heapq
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from rich.console import Console
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from houseexpo import open_dataset
from houseexpo.pseudoslam.agents.explorers import distances_to_cells
from houseexpo.pseudoslam.benchmark.cases import make_cases, read_test_ids
from houseexpo.pseudoslam.benchmark.result import read_result
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import new_path_scratch
from houseexpo.pseudoslam.worlds.world import World, new_scan_buffers

STEP_M: Final = 0.5
EVERY: Final = 3
MOST_LABELS: Final = 20_000
MOST_NODES: Final = 220
SHARES: Final = (90, 95, 99)
WEIGHTS: Final = (6.0, 2.0, 1.0)
"""Of the bound in the searches, one after the other; with 1 the way that is found is the shortest."""
MOST_DETOUR: Final = 3.0
"""In steps: neighbours are those to which the way is not longer."""
RESULTS: Final = Path(__file__).parents[1] / "docs" / "leaderboard"

Node = tuple[int, int]


class Bounds(NamedTuple):
    """The shortest way is at least ``low`` and at most ``high`` metres; both are inf if the share cannot be seen."""

    low: float
    high: float

    @property
    def exact(self) -> bool:
        """Whether the two are equal."""
        return self.high - self.low < 1e-9


@dataclass(frozen=True)
class Lattice:
    """Nodes with their neighbours and views; the start is node 0.

    Parameters
    ----------
    edges
        For each node its neighbours and the lengths to them, metres.
    views
        For each node the cells that it sees, as bits of a whole number.
    cells
        Number of cells that count.
    """

    edges: list[list[tuple[int, float]]]
    views: list[int]
    cells: int


def lattice_of(world: World, start: Node, radius_m: float, range_m: float, step_m: float = STEP_M) -> Lattice:
    """Return the lattice of a house through a start (row, col) where the robot can stand (A1, A2)."""
    ppm = world.frame.pixels_per_metre
    step = round(step_m * ppm)
    nodes = [start, *(node for node in _middles(world.traversable != 0, step) if node != start)]
    cells = np.array([row * world.occupied.shape[1] + col for row, col in nodes])
    house = np.where(world.occupied != 0, OBSTACLE, FREE).astype(np.uint8)
    known = new_path_scratch(house.size)
    edges: list[list[tuple[int, float]]] = []
    for row, col in nodes:
        find_distances(house, col + 0.5, row + 0.5, radius_m * ppm, -1, known)
        ways = distances_to_cells(known, cells) / STRAIGHT
        straight = [math.hypot(row - other[0], col - other[1]) for other in nodes]
        beside = [max(abs(row // step - a // step), abs(col // step - b // step)) <= 1 for a, b in nodes]
        edges.append(
            [
                (j, (straight[j] if _passes(world.traversable != 0, (row, col), nodes[j]) else ways[j].item()) / ppm)
                for j in range(len(nodes))
                if beside[j] and nodes[j] != (row, col) and ways[j] <= MOST_DETOUR * step
            ]
        )
    counted = np.zeros(world.occupied.shape, bool)
    counted[::EVERY, ::EVERY] = world.observable[::EVERY, ::EVERY] != 0
    views = [_view(world, node, range_m * ppm, counted) for node in nodes]
    return Lattice(edges, views, int(np.count_nonzero(counted)))


def _middles(stands: npt.NDArray[np.bool_], step: int) -> list[Node]:
    """Return the standing cell nearest to the middle of each square of ``step`` cells that has one."""
    best: dict[Node, tuple[float, Node]] = {}
    for row, col in np.argwhere(stands).tolist():
        off = (row % step + 0.5 - step / 2) ** 2 + (col % step + 0.5 - step / 2) ** 2
        square = row // step, col // step
        best[square] = min(best.get(square, (math.inf, (0, 0))), (off, (row, col)))
    return [node for _, node in best.values()]


def _passes(stands: npt.NDArray[np.bool_], one: Node, other: Node) -> bool:
    """Return whether the robot's disc passes on the straight line between two cells."""
    number = max(abs(other[0] - one[0]), abs(other[1] - one[1])) + 1
    line = np.linspace(one, other, number).round().astype(int)
    return bool(stands[line[:, 0], line[:, 1]].all())


def _view(world: World, node: Node, range_px: float, counted: npt.NDArray[np.bool_]) -> int:
    """Return the counted cells that are seen from the centre of a cell, as bits."""
    runs, hit, slopes = new_scan_buffers(range_px)
    occupied = world.occupied.copy()  # the kernel is compiled for arrays that can be written
    n_runs, _ = sector_scan(occupied, node[1] + 0.5, node[0] + 0.5, 0.0, math.pi, range_px, runs, hit, slopes)
    seen = np.zeros(occupied.size, bool)
    for first, last in runs[:n_runs]:
        seen[first : last + 1] = True
    return int.from_bytes(np.packbits(seen[counted.ravel()]).tobytes())


def shortest_way(lattice: Lattice, share: float, most_labels: int = MOST_LABELS) -> Bounds:
    """Return bounds of the shortest way on a lattice from its start on which a share (0 to 1) of the cells is seen."""
    target = math.ceil(share * lattice.cells - 1e-9)
    reach, rings = _rings(lattice)
    if rings[0][-1].bit_count() < target:
        return Bounds(math.inf, math.inf)

    def still(node: int, seen: int) -> float:
        """Return the least radius around a node within which all nodes together see enough."""
        low, high, ring = 0, len(reach[node]) - 1, rings[node]
        if seen.bit_count() >= target:
            return 0.0
        while low < high:
            middle = (low + high) // 2
            if (seen | ring[middle]).bit_count() >= target:
                high = middle
            else:
                low = middle + 1
        return reach[node][low]

    low, high = 0.0, math.inf
    for weight in WEIGHTS:
        found, bound = _search(lattice, target, still, weight, most_labels, high)
        high = min(high, found)
        low = max(low, min(bound, high))
    return Bounds(low, high)


def _search(
    lattice: Lattice, target: int, still: Callable[[int, int], float], weight: float, most: int, known: float
) -> tuple[float, float]:
    """Return the length of the way that is found, inf if none, and a lower bound of the shortest one.

    Parameters
    ----------
    still
        A function from a node and the seen cells to a lower bound of the way still to go.
    weight
        The weight of that bound; only with 1 is the way the shortest one, and is there a lower bound, else 0.
    known
        The length of a way that is known already; longer ones are not searched.
    """
    number = count()
    start = lattice.views[0]
    open_now = [(weight * still(0, start), next(number), 0.0, 0, start)]
    kept: list[list[tuple[float, int]]] = [[] for _ in lattice.edges]
    while open_now:
        value, tried, length, node, seen = heapq.heappop(open_now)
        if seen.bit_count() >= target:
            return length, length if weight == 1.0 else 0.0
        if tried > most:
            return math.inf, value if weight == 1.0 else 0.0
        if any(
            other <= length and seen | more == more for other, more in kept[node] if (other, more) != (length, seen)
        ):
            continue
        for neighbour, way in lattice.edges[node]:
            further, sees = length + way, seen | lattice.views[neighbour]
            labels = kept[neighbour]
            if any(other <= further + 1e-9 and sees | more == more for other, more in labels):
                continue
            if further + (bound := still(neighbour, sees)) >= known - 1e-9:
                continue
            labels[:] = [(other, more) for other, more in labels if other < further or sees | more != sees]
            labels.append((further, sees))
            heapq.heappush(open_now, (further + weight * bound, next(number), further, neighbour, sees))
    return known, known if weight == 1.0 else 0.0


def _rings(lattice: Lattice) -> tuple[list[list[float]], list[list[int]]]:
    """Return for each node the distances of all nodes in ascending order, and what all nodes up to each of them see."""
    n = len(lattice.edges)
    triples = [(i, j, way) for i, edges in enumerate(lattice.edges) for j, way in edges] or [(0, 0, 0.0)]
    rows, cols, ways = map(np.array, zip(*triples, strict=True))
    away = dijkstra(csr_array((ways, (rows, cols)), shape=(n, n)))
    reach, rings = [], []
    for i in range(n):
        order = np.argsort(away[i], kind="stable")
        reach.append(away[i][order].tolist())
        ring, sees = [], 0
        for j in order.tolist():
            sees |= lattice.views[j]
            ring.append(sees)
        rings.append(ring)
    return reach, rings


def _print(*cells: str) -> None:
    Console(width=160).print(*cells, highlight=False)


def main() -> None:
    """Print a table of the bounds beside the ways of explorers, on the first small houses of track ``quality``."""
    plans, number = open_dataset(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 20
    track = find_track("quality")
    found = {path: read_result(RESULTS / f"{track.id}-{path}.json") for path in ("oracle", "chooser", "frontier")}
    ids = [name for name in read_test_ids()[: found["oracle"].plans.number] if name in plans]
    small = [name for name in ids if plans[name].area < MOST_NODES * STEP_M**2][:number]
    env = ExplorationEnv(plans.only(small), track.config)
    rows: dict[int, list[tuple[float, ...]]] = {share: [] for share in SHARES}
    for case in make_cases(track.id, small):
        env.reset(seed=case.seed, options={"plan_id": case.plan_id})
        x, y = env.state.pose_px[:2].tolist()
        lattice = lattice_of(
            env.simulator.world, (int(y), int(x)), track.config.robot.radius_m, track.config.laser.range_m
        )
        at = found["oracle"].episodes["plan"].index(case.plan_id)
        for share in SHARES:
            bounds = shortest_way(lattice, share / 100)
            ways = [result.column(f"metres_to_{share}")[at] for result in found.values()]
            rows[share].append((bounds.low, bounds.high, *(math.nan if way is None else way for way in ways)))
            _print(case.plan_id[:8], f"{len(lattice.views)} {share}", *(f"{v:.2f}" for v in rows[share][-1]))
    for share, values in rows.items():
        table = np.array(values)
        table = table[np.isfinite(table[:, [0, 2, 3, 4]]).all(axis=1)]
        table[:, 1] = np.where(np.isinf(table[:, 1]), table[:, 2:].min(axis=1), table[:, 1])  # a way that was gone
        exact = int((table[:, 1] - table[:, 0] < 1e-9).sum())
        _print(f"{share}%: {len(table)} houses, {exact} exact:", *(f"{v:.2f}" for v in table.mean(axis=0)))


if __name__ == "__main__":
    main()
