"""Turn a plan's rings, which may touch or cross themselves, into valid polygons, and describe the fault (``Repair``).

Of 33,717 published rings, 1,285 touch or cross themselves. They are contours of pixels: a contour meets itself where a
passage is one pixel wide or a wall is attached only at a corner. The repair follows these rules:

R1  A point is inside if a ray from it crosses the rings an odd number of times (even-odd). ``houseexpo.grids.raster``
    fills rings in the same way.
R2  Lines without area, such as a passage of zero width, are removed.
R3  Nothing else is removed: every piece stays, however small. Pieces that only touch stay separate, since no robot fits
    through a point. A wall that is attached only at a corner becomes a hole that touches the outline.

On all published rings, this preserves the area of the ring (by the shoelace formula) to the last cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from houseexpo.errors import PlanError
from houseexpo.plan.parts import Ring, signed_area
from houseexpo.tolerances import SAME_M

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

_TOUCHES = ("Ring Self-intersection", "Interior is disconnected")


@dataclass(frozen=True)
class Repair:
    """The faults of a plan's rings, and what their repair changed.

    ``kind`` is "cross" if a ring crosses itself or another ring, "touch" if rings only touch; ``at`` is one such place,
    (x, y) in metres. ``pieces`` is the number of polygons in the repaired free space. ``area_change_m2`` is the area of
    the repaired free space minus the rings' area by the shoelace formula.
    """

    kind: Literal["touch", "cross"]
    at: tuple[float, float]
    pieces: int
    area_change_m2: float


def even_odd_polygons(verts: Ring, holes: Sequence[Ring]) -> Polygon | MultiPolygon:
    """Return ``verts`` without ``holes`` as valid polygons, metres (R1 to R3); raise PlanError if they have no area."""
    import shapely

    shape = shapely.Polygon(verts, holes)
    if shape.is_valid:
        return shape
    rings = [verts, *holes]
    noded = shapely.union_all([shapely.LinearRing(ring) for ring in rings], grid_size=SAME_M)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    places = shapely.get_coordinates(shapely.point_on_surface(faces))
    crossings = sum((_crossings(places, ring) for ring in rings), np.zeros(len(places), dtype=np.int64))
    mended: Polygon | MultiPolygon = shapely.union_all(faces[crossings % 2 == 1])
    if mended.is_empty:
        raise PlanError("expected a ring that encloses an area, found lines only; the plan cannot be repaired", "verts")
    return mended


def describe_repair(verts: Ring, holes: Sequence[Ring] = ()) -> Repair | None:
    """Return the repair of rings (metres) by ``even_odd_polygons``, None if they are valid; PlanError without area.

    Examples
    --------
    >>> bow_tie = np.array([(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)])
    >>> describe_repair(bow_tie)
    Repair(kind='cross', at=(1.0, 1.0), pieces=2, area_change_m2=2.0)
    """
    import shapely

    shape = shapely.Polygon(verts, holes)
    if shape.is_valid:
        return None
    problem, _, place = shapely.is_valid_reason(shape).rstrip("]").partition("[")
    x, y = map(float, place.split()[:2])
    mended = even_odd_polygons(verts, holes)
    stated = abs(signed_area(verts)) - sum(abs(signed_area(hole)) for hole in holes)
    return Repair(
        kind="touch" if problem in _TOUCHES else "cross",
        at=(x, y),
        pieces=int(shapely.get_num_geometries(mended)),
        area_change_m2=round(float(mended.area) - stated, 6) + 0.0,
    )


def _crossings(points: Ring, ring: Ring) -> npt.NDArray[np.int64]:
    """Return how often a ray to the right from each point (n, 2) crosses a ring."""
    start, end = ring, np.roll(ring, -1, axis=0)
    above = points[:, 1:] < start[:, 1], points[:, 1:] < end[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):  # no ray crosses a horizontal edge
        slope = (end[:, 0] - start[:, 0]) / (end[:, 1] - start[:, 1])
        right = points[:, :1] < start[:, 0] + (points[:, 1:] - start[:, 1]) * slope
    return np.asarray(((above[0] != above[1]) & right).sum(axis=1), dtype=np.int64)
