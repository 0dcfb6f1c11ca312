"""Convert a polygon with holes to one ring: each hole is joined to the outline by a slit, a wall of 1 cm."""

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
    """Join the holes of a polygon to its outline, each by the shortest slit.

    S1  A slit is 0.01 m wide. It runs along an axis and on the 1 cm grid from a corner of the hole to the outline or
        to another hole, whichever comes first. Therefore it closes only the path between these two walls, and the area
        stays connected.
    S2  Of equally short slits, one that does not cross ``avoid`` (doors) is preferred.

    Parameters
    ----------
    polygon
        A valid polygon, metres.
    avoid
        Areas that slits should not cross if possible.

    Returns
    -------
    A valid polygon without holes, smaller by 0.01 m times the length of the slits.

    Raises
    ------
    PlanError
        No slit gives a simple ring.
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
    """Return possible slits, the best first: parts of the polygon in strips along an axis from the hole's corners."""
    corners = shapely.get_coordinates(hole)[:-1].round(_DIGITS)
    reach = float(np.hypot(*np.subtract(polygon.bounds[2:], polygon.bounds[:2])))
    strips = [_strip(corner, axis, side, reach) for corner in corners for axis in _AXES for side in (1, -1)]
    starts = shapely.points(np.repeat(corners, 2 * len(_AXES), axis=0))
    parts, origin = shapely.get_parts(shapely.intersection(strips, polygon), return_index=True)
    # the piece of a strip that starts at its corner; beyond the first wall that it meets there is another piece
    near = (shapely.distance(parts, starts[origin]) < SLIT_M) & (shapely.get_dimensions(parts) == 2)
    parts = parts[near]
    doors = shapely.union_all(avoid) if avoid else shapely.Polygon()
    # rounded to a tenth of a millimetre, so that slits of equal length keep the order of the corners
    keys = [np.round(shapely.area(parts), 6), shapely.intersects(parts, doors)]
    return [parts[i] for i in np.lexsort(keys)]


def _strip(corner: Any, axis: tuple[int, int], side: int, reach: float) -> Polygon:
    along, across = np.array(axis), np.array(axis[::-1]) * side * SLIT_M
    return shapely.Polygon([corner, corner + along * reach, corner + along * reach + across, corner + across])
