"""Measures: functions that return one number for a plan, or one number for each of its rooms or doors.

Measures of rooms and doors are None, or empty, for a plan without them (a published one); the plan is then not counted.
``houseexpo.inference.with_rooms`` finds rooms and doors.
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
"""A random odd factor, so that two edges of a house do not give the same number."""


def rooms(plan: FloorPlan) -> int:
    """Return the number of rooms as the source counts them, including unlabelled ones."""
    return plan.room_num


def rooms_found(plan: FloorPlan) -> int | None:
    """Return the number of room polygons, None if there are none."""
    return len(plan.rooms) or None


def label_boxes(plan: FloorPlan) -> int:
    """Return the number of label boxes."""
    return sum(map(len, plan.room_category.values()))


def labels(plan: FloorPlan) -> Counter[str]:
    """Return the number of rooms of each label; for a published plan, which has no rooms, the number of boxes."""
    if plan.rooms:
        return Counter(room.label for room in plan.rooms)
    return Counter({label: len(boxes) for label, boxes in plan.room_category.items()})


def area_m2(plan: FloorPlan) -> float:
    """Return the area of the free space, m2."""
    return plan.area


def long_side_m(plan: FloorPlan) -> float:
    """Return the longer side of the plan's bounding box, metres."""
    return float(np.ptp(plan.verts, axis=0).max())


def short_side_m(plan: FloorPlan) -> float:
    """Return the shorter side of the plan's bounding box, metres."""
    return float(np.ptp(plan.verts, axis=0).min())


def vertices(plan: FloorPlan) -> int:
    """Return the number of corners of the outline and of the holes."""
    return len(plan.verts) + sum(map(len, plan.holes))


def holes(plan: FloorPlan) -> int:
    """Return the number of free-standing walls and pillars inside the outline."""
    return len(plan.holes)


def quality(plan: FloorPlan) -> float | None:
    """Return the quality score of the plan, 0 to 1; None if it has none."""
    return None if plan.quality is None else plan.quality.score


def furniture(plan: FloorPlan) -> int | None:
    """Return the number of pieces of furniture, None if the plan records none."""
    return len(plan.objects) or None


def doors(plan: FloorPlan) -> int | None:
    """Return the number of doors of all kinds."""
    return len(plan.doors) if plan.rooms else None


def door_kinds(plan: FloorPlan) -> Counter[str]:
    """Return the number of doors of each kind."""
    return Counter(door.kind for door in plan.doors)


def door_widths_m(plan: FloorPlan) -> list[float]:
    """Return the clear width of each door, metres."""
    return [door.width for door in plan.doors]


def room_areas_m2(plan: FloorPlan) -> list[float]:
    """Return the area of each room, m2."""
    return [room.area for room in plan.rooms]


def doors_per_room(plan: FloorPlan) -> list[int]:
    """Return the number of doors of each room, including entrances; a door between two rooms counts for both."""
    if not plan.rooms:
        return []
    graph = rooms_graph(plan, outside=True)
    return [graph.degree(room.id) for room in plan.rooms]


def neighbours(plan: FloorPlan) -> list[int]:
    """Return the degree of each room: the number of other rooms that a door connects it to."""
    if not plan.rooms:
        return []
    graph = rooms_graph(plan)
    return [len(set(graph[room.id]) - {room.id}) for room in plan.rooms]


def loops(plan: FloorPlan) -> int | None:
    """Return the number of independent cycles: doors minus rooms plus connected components; 0 if there is no cycle."""
    if not plan.rooms:
        return None
    import networkx as nx

    graph = rooms_graph(plan)
    pieces = nx.number_connected_components(graph)
    return int(graph.number_of_edges() - graph.number_of_nodes() + pieces)


def depth(plan: FloorPlan) -> int | None:
    """Return the number of doors between the entrance and the farthest room, None if the entrance is unknown.

    The entrance is a door of kind "entrance" or, since published outlines hide those, a room labelled Entryway. Rooms
    that cannot be reached do not count.
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
    """Return the navigability by radius, as recorded in the plan or else measured."""
    return plan.navigability or navigability(plan)


def ring_fault(plan: FloorPlan) -> Fault | None:
    """Return the fault of the published ring, which "touches" or "crosses" itself, or None if it is valid."""
    import shapely

    polygon = shapely.Polygon(plan.verts)
    if polygon.is_valid:
        return None
    return "touches" if shapely.is_valid_reason(polygon).startswith("Ring") else "crosses"


def ring_digest(plan: FloorPlan) -> str:
    """Return a digest that is equal for plans whose rings have the same vertices in the same order."""
    return hashlib.blake2b(plan.verts.tobytes(), digest_size=12).hexdigest()


def shape_digest(plan: FloorPlan) -> str:
    """Return a digest that is equal for plans with the same walls up to shifts, rotations by 90 degrees and mirroring.

    It is made from the edges on the 1 cm grid, relative to the corner of the bounding box, and is the smallest of the
    eight symmetric views. The start and the direction of a ring make no difference.
    """
    rings = [np.rint(ring * 100).astype(np.int64) for ring in (plan.verts, *plan.holes)]
    points, following = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    x, y = (np.stack([points, following]) - points.min(axis=0)).transpose(2, 0, 1)
    flipped = [(x, y), (x.max() - x, y), (x, y.max() - y), (x.max() - x, y.max() - y)]
    across = np.stack([a for a, _ in flipped] + [b for _, b in flipped])  # (8 views, 2 ends, edges)
    up = np.stack([b for _, b in flipped] + [a for a, _ in flipped])
    one, other = np.moveaxis((across << 32 | up).view(np.uint64), 1, 0)
    edges = np.minimum(one, other) * _MIX + np.maximum(one, other)  # one number per edge, modulo 2**64
    edges.sort(axis=1)
    return hashlib.blake2b(min(view.tobytes() for view in edges), digest_size=12).hexdigest()
