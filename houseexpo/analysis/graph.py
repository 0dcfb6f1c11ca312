"""Rooms and doors as a graph, and what a disc robot of a given radius can reach."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from houseexpo.plan.model import PlanData

if TYPE_CHECKING:
    import networkx as nx

OUTSIDE: Final = "outside"


def rooms_graph(plan: PlanData, *, outside: bool = False) -> nx.MultiGraph[int | str]:
    """Return rooms as nodes, doors as edges.

    A node is a room's id with ``label`` and ``area`` (m2); an edge joins the two rooms of a door, keyed by the door's
    id, with ``kind`` and ``width`` (m). Two doors between the same rooms are two edges, hence a MultiGraph.

    Entrances lead to a node "outside" where ``outside`` is True; they are left out by default, because a way through
    the garden would count as a way from room to room.
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
