"""What stands in a level and what it is taken for, one colour each, so that a person sees why a plan is as it is.

The picture's edges have the metres of the source's plan axes: what ``overrides.toml`` takes.
"""

from __future__ import annotations

import shapely
from shapely.geometry.base import BaseGeometry

from houseexpo.drawing.scene import WALL
from houseexpo.plan import Box, Frame
from pipeline.canvas import Canvas, Picture
from pipeline.values import Evidence

FLOOR = "#f1ece0"
FURNITURE = "#c8b08a"
RAIL = "#a68fd0"
LINTEL = "#8fbde0"
DOORWAY = "#f2b134"
LEAF = "#c4451c"


def draw_evidence(evidence: Evidence, bounds: Box, frame: Frame) -> Picture:
    """Paint the evidence, (rows, cols, 3); what is small and telling lies above what is large."""
    layers: list[tuple[str, str, BaseGeometry]] = [
        ("floor", FLOOR, evidence.floor or shapely.Polygon()),
        ("furniture", FURNITURE, evidence.furniture),
        ("parapet or railing", RAIL, evidence.rails),
        ("lintel", LINTEL, evidence.lintels),
        ("wall", WALL, evidence.walls),
        ("known doorway", DOORWAY, shapely.union_all([doorway.polygon for doorway in evidence.doorways])),
        ("door leaf", LEAF, shapely.union_all(evidence.leaves)),
    ]
    canvas = Canvas(bounds)
    for _, colour, shape in layers:
        canvas.fill(shape, colour)
    for at, words in evidence.names:
        canvas.write(at, words)
    canvas.ruler(frame)
    legend = [(name, colour) for name, colour, shape in layers if not shape.is_empty]
    axes = "X and Y" if frame.up == "z" else "X and Z"
    return canvas.finished(f"evidence: what is taken for what; at the edges the source's {axes}, metres", legend)
