"""Find openings without a door: where a wall between two rooms of the source stops and leaves a straight, passable gap.

R1  An opening lies in the middle between two rooms, at most ``THICK_WALL_M`` apart, where nothing stands. It is
    straight and wide enough to walk through.
R2  Walls stand at both of its ends, and at one end or both a wall goes on that parts the same two rooms: somebody drew
    the wall and left the way open. Two rooms without any wall between them have no opening: they are one space that the
    source divides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import buffer_mitred, intersect, polygons_of
from pipeline.tolerances import NEARLY_ALL, SHEET_M, SHOULDERS_M, STAND_M, THICK_WALL_M, THIN_WALL_M

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DoorlessOpening:
    """A straight opening: ``middle`` (2,), unit ``along`` it, its ``width_m``; the rooms are ``apart_m`` apart."""

    middle: Floats
    along: Floats
    width_m: float
    apart_m: float

    @property
    def across(self) -> Floats:
        """Unit vector (2,) from one room to the other."""
        return np.array([-self.along[1], self.along[0]])

    def strip(self, *, deeper_m: float = 0.0, wider_m: float = 0.0) -> Polygon:
        """Return the rectangle from wall to wall and from room to room, so many metres larger on each side."""
        half = self.along * (self.width_m / 2 + wider_m)
        aside = self.across * (self.apart_m / 2 + deeper_m)
        a, b = self.middle - half, self.middle + half
        return Polygon([a - aside, b - aside, b + aside, a + aside])


def find_doorless_openings(rooms: Sequence[Polygon], free: BaseGeometry, walls: BaseGeometry) -> list[DoorlessOpening]:
    """Return the openings between drawn rooms, in the order of the rooms.

    Parameters
    ----------
    free
        Where openings may lie: what of the plan nothing closes.
    walls
        What stands.
    """
    if len(rooms) < 2 or free.is_empty or walls.is_empty:
        return []
    shapely.prepare(walls)
    pairs = shapely.STRtree(rooms).query(rooms, predicate="dwithin", distance=THICK_WALL_M).T.tolist()
    found = []
    for one, other in sorted((i, j) for i, j in pairs if i < j):
        apart = float(rooms[one].distance(rooms[other]))
        near = [buffer_mitred(rooms[k], apart / 2 + SHEET_M) for k in (one, other)]
        for piece in polygons_of(intersect(intersect(near[0], near[1]), free)):
            opening = _straight(piece, apart)
            if opening is not None and _is_between(opening, (rooms[one], rooms[other]), walls):
                found.append(opening)
    return found


def _straight(piece: Polygon, apart: float) -> DoorlessOpening | None:
    """R1."""
    box = shapely.oriented_envelope(piece)
    if box.geom_type != "Polygon" or piece.area < NEARLY_ALL * box.area:
        return None
    corners = shapely.get_coordinates(box)[:4]
    sides = corners[1] - corners[0], corners[2] - corners[1]
    lengths = [float(np.hypot(*side)) for side in sides]
    k = int(lengths[1] > lengths[0])
    if lengths[k] < SHOULDERS_M or lengths[1 - k] > 2 * SHEET_M + STAND_M:
        return None
    return DoorlessOpening(corners.mean(axis=0), sides[k] / lengths[k], lengths[k], apart)


def _is_between(opening: DoorlessOpening, rooms: tuple[Polygon, Polygon], walls: BaseGeometry) -> bool:
    """R2."""
    sides = [(opening.middle + sign * opening.along * opening.width_m / 2, sign * opening.along) for sign in (-1, 1)]
    if not all(shapely.dwithin(walls, shapely.points(end + STAND_M * out), SHEET_M) for end, out in sides):
        return False
    beside = (_rooms_beside(end + THIN_WALL_M * out, opening.across, rooms, walls) for end, out in sides)
    return any(found in ((0, 1), (1, 0)) for found in beside)


def _rooms_beside(
    at: Floats, across: Floats, rooms: tuple[Polygon, Polygon], walls: BaseGeometry
) -> tuple[int | None, ...]:
    """Return which of the rooms lie on the two sides of the wall at a point; nothing where no wall stands there."""
    line = shapely.linestrings([at - THICK_WALL_M * across, at + THICK_WALL_M * across])
    pieces = [piece for piece in shapely.get_parts(shapely.intersection(line, walls)) if piece.length > 0]
    wall = min(pieces, key=shapely.points(at).distance, default=None)
    if wall is None or wall.distance(shapely.points(at)) > SHEET_M:
        return ()
    places = shapely.line_locate_point(line, shapely.points(shapely.get_coordinates(wall)))
    beside = at + (np.array([[places.min() - STAND_M], [places.max() + STAND_M]]) - THICK_WALL_M) * across
    return tuple(next((k for k in (0, 1) if shapely.intersects_xy(rooms[k], *point)), None) for point in beside)
