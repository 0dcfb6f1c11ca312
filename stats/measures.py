"""Measures: one plan in, one number out, or one number for each of its rooms or doors.

What only rooms and doors can tell is None, or empty, for a plan that has none (a published one): such a plan is not
counted in that measure. ``houseexpo.inference.with_rooms`` finds them.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping
from typing import Literal

import numpy as np

from houseexpo.analysis.graph import OUTSIDE, rooms_graph
from houseexpo.analysis.navigability import navigability
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Navigability

Fault = Literal["touches", "crosses"]

_MIX = np.uint64(0x9E3779B97F4A7C15)
"""An odd number without pattern: two edges of a house do not meet in one number."""


def rooms(plan: FloorPlan) -> int:
    """Rooms as the source counts them, unlabelled ones included."""
    return plan.room_num


def rooms_found(plan: FloorPlan) -> int | None:
    """Rooms that the plan has as polygons."""
    return len(plan.rooms) or None


def label_boxes(plan: FloorPlan) -> int:
    """Boxes of labelled rooms."""
    return sum(map(len, plan.room_category.values()))


def labels(plan: FloorPlan) -> Counter[str]:
    """Rooms by label; a published plan, which has no rooms, by its boxes."""
    if plan.rooms:
        return Counter(room.label for room in plan.rooms)
    return Counter({label: len(boxes) for label, boxes in plan.room_category.items()})


def area_m2(plan: FloorPlan) -> float:
    """Free space inside the walls, m2."""
    return plan.area


def long_side_m(plan: FloorPlan) -> float:
    """Longer side of the box around the plan, metres."""
    return float(np.ptp(plan.verts, axis=0).max())


def short_side_m(plan: FloorPlan) -> float:
    """Shorter side of the box around the plan, metres."""
    return float(np.ptp(plan.verts, axis=0).min())


def vertices(plan: FloorPlan) -> int:
    """Corners of the outline and of the holes."""
    return len(plan.verts) + sum(map(len, plan.holes))


def holes(plan: FloorPlan) -> int:
    """Walls and pillars that stand free inside the outline."""
    return len(plan.holes)


def quality(plan: FloorPlan) -> float | None:
    """How sure the pipeline is of the plan, 0 to 1."""
    return None if plan.quality is None else plan.quality.score


def furniture(plan: FloorPlan) -> int | None:
    """Pieces of furniture; None where the plan records none."""
    return len(plan.objects) or None


def doors(plan: FloorPlan) -> int | None:
    """Doors of every kind."""
    return len(plan.doors) if plan.rooms else None


def door_kinds(plan: FloorPlan) -> Counter[str]:
    """Doors by kind."""
    return Counter(door.kind for door in plan.doors)


def door_widths_m(plan: FloorPlan) -> list[float]:
    """Clear width of each door, metres."""
    return [door.width for door in plan.doors]


def room_areas_m2(plan: FloorPlan) -> list[float]:
    """Area of each room, m2."""
    return [room.area for room in plan.rooms]


def doors_per_room(plan: FloorPlan) -> list[int]:
    """Doors of each room, entrances included; a door between two rooms counts for both."""
    if not plan.rooms:
        return []
    graph = rooms_graph(plan, outside=True)
    return [graph.degree(room.id) for room in plan.rooms]


def neighbours(plan: FloorPlan) -> list[int]:
    """Degree of each room: how many other rooms a door leads to from it."""
    if not plan.rooms:
        return []
    graph = rooms_graph(plan)
    return [len(set(graph[room.id]) - {room.id}) for room in plan.rooms]


def loops(plan: FloorPlan) -> int | None:
    """Independent ways round: doors less rooms, plus the pieces of the graph; 0 in a house that branches as a tree."""
    if not plan.rooms:
        return None
    import networkx as nx

    graph = rooms_graph(plan)
    pieces = nx.number_connected_components(graph)
    return int(graph.number_of_edges() - graph.number_of_nodes() + pieces)


def depth(plan: FloorPlan) -> int | None:
    """Doors to pass from the entrance to the farthest room; None where nothing says where one enters.

    One enters where a door of kind "entrance" is; else, as a published outline hides those, in a room labelled
    Entryway. Rooms that cannot be reached do not count.
    """
    if not plan.rooms:
        return None
    import networkx as nx

    graph = rooms_graph(plan, outside=True)
    starts = [room.id for room in plan.rooms if room.label == "Entryway"]
    if OUTSIDE in graph:
        starts = list(graph[OUTSIDE])
        graph.remove_node(OUTSIDE)
    if not starts:
        return None
    return int(max(nx.multi_source_dijkstra_path_length(graph, starts, weight=None).values()))


def reach(plan: FloorPlan) -> Mapping[str, Navigability]:
    """What a disc robot can reach, by radius: as the plan states it, else measured."""
    return plan.navigability or navigability(plan)


def ring_fault(plan: FloorPlan) -> Fault | None:
    """Whether the published ring touches or crosses itself."""
    import shapely

    polygon = shapely.Polygon(plan.verts)
    if polygon.is_valid:
        return None
    return "touches" if shapely.is_valid_reason(polygon).startswith("Ring") else "crosses"


def ring_digest(plan: FloorPlan) -> str:
    """Return what two plans share when their rings are the same vertices in the same order."""
    return hashlib.blake2b(plan.verts.tobytes(), digest_size=12).hexdigest()


def shape_digest(plan: FloorPlan) -> str:
    """Return what two plans share when one's walls lie on the other's after shifting, turning by 90 degrees, mirroring.

    Edges on the 1 cm grid, counted from the corner of the box; the least of the eight views. Neither where a ring
    starts nor which way it runs makes a difference.
    """
    rings = [np.rint(ring * 100).astype(np.int64) for ring in (plan.verts, *plan.holes)]
    points, following = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    x, y = (np.stack([points, following]) - points.min(axis=0)).transpose(2, 0, 1)
    flipped = [(x, y), (x.max() - x, y), (x, y.max() - y), (x.max() - x, y.max() - y)]
    across = np.stack([a for a, _ in flipped] + [b for _, b in flipped])  # (8 views, 2 ends, edges)
    up = np.stack([b for _, b in flipped] + [a for a, _ in flipped])
    one, other = np.moveaxis((across << 32 | up).view(np.uint64), 1, 0)
    edges = np.minimum(one, other) * _MIX + np.maximum(one, other)  # one number an edge, modulo 2**64
    edges.sort(axis=1)
    return hashlib.blake2b(min(view.tobytes() for view in edges), digest_size=12).hexdigest()
