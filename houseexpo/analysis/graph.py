"""Make a networkx graph of a plan: rooms as nodes with label and area (m2), doors as edges with kind and width (m).

Rooms that meet in the open, without a wall, are neighbours too: the graph has as many pieces as the free space.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from houseexpo.plan.model import PlanData
from houseexpo.tolerances import GRID_M

if TYPE_CHECKING:
    import networkx as nx

OUTSIDE: Final = "outside"
OPEN: Final = "open"
"""The kind of an edge between two rooms that meet without a wall."""


@dataclass(frozen=True)
class OpenBorder:
    """Where two rooms meet without a wall: their ids, and the longest straight piece of it, from end to end, metres."""

    rooms: tuple[int, int]
    segment: tuple[tuple[float, float], tuple[float, float]]

    @property
    def width(self) -> float:
        """Length of the segment, metres, to the centimetre."""
        return round(math.dist(*self.segment), 2)


def open_borders(plan: PlanData) -> list[OpenBorder]:
    """Return where rooms of a plan meet in the open, as under a beam or where a source divides a space.

    Rooms between which a wall stands are at least a cell of the plan's grid apart (1 cm).
    """
    if len(plan.rooms) < 2:
        return []
    import shapely

    shapes = [room.polygon for room in plan.rooms]
    pairs = shapely.STRtree(shapes).query(shapes, predicate="intersects").T.tolist()
    found = []
    for one, other in sorted((i, j) for i, j in pairs if i < j):
        shared = shapely.intersection(shapes[one].boundary, shapes[other].boundary)
        lines = [part for part in shapely.get_parts(shared) if part.length > 0]
        if not lines:  # a corner that both have
            continue
        merged = shapely.simplify(shapely.line_merge(shapely.multilinestrings(lines)), GRID_M)
        straight = (ends for line in shapely.get_parts(merged) for ends in pairwise(line.coords))
        (x1, y1), (x2, y2) = max(straight, key=lambda ends: math.dist(*ends))
        found.append(OpenBorder((plan.rooms[one].id, plan.rooms[other].id), ((x1, y1), (x2, y2))))
    return found


def rooms_graph(plan: PlanData, *, outside: bool = False) -> nx.MultiGraph[int | str]:
    """Return the graph of a plan with rooms as nodes and doors as edges.

    A node is the id of a room and has ``label`` and ``area`` (m2). An edge connects the two rooms of a door; its key is
    the door's id, and it has ``kind`` and ``width`` (m). Two doors between the same rooms are two edges, hence a
    MultiGraph. Two rooms that meet in the open have an edge of kind "open", whose width is that of the longest straight
    piece of their border; such edges have the keys -1, -2, ... A published plan has no rooms; use ``FloorPlan.graph``
    or ``with_rooms``.

    With ``outside=True``, entrances lead to a node "outside". By default they are left out, because a path through the
    garden would count as a path between rooms.
    """
    import networkx as nx

    graph: nx.MultiGraph[int | str] = nx.MultiGraph(id=plan.id)
    for room in plan.rooms:
        graph.add_node(room.id, label=room.label, area=room.area)
    for door in plan.doors:
        one, other = (OUTSIDE if room is None else room for room in door.rooms)
        if outside or OUTSIDE not in (one, other):
            graph.add_edge(one, other, key=door.id, kind=door.kind, width=door.width)
    for number, border in enumerate(open_borders(plan), start=1):
        graph.add_edge(*border.rooms, key=-number, kind=OPEN, width=border.width)
    return graph
