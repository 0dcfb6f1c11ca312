"""Rooms that can be reached from each other."""

from __future__ import annotations

import networkx as nx

from pipeline.geometry.spaces import Spaces


def cells(spaces: Spaces) -> list[list[int]]:
    """Groups of room indices joined by passages or joins, each sorted, in the order of their first room."""
    graph = nx.Graph()
    graph.add_nodes_from(range(len(spaces.rooms)))
    graph.add_edges_from(p.bridge.sides for p in spaces.passages if not p.leads_outside)
    graph.add_edges_from(spaces.joins)
    return sorted(sorted(part) for part in nx.connected_components(graph))
