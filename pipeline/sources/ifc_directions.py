"""Which way the wall runs at a hole.

R1  Where the door's width is known and one side of the hole has it, the wall runs along that side.
R2  Else it runs where more of the wall lies before and behind the hole; where that does not tell, along the longer
    side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.sources.ifc_file import Hole
from pipeline.sources.ifc_shapes import footprint

WIDTH_M = 0.06  # a side this near to a door's width is its width
LOOK_M = 3.0
MORE = 1.3  # so many times more wall one way than the other


@dataclass(frozen=True)
class Axis:
    """A unit direction in plan."""

    x: float
    y: float

    def turned(self) -> Axis:
        """The direction a quarter turn to the left."""
        return Axis(-self.y, self.x)

    def span(self, points: npt.NDArray[np.float64]) -> tuple[float, float]:
        """From where to where points (n, 2) reach along the axis."""
        places = points @ (self.x, self.y)
        return float(places.min()), float(places.max())

    def box(self, along: tuple[float, float], across: tuple[float, float]) -> Polygon:
        """The rectangle of these spans along the axis and across it."""
        u, v = np.array((self.x, self.y)), np.array((-self.y, self.x))
        return Polygon([u * a + v * c for a, c in zip((*along, *along[::-1]), np.repeat(across, 2), strict=True)])


def along_wall(hole: Hole, standing: BaseGeometry) -> Axis:
    """The direction of the wall at a hole; ``standing`` is the plan shape of the walls about it."""
    points = hole.mesh.vertices[:, :2]
    one = _side(hole)
    sides = (one, one.turned())
    lengths = [float(np.ptp(side.span(points))) for side in sides]
    if hole.width_m:  # R1
        fits = [abs(length - hole.width_m) <= WIDTH_M for length in lengths]
        if fits[0] != fits[1]:
            return sides[fits.index(True)]
    middle = points.min(axis=0) / 2 + points.max(axis=0) / 2
    wall = standing.union(footprint(hole.mesh))
    runs = [_run(wall, (float(middle[0]), float(middle[1])), side) for side in sides]
    if max(runs) > MORE * min(runs):  # R2
        return sides[runs.index(max(runs))]
    return sides[lengths.index(max(lengths))]


def _side(hole: Hole) -> Axis:
    """The direction of one side of the hole's body: the door's own where it is one, else the least rectangle's."""
    shape = shapely.oriented_envelope(footprint(hole.mesh))
    if hole.along and (hole.host is None or not isinstance(shape, Polygon)):
        length = float(np.hypot(*hole.along))
        return Axis(hole.along[0] / length, hole.along[1] / length)
    if not isinstance(shape, Polygon) or shape.is_empty:
        return Axis(1.0, 0.0)
    corners = np.asarray(shape.exterior.coords)
    side = (corners[1] - corners[0]) / max(float(np.hypot(*(corners[1] - corners[0]))), 1e-9)
    return Axis(float(side[0]), float(side[1]))


def _run(wall: BaseGeometry, middle: tuple[float, float], side: Axis) -> float:
    """Length of the wall through the hole's middle along a direction."""
    x, y = middle
    line = LineString([(x - LOOK_M * side.x, y - LOOK_M * side.y), (x + LOOK_M * side.x, y + LOOK_M * side.y)])
    pieces = shapely.get_parts(line.intersection(wall))
    return float(sum(piece.length for piece in pieces if piece.distance(shapely.Point(middle)) < WIDTH_M))
