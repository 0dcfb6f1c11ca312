"""Straight walls of one thickness (Algorithm 1, line 18).

R1  Stair-steps become straight edges, axis-parallel where the house is, oblique where it is (``geometry.straighten``).
R2  Passages are fitted anew between the straightened faces.
"""

from __future__ import annotations

from dataclasses import replace

import shapely
from shapely import Polygon

from pipeline.config import RefineConfig
from pipeline.geometry.fitting import fitted
from pipeline.geometry.overlay import polygons_of, subtract
from pipeline.geometry.straighten import straighten
from pipeline.values import Spaces


def refine(spaces: Spaces, config: RefineConfig) -> Spaces:
    """Straighten the rooms and fit the passages."""
    straight = straighten(list(spaces.rooms), offset_m=config.offset_m, angle_deg=config.angle_deg)  # R1
    rooms = _disjoint(straight, list(spaces.rooms))
    passages = tuple(replace(p, bridge=fitted(p.bridge, rooms)) for p in spaces.passages)  # R2
    return replace(spaces, rooms=tuple(rooms), passages=passages)


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
