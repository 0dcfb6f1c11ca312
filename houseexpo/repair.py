"""From a published ring to a valid shape."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Ring = npt.NDArray[np.float64]


def even_odd(verts: Ring, holes: Sequence[Ring]) -> Polygon | MultiPolygon:
    """Return ``verts`` less ``holes``, metres, valid in any case.

    Rings that touch or cross themselves or each other enclose the points from which a ray crosses them an odd number
    of times; that is also how ``houseexpo.raster`` fills them.
    """
    import shapely

    shape = shapely.Polygon(verts, holes)
    if shape.is_valid:
        return shape
    parts = shapely.get_parts(shapely.make_valid(shape, method="linework"))
    areas = [p for part in parts for p in shapely.get_parts(part) if p.geom_type == "Polygon"]
    return areas[0] if len(areas) == 1 else shapely.MultiPolygon(areas)
