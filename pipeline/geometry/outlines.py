"""The rings of an area with the corners that it has, and no others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

Floats = npt.NDArray[np.float64]


def outlines(area: Polygon, detail_m: float) -> Iterator[Floats]:
    """Yield the rings (n, 2) of an area, unclosed, the area on their left, without details smaller than ``detail_m``.

    Simplifying (Douglas-Peucker) keeps the point that lies farthest from the line between two others. Of the points of
    one edge parallel to that line any may be it, also one in the middle of the edge: such points are dropped here.
    """
    shape = shapely.orient_polygons(area.simplify(detail_m))
    for ring in (shape.exterior, *shape.interiors):
        yield _corners(shapely.get_coordinates(ring)[:-1], detail_m)


def _corners(points: Floats, detail_m: float) -> Floats:
    """The points that lie off the line between their neighbours; of two in a row that do not, the first goes."""
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    along, to = after - before, points - before
    length = np.hypot(*along.T)
    off = np.abs(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]) / np.where(length > 0, length, 1.0)
    between = (to * along).sum(axis=1) / np.where(length > 0, length, 1.0) ** 2
    straight = (off < detail_m) & (between > 0) & (between < 1)
    dropped = straight & ~np.roll(straight, 1)
    return points if len(points) - np.count_nonzero(dropped) < 3 else points[~dropped]
