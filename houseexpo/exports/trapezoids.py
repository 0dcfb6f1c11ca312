"""Cut polygons with holes into convex pieces: rectangles along the axes, and trapezoids for oblique walls."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from houseexpo.grids.raster import rings_of
from houseexpo.plan import Ring
from houseexpo.plan.area import signed_area

if TYPE_CHECKING:
    from shapely import Polygon

_SLIVER_M2 = 1e-7


def trapezoids(polygon: Polygon) -> list[Ring]:
    """Cut a valid polygon, including its holes, along vertical lines through its vertices.

    A vertical line sweeps from left to right. Between two neighbouring stops, the edges that it crosses form pairs of a
    lower and an upper edge, with the polygon between them. Each pair is one trapezoid until it ends.

    Returns
    -------
    Rings (3 or 4, 2), metres, counter-clockwise, in the order in which they end; together they cover the polygon.
    """
    edges = _Edges(rings_of(polygon))
    stops = edges.stops.tolist()
    since: dict[tuple[int, int], float] = {}
    found: list[Ring] = []
    for left, right in zip(stops, [*stops[1:], None], strict=True):
        pairs = edges.pairs(left, right) if right is not None else []
        lasting = set(pairs)
        found += [edges.between(*pair, start, left) for pair, start in since.items() if pair not in lasting]
        since = {pair: since.get(pair, left) for pair in pairs}
    return [ring for ring in found if signed_area(ring) > _SLIVER_M2]


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
