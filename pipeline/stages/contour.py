"""Algorithm 1, line 4: the contour of P_g; everything outside it is obstacle, L is free inside it.

The paper traces the contour on a raster (border following of Suzuki and Abe). The walls are polygons here, and the
outer ring of each is the same contour without stair-steps.
"""

from __future__ import annotations

from dataclasses import replace

import shapely
from shapely import Polygon

from pipeline.geometry.overlay import polygons_of
from pipeline.values import Spaces


def trace_contour(spaces: Spaces) -> Spaces:
    """Add the outer contour of every part of the house that stands by itself and has rooms, largest first."""
    outlines = [Polygon(part.exterior) for part in polygons_of(spaces.walls)]
    inside = shapely.points([r.representative_point().coords[0] for r in spaces.rooms])
    housing = [o for o in outlines if shapely.intersects(o, inside).any()]
    nested = {k for k, o in enumerate(housing) if any(p.contains(o) for p in housing[:k])}
    return replace(spaces, outlines=tuple(o for k, o in enumerate(housing) if k not in nested))
