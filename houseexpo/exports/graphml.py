"""Convert a plan to a GraphML graph: rooms are nodes, doors are edges with the walking distance in metres."""

from __future__ import annotations

import io
from typing import Any

from houseexpo.exports.encoding import Files, valid_xml_text
from houseexpo.exports.placement import ExportFrame, Orientation, orient_plan, pose_in_export
from houseexpo.floorplan import FloorPlan


def graphml(plan: FloorPlan, *, orientation: Orientation = "world", frame: ExportFrame | None = None) -> Files:
    """Write ``<id>.graphml``, the graph of ``FloorPlan.graph``.

    A node is a room with ``label``, ``area`` (m2), ``x`` and ``y`` (metres, a point well inside the room; mirrored
    plans are mirrored back). An edge is a door with ``kind``, ``width`` (m) and ``distance`` (m, the walking distance
    between the rooms). The graph has ``id`` and ``area`` (m2, the free space).

    For a plan without rooms (a published one), the nodes are its label boxes, with ``source`` "box", and there are no
    edges.
    """
    import networkx as nx

    turned, pose = orient_plan(plan, orientation), pose_in_export(plan, orientation, frame)
    graph = turned.graph() if turned.rooms else _boxes(turned)
    graph.graph = {"id": turned.id, "area": round(turned.area, 4)}
    for _, data in graph.nodes(data=True):
        if "position" in data:
            data["x"], data["y"] = (round(value, 4) for value in pose.point(data.pop("position")))
        if isinstance(data.get("label"), str):
            data["label"] = valid_xml_text(data["label"])
    stream = io.BytesIO()
    nx.write_graphml_xml(graph, stream, named_key_ids=True)
    return {f"{plan.id}.graphml": stream.getvalue() + b"\n"}


def _boxes(plan: FloorPlan) -> Any:
    import networkx as nx

    graph: nx.MultiGraph[int] = nx.MultiGraph()
    boxes = [(label, box) for label, found in plan.room_category.items() for box in found]
    for i, (label, (x1, y1, x2, y2)) in enumerate(boxes):
        area = round((x2 - x1) * (y2 - y1), 4)
        graph.add_node(i, label=label, area=area, position=((x1 + x2) / 2, (y1 + y2) / 2), source="box")
    return graph
