"""Make a networkx graph of a plan: rooms as nodes with label and area (m2), doors as edges with kind and width (m)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from houseexpo.plan.model import PlanData

if TYPE_CHECKING:
    import networkx as nx

OUTSIDE: Final = "outside"


def rooms_graph(plan: PlanData, *, outside: bool = False) -> nx.MultiGraph[int | str]:
    """Return the graph of a plan with rooms as nodes and doors as edges.

    A node is the id of a room and has ``label`` and ``area`` (m2). An edge connects the two rooms of a door; its key is
    the door's id, and it has ``kind`` and ``width`` (m). Two doors between the same rooms are two edges, hence a
    MultiGraph. A published plan has no rooms; use ``FloorPlan.graph`` or ``with_rooms``.

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
    return graph
