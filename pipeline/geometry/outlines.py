"""The rings of areas with the corners that they have, and no others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Outlines:
    """Corners (n, 2) of unclosed rings, one after the other, the area on their left.

    ``ring`` (n,) ascends and says in which ring a corner is, ``area`` (n,) of which of the areas.
    """

    points: Floats
    ring: Indices
    area: Indices

    @cached_property
    def after(self) -> Indices:
        """For each corner the index of the next one of its ring."""
        after = np.arange(1, len(self.points) + 1)
        after[self._last] = self._first
        return after

    @cached_property
    def before(self) -> Indices:
        """For each corner the index of the one before it in its ring."""
        before = np.arange(-1, len(self.points) - 1)
        before[self._first] = self._last
        return before

    @cached_property
    def _first(self) -> Indices:
        return np.flatnonzero(np.diff(self.ring, prepend=-1))

    @cached_property
    def _last(self) -> Indices:
        return np.flatnonzero(np.diff(self.ring, append=-1))

    def only(self, kept: npt.NDArray[np.bool_]) -> Outlines:
        """The same rings with these of the corners (n,)."""
        return Outlines(self.points[kept], self.ring[kept], self.area[kept])


def outlines(areas: Sequence[Polygon], detail_m: float) -> Outlines:
    """The rings of some areas, without details smaller than ``detail_m``.

    Simplifying (Douglas-Peucker) keeps the point that lies farthest from the line between two others. Of the points of
    one edge parallel to that line any may be it, also one in the middle of the edge: such points are dropped here.
    """
    shapes = shapely.orient_polygons(shapely.simplify(np.array(areas, dtype=np.object_), detail_m))
    rings, of_area = shapely.get_rings(shapes, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    closed = Outlines(points, ring, of_area[ring])
    return _corners(closed.only(np.diff(ring, append=-1) == 0), detail_m)


def _corners(found: Outlines, detail_m: float) -> Outlines:
    """The points that lie off the line between their neighbours; of two in a row that do not, the first goes."""
    before = found.points[found.before]
    along, to = found.points[found.after] - before, found.points - before
    length = np.hypot(*along.T)
    off = np.abs(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]) / np.where(length > 0, length, 1.0)
    between = (to * along).sum(axis=1) / np.where(length > 0, length, 1.0) ** 2
    straight = (off < detail_m) & (between > 0) & (between < 1)
    kept = ~straight | straight[found.before]
    too_few = np.bincount(found.ring, kept) < 3
    return found.only(kept | too_few[found.ring])
