"""Straight walls of one thickness, and a last look at whether this is a layout at all (Algorithm 1, line 18).

R1  Stair-steps become straight edges, axis-parallel where the house is, oblique where it is (``geometry.straighten``).
R2  Passages are fitted anew between the straightened faces.
R3  Walls that spell characters are no layout: strokes that stand apart from each other, without a door between any of
    them, and enclose little of what they span.
"""

from __future__ import annotations

from dataclasses import replace

import shapely
from shapely import Polygon

from pipeline.config import RefineConfig
from pipeline.geometry.fitting import fitted
from pipeline.geometry.overlay import polygons_of, subtract, united
from pipeline.geometry.straighten import straighten
from pipeline.rejection import Reason, Rejection
from pipeline.values import Spaces

STROKES = 3
STROKE_M = 1.0


def refine(spaces: Spaces, config: RefineConfig) -> Spaces:
    """Straighten the rooms; raises Rejection for walls that spell characters."""
    straight = straighten(list(spaces.rooms), offset_m=config.offset_m, angle_deg=config.angle_deg)  # R1
    rooms = _disjoint(straight, list(spaces.rooms))
    passages = tuple(replace(p, bridge=fitted(p.bridge, rooms)) for p in spaces.passages)  # R2
    return replace(spaces, rooms=tuple(rooms), passages=passages)


def reject_characters(spaces: Spaces) -> None:
    """R3."""
    strokes = [p for p in polygons_of(spaces.walls) if shapely.length(p) > 2 * STROKE_M]
    doors = [p for p in spaces.passages if not p.leads_outside and p.kind != "cut"]
    spanned = shapely.convex_hull(united(strokes)).area if strokes else 0.0
    enclosed = sum(room.area for room in spaces.rooms)
    if len(strokes) >= STROKES and not doors and enclosed < 0.5 * spanned:
        raise Rejection(
            "refine",
            Reason.CHARACTERS,
            f"{len(strokes)} strokes of wall stand apart and enclose {enclosed:.1f} of {spanned:.1f} m2, without a door",
            "if it is a house after all, keep it in overrides.toml",
        )


def _disjoint(straight: list[Polygon], before: list[Polygon]) -> list[Polygon]:
    """Straightened rooms may lap over each other where they meet; then the larger one keeps the strip."""
    tree = shapely.STRtree(straight)
    result = list(straight)
    for k, room in enumerate(straight):
        for other in tree.query(room, predicate="overlaps"):
            if other > k:
                rest = polygons_of(subtract(result[other], result[k]))
                result[other] = rest[0] if rest else before[other]
    return result
