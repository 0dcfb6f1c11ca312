"""From a polygon with holes to one ring: each hole is joined to the outline by a slit, a wall of 1 cm."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from houseexpo.errors import PlanError

if TYPE_CHECKING:
    from shapely import Polygon

SLIT_M: Final = 0.01
_DIGITS = 2  # the format's 1 cm grid
_AXES: Final = ((1, 0), (-1, 0), (0, 1), (0, -1))


def without_holes(polygon: Polygon, avoid: Sequence[Polygon] = ()) -> Polygon:
    """Join the holes of a polygon to its outline, each where the way is shortest.

    S1  A slit is 0.01 m wide, runs along an axis from a corner of the hole to what it meets first (the outline or
        another hole), and keeps to the 1 cm grid; so it closes no way but the one between those two walls, and what was
        connected stays connected.
    S2  Among the shortest, one that keeps out of ``avoid`` (doors) goes first.

    Parameters
    ----------
    polygon
        Metres, valid.
    avoid
        What slits should not cross where they need not.

    Returns
    -------
    A valid polygon without holes, smaller by 0.01 m times the length of the slits.

    Raises
    ------
    PlanError
        No slit leaves a simple ring.
    """
    while polygon.interiors:
        polygon = _one_less(polygon, avoid)
    return polygon


def _one_less(polygon: Polygon, avoid: Sequence[Polygon]) -> Polygon:
    hole = shapely.Polygon(polygon.interiors[0])
    for slit in _slits(polygon, hole, avoid):
        cut = shapely.difference(polygon, slit)
        cut = shapely.simplify(shapely.transform(cut, lambda points: points.round(_DIGITS)), 0.0)
        if cut.geom_type == "Polygon" and cut.is_valid and len(cut.interiors) == len(polygon.interiors) - 1:
            return cut
    where = hole.representative_point()
    problem = (
        f"expected a hole that a slit can join to the outline, found none for the one at ({where.x:.2f}, {where.y:.2f})"
    )
    raise PlanError(f"{problem}; drop the holes instead", "holes")


def _slits(polygon: Polygon, hole: Polygon, avoid: Sequence[Polygon]) -> list[Any]:
    """Return what strips along the axes from the hole's corners cover of the polygon, the best first."""
    corners = shapely.get_coordinates(hole)[:-1].round(_DIGITS)
    reach = float(np.hypot(*np.subtract(polygon.bounds[2:], polygon.bounds[:2])))
    strips = [_strip(corner, axis, side, reach) for corner in corners for axis in _AXES for side in (1, -1)]
    starts = shapely.points(np.repeat(corners, 2 * len(_AXES), axis=0))
    parts, origin = shapely.get_parts(shapely.intersection(strips, polygon), return_index=True)
    # the piece of a strip that starts at its corner; what lies beyond the wall that it meets is another piece
    near = (shapely.distance(parts, starts[origin]) < SLIT_M) & (shapely.get_dimensions(parts) == 2)
    parts = parts[near]
    doors = shapely.union_all(avoid) if avoid else shapely.Polygon()
    # to a tenth of a millimetre: slits of one length keep the order of the corners, whatever the last bit says
    keys = [np.round(shapely.area(parts), 6), shapely.intersects(parts, doors)]
    return [parts[i] for i in np.lexsort(keys)]


def _strip(corner: Any, axis: tuple[int, int], side: int, reach: float) -> Polygon:
    along, across = np.array(axis), np.array(axis[::-1]) * side * SLIT_M
    return shapely.Polygon([corner, corner + along * reach, corner + along * reach + across, corner + across])
