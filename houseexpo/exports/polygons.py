"""Turn polygons with holes into simpler shapes for formats: one ring with slits to its holes, or convex trapezoids."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.errors import PlanError
from houseexpo.grids.raster import all_rings
from houseexpo.plan import Ring
from houseexpo.plan.parts import signed_area
from houseexpo.tolerances import GRID_M, SLIVER_M2

if TYPE_CHECKING:
    from shapely import Polygon

_GRID_DIGITS = 2  # the format's 1 cm grid
_AXES: Final = ((1, 0), (-1, 0), (0, 1), (0, -1))


def join_holes_by_slits(polygon: Polygon, avoid: Sequence[Polygon] = ()) -> Polygon:
    """Join the holes of a polygon to its outline, each by the shortest slit.

    S1  A slit is 0.01 m wide. It runs along an axis and on the 1 cm grid from a corner of the hole to the outline or
        to another hole, whichever comes first. Therefore it closes only the path between these two walls, and the area
        stays connected.
    S2  Of equally short slits, a slit that does not cross ``avoid`` (doors) is preferred.

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
        polygon = _join_one_hole(polygon, avoid)
    return polygon


def _join_one_hole(polygon: Polygon, avoid: Sequence[Polygon]) -> Polygon:
    hole = shapely.Polygon(polygon.interiors[0])
    for slit in _slits(polygon, hole, avoid):
        cut = shapely.difference(polygon, slit)
        cut = shapely.simplify(shapely.transform(cut, lambda points: points.round(_GRID_DIGITS)), 0.0)
        if cut.geom_type == "Polygon" and cut.is_valid and len(cut.interiors) == len(polygon.interiors) - 1:
            return cut
    where = hole.representative_point()
    problem = (
        f"expected a hole that a slit can join to the outline, found none for the one at ({where.x:.2f}, {where.y:.2f})"
    )
    raise PlanError(f"{problem}; drop the holes instead", "holes")


def _slits(polygon: Polygon, hole: Polygon, avoid: Sequence[Polygon]) -> list[Any]:
    """Return possible slits, the best first: parts of the polygon in strips along an axis from the hole's corners."""
    corners = shapely.get_coordinates(hole)[:-1].round(_GRID_DIGITS)
    reach = float(np.hypot(*np.subtract(polygon.bounds[2:], polygon.bounds[:2])))
    strips = [_strip(corner, axis, side, reach) for corner in corners for axis in _AXES for side in (1, -1)]
    starts = shapely.points(np.repeat(corners, 2 * len(_AXES), axis=0))
    parts, origin = shapely.get_parts(shapely.intersection(strips, polygon), return_index=True)
    # the piece of a strip that starts at its corner; beyond the first wall that it meets there is another piece
    near = (shapely.distance(parts, starts[origin]) < GRID_M) & (shapely.get_dimensions(parts) == 2)
    parts = parts[near]
    doors = shapely.union_all(avoid) if avoid else shapely.Polygon()
    # rounded to a tenth of a millimetre, so that slits of equal length keep the order of the corners
    keys = [np.round(shapely.area(parts), 6), shapely.intersects(parts, doors)]
    return [parts[i] for i in np.lexsort(keys)]


def _strip(corner: Any, axis: tuple[int, int], side: int, reach: float) -> Polygon:
    along, across = np.array(axis), np.array(axis[::-1]) * side * GRID_M
    return shapely.Polygon([corner, corner + along * reach, corner + along * reach + across, corner + across])


def cut_into_trapezoids(polygon: Polygon) -> list[Ring]:
    """Cut a valid polygon, including its holes, along vertical lines through its vertices.

    A vertical line sweeps from left to right. Between two neighbouring stops, the edges that it crosses form pairs of a
    lower and an upper edge, with the polygon between them. Each pair is one trapezoid until it ends.

    Returns
    -------
    Rings (3 or 4, 2), metres, counter-clockwise, in the order in which they end; together they cover the polygon.
    """
    edges = _Edges(all_rings(polygon))
    stops = edges.stops.tolist()
    since: dict[tuple[int, int], float] = {}
    found: list[Ring] = []
    for left, right in zip(stops, [*stops[1:], None], strict=True):
        pairs = edges.pairs(left, right) if right is not None else []
        lasting = set(pairs)
        found += [edges.between(*pair, start, left) for pair, start in since.items() if pair not in lasting]
        since = {pair: since.get(pair, left) for pair in pairs}
    return [ring for ring in found if signed_area(ring) > SLIVER_M2]


class _Edges:
    """The edges of some rings that are not vertical, with the left end first."""

    def __init__(self, rings: list[Ring]) -> None:
        here = np.concatenate(rings)
        there = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
        leaning = here[:, 0] != there[:, 0]
        here, there = here[leaning], there[leaning]
        swap = (here[:, 0] > there[:, 0])[:, None]
        self.start, self.end = np.where(swap, there, here), np.where(swap, here, there)
        self.slope = (self.end[:, 1] - self.start[:, 1]) / (self.end[:, 0] - self.start[:, 0])
        self.stops: npt.NDArray[np.float64] = np.unique(np.concatenate([self.start[:, 0], self.end[:, 0]]))

    def pairs(self, left: float, right: float) -> list[tuple[int, int]]:
        """Return the (lower, upper) edges that bound the polygon between two stops, from below."""
        crossed = np.flatnonzero((self.start[:, 0] <= left) & (self.end[:, 0] >= right))
        middle = self.start[crossed, 1] + self.slope[crossed] * ((left + right) / 2 - self.start[crossed, 0])
        order = crossed[np.argsort(middle, kind="stable")].tolist()
        return list(zip(order[::2], order[1::2], strict=True))

    def between(self, low: int, high: int, left: float, right: float) -> Ring:
        """Return the trapezoid between two edges and two vertical lines, without coincident corners."""
        corners = [(left, self._y(low, left)), (right, self._y(low, right))]
        corners += [(right, self._y(high, right)), (left, self._y(high, left))]
        return np.array([corner for i, corner in enumerate(corners) if corner != corners[i - 1]])

    def _y(self, edge: int, x: float) -> float:
        if x == self.end[edge, 0]:
            return float(self.end[edge, 1])  # not from the slope, since rounding would leave a gap to the next edge
        return float(self.start[edge, 1] + self.slope[edge] * (x - self.start[edge, 0]))
