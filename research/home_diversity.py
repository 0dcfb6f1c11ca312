"""How much the plans of a data set differ: graphs, programmes, footprints, nearest neighbours.

    python -m research.home_diversity plans/demo [PLANS]

Graphs have a node for each room, with its label, and an edge for each door between two rooms. Two are alike if their
Weisfeiler-Lehman hashes are (B. Shervashidze et al., JMLR 12, 2011), which may take different graphs for one, and never
one for two. A programme is the labels of a plan with their counts. Two footprints are alike if their outlines have the
same turns (left, right, oblique), read from any corner in either direction. Nearest neighbours are found by the IoU of
free spaces, drawn at 5 px/m with their bounding boxes' centres on each other, over the eight turns and reflections.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import networkx as nx
import numpy as np
import numpy.typing as npt
import shapely
from shapely import contains_xy
from threadpoolctl import threadpool_limits

import houseexpo
from houseexpo.floorplan import FloorPlan

PX_PER_M, SIDE_PX = 5, 128
"""A plan of more than 25.6 m on a side is left out of the nearest neighbours."""
ROUNDS = 3
_SIMPLE_M = 0.25
"""Corners that lie nearer than this to a straight outline do not count: thresholds of doors, noise."""
_BATCH = 256


def graph_hash(plan: FloorPlan) -> str:
    """Return the hash of the labelled graph of rooms and doors."""
    graph = nx.Graph()
    for room in plan.rooms:
        graph.add_node(room.id, label=room.label)
    graph.add_edges_from(door.rooms for door in plan.doors if None not in door.rooms)
    return str(nx.weisfeiler_lehman_graph_hash(graph, node_attr="label", iterations=ROUNDS))


def footprint_word(plan: FloorPlan) -> str:
    """Return the turns of the outline, first in the alphabet of its rotations and reflections: ``LLLL`` is a box."""
    rooms = shapely.union_all([room.polygon.buffer(0.35, join_style="mitre") for room in plan.rooms])
    whole = max(shapely.get_parts(rooms.buffer(-0.35, join_style="mitre")), key=shapely.area)
    ring = shapely.get_coordinates(shapely.simplify(whole.exterior, _SIMPLE_M))[:-1]
    steps = np.diff(ring, axis=0, append=ring[:1])
    one, other = np.roll(steps, 1, axis=0), steps
    angles = np.degrees(np.arctan2(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0], (one * other).sum(axis=1)))
    if not shapely.is_ccw(shapely.linearrings(ring)):
        angles = -angles[::-1]
    turns = "".join(
        ("R" if angle < 0 else "L") if abs(abs(angle) - 90) < 3 else ("r" if angle < 0 else "l") for angle in angles
    )
    return min(word[k:] + word[:k] for word in (turns, turns[::-1]) for k in range(len(turns)))


def raster(plan: FloorPlan) -> npt.NDArray[np.float32] | None:
    """Return the free space as cells (SIDE_PX, SIDE_PX) round its centre; None if it is too large."""
    x1, y1, x2, y2 = plan.free_space.bounds
    if max(x2 - x1, y2 - y1) * PX_PER_M > SIDE_PX:
        return None
    along = (np.arange(SIDE_PX) + 0.5 - SIDE_PX / 2) / PX_PER_M
    xs, ys = np.meshgrid((x1 + x2) / 2 + along, (y1 + y2) / 2 + along)
    return np.asarray(contains_xy(plan.free_space, xs, ys), np.float32)


def nearest_ious(cells: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
    """Return for each plan (n, SIDE_PX, SIDE_PX) the largest IoU with another, over turns and reflections."""
    count = len(cells)
    flat, area = cells.reshape(count, -1), cells.sum(axis=(1, 2))
    best = np.zeros(count)
    for flip in (cells, cells[:, :, ::-1]):
        for turns in range(4):
            turned = np.rot90(flip, turns, axes=(1, 2)).reshape(count, -1)
            for start in range(0, count, _BATCH):
                part = slice(start, start + _BATCH)
                both = flat[part] @ turned.T
                iou = both / (area[part, None] + area[None, :] - both)
                iou[np.arange(len(iou)), start + np.arange(len(iou))] = 0.0
                best[part] = np.maximum(best[part], iou.max(axis=1))
    return best


def main() -> None:
    """Print the figures."""
    plans = houseexpo.open_dataset(Path(sys.argv[1]))
    ids = plans.ids[: int(sys.argv[2])] if len(sys.argv) > 2 else plans.ids
    graphs: Counter[str] = Counter()
    programmes: Counter[tuple[tuple[str, int], ...]] = Counter()
    footprints: Counter[str] = Counter()
    drawn = []
    for name in ids:
        plan = plans[name]
        graphs[graph_hash(plan)] += 1
        programmes[tuple(sorted(Counter(room.label for room in plan.rooms).items()))] += 1
        footprints[footprint_word(plan)] += 1
        cells = raster(plan)
        drawn += [] if cells is None else [cells]
    with threadpool_limits(limits=1):
        shares = np.percentile(nearest_ious(np.array(drawn)), (5, 50, 95, 100)).round(3).tolist()
    lines = [
        f"plans {len(ids)}, of these compared by IoU {len(drawn)}",
        f"adjacency graphs {len(graphs)}, programmes {len(programmes)}, footprints {len(footprints)}",
        f"the commonest graph has {max(graphs.values())} plans, the commonest footprint {max(footprints.values())}",
        f"IoU with the nearest other plan, 5 / 50 / 95 / 100%: {shares}",
    ]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
