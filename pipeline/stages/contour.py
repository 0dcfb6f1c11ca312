"""Find the outer contour of each free-standing part of a house, from its closed walls P_g (Algorithm 1, line 6).

The paper traces the contour on a raster (border following of Suzuki and Abe). The walls are polygons here, and the
outer ring of each is the same contour without stair-steps.

R1  A house of more than ``LONGEST_M`` a side is a wrong unit, or terrain: no plan is made of it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import shapely
from shapely import Polygon

from pipeline.geometry.areas import polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.values import Spaces

LONGEST_M: Final = 500.0
"""The longest side of a house, metres. Of 33,717 published plans the longest has 100 m, the Pentagon 431 m."""

_ADVICE = (
    "for a mesh, give the unit by --units or the scale by --scale; for a picture of a map, the side of a cell by "
    "--resolution; else export the file again in its true unit"
)


def trace_contour(spaces: Spaces) -> Spaces:
    """Add the outer contour of every part of the house that stands by itself and has rooms, largest first.

    Raises
    ------
    Rejection
        TOO_LARGE (R1).
    """
    outlines = [Polygon(part.exterior) for part in polygons_of(spaces.walls)]
    inside = shapely.point_on_surface(spaces.rooms)
    housing = [o for o in outlines if shapely.intersects(o, inside).any()]
    nested = {k for k, o in enumerate(housing) if any(p.contains(o) for p in housing[:k])}
    outlines = [o for k, o in enumerate(housing) if k not in nested]
    for x1, y1, x2, y2 in (outline.bounds for outline in outlines):
        if max(x2 - x1, y2 - y1) > LONGEST_M:  # R1
            detail = f"expected a house of at most {LONGEST_M:g} m a side, found {x2 - x1:,.0f} x {y2 - y1:,.0f} m"
            raise Rejection("contour", Reason.TOO_LARGE, detail, _ADVICE)
    return replace(spaces, outlines=tuple(outlines))
