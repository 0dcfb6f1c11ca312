"""Algorithm 1, line 4: the contour of P_g; everything outside it is obstacle, L is free inside it.

The paper traces the contour on a raster (border following of Suzuki and Abe). The walls are polygons here, and the
outer ring of each is the same contour without stair-steps.
"""

from __future__ import annotations

from dataclasses import replace

from shapely import Polygon

from pipeline.geometry.overlay import polygons_of, united
from pipeline.values import Spaces


def trace_contour(spaces: Spaces) -> Spaces:
    """Add the outer contour of every part of the house that stands by itself and has rooms, largest first."""
    parts = polygons_of(united([spaces.walls, *spaces.rooms]))
    outlines = [Polygon(part.exterior) for part in parts]
    housing = [o for o in outlines if any(o.contains(r.representative_point()) for r in spaces.rooms)]
    return replace(spaces, outlines=tuple(housing))
