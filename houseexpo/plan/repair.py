"""From a published ring to a valid shape, and a record of what was wrong with it.

1,285 of 33,717 published rings touch or cross themselves: contours of pixels do where a passage is one pixel wide, or a
wall hangs on by a corner. The rule that repairs them:

R1  Inside is where a ray crosses the rings an odd number of times (even-odd), as ``houseexpo.grids.raster`` fills them.
R2  Lines without area, such as a passage that is no wider than a line, are left out.
R3  Nothing else is: every piece stays, however small. Pieces that only touch stay apart, for no robot fits through a
    point, and a wall that hangs on by a corner is a hole that touches the outline.

On all published rings this keeps the area that the ring states (by the shoelace formula), to the last cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from houseexpo.errors import PlanError
from houseexpo.plan.area import signed_area

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Ring = npt.NDArray[np.float64]

_TOUCHES = ("Ring Self-intersection", "Interior is disconnected")

_EXACT_M = 1e-6  # a ring that goes back over its own slant must not enclose what rounding leaves between


@dataclass(frozen=True)
class Repair:
    """What was wrong with a plan's rings, and what mending them changed.

    ``kind`` is "cross" where a ring crosses itself or another, "touch" where they only meet; ``at`` is a place where
    they do, metres. ``pieces`` is the number of polygons that the free space has now; ``area_change_m2`` is its area
    less the one that the rings state by the shoelace formula.
    """

    kind: Literal["touch", "cross"]
    at: tuple[float, float]
    pieces: int
    area_change_m2: float


def even_odd(verts: Ring, holes: Sequence[Ring]) -> Polygon | MultiPolygon:
    """Return ``verts`` less ``holes``, metres, valid in any case (R1 to R3); PlanError where they enclose no area."""
    import shapely

    shape = shapely.Polygon(verts, holes)
    if shape.is_valid:
        return shape
    rings = [verts, *holes]
    noded = shapely.union_all([shapely.LinearRing(ring) for ring in rings], grid_size=_EXACT_M)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    places = shapely.get_coordinates(shapely.point_on_surface(faces))
    crossings = sum((_crossings(places, ring) for ring in rings), np.zeros(len(places), dtype=np.int64))
    mended: Polygon | MultiPolygon = shapely.union_all(faces[crossings % 2 == 1])
    if mended.is_empty:
        raise PlanError("expected a ring that encloses an area, found lines only; the plan cannot be repaired", "verts")
    return mended


def repair_of(verts: Ring, holes: Sequence[Ring] = ()) -> Repair | None:
    """Say what ``even_odd`` mends in rings (metres), None where they are valid; PlanError where it cannot.

    Examples
    --------
    >>> bow_tie = np.array([(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)])
    >>> repair_of(bow_tie)
    Repair(kind='cross', at=(1.0, 1.0), pieces=2, area_change_m2=2.0)
    """
    import shapely

    shape = shapely.Polygon(verts, holes)
    if shape.is_valid:
        return None
    problem, _, place = shapely.is_valid_reason(shape).rstrip("]").partition("[")
    x, y = map(float, place.split()[:2])
    mended = even_odd(verts, holes)
    stated = abs(signed_area(verts)) - sum(abs(signed_area(hole)) for hole in holes)
    return Repair(
        kind="touch" if problem in _TOUCHES else "cross",
        at=(x, y),
        pieces=int(shapely.get_num_geometries(mended)),
        area_change_m2=round(float(mended.area) - stated, 6) + 0.0,
    )


def _crossings(points: Ring, ring: Ring) -> npt.NDArray[np.int64]:
    """How often a ray to the right of each point (n, 2) crosses a ring."""
    start, end = ring, np.roll(ring, -1, axis=0)
    above = points[:, 1:] < start[:, 1], points[:, 1:] < end[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):  # level edges are crossed by none
        slope = (end[:, 0] - start[:, 0]) / (end[:, 1] - start[:, 1])
        right = points[:, :1] < start[:, 0] + (points[:, 1:] - start[:, 1]) * slope
    return np.asarray(((above[0] != above[1]) & right).sum(axis=1), dtype=np.int64)
