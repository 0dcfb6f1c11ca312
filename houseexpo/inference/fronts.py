"""Find fronts: faces of walls, extended past the wall's end to the wall across the opening.

::

        room
    =========A.......B=========      A, B, C, D  corners of two wall ends
      wall   |  neck  |  wall        A..B, C..D  fronts: a face of the wall, extended
    =========C.......D=========
        room
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.inference.rays import Floats, Walls

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

NARROWEST_M: Final = 0.4
WIDEST_M: Final = 2.2

_CORNER: Final = np.sin(np.deg2rad(35.0))
_STEP_M: Final = 0.025  # an edge that deviates less from an axis counts as parallel: published walls have steps of 1 cm
_INWARD_M: Final = 0.012  # into the neck: a ray along the face itself would graze the wall on the other side
_ONWARD_M: Final = 0.02  # past the end, beyond its steps
_SNAP_M: Final = 0.08
_LOOKS_M: Final = (0.15, 0.3)
_STAND_M: Final = 0.4
_FARTHEST_M: Final = 10.0


@dataclass(frozen=True, eq=False)
class Fronts:
    """Lines (k, 2, 2) across openings, and the unit vectors (k, 2) from them into the neck.

    ``is_corner`` (k, 2) tells for each end of a line whether a wall ends there. ``room`` (k,) is the width of the space
    in front of the line, metres, 0.0 if there is none.
    """

    line: Floats
    into: Floats
    is_corner: npt.NDArray[np.bool_]
    room: Floats

    @property
    def middle(self) -> Floats:
        """Middles of the lines (k, 2), metres."""
        return np.asarray(self.line.mean(axis=1))

    @property
    def width(self) -> Floats:
        """Lengths of the lines (k,), metres."""
        return np.asarray(np.hypot(*(self.line[:, 1] - self.line[:, 0]).T))


def find_fronts(shape: Polygon | MultiPolygon, walls: Walls) -> Fronts:
    """Return every front with the width of a door in a free space (metres), whose edges are ``walls``."""
    corner, leading, leaving = _corners(shape)
    start = np.concatenate([corner, corner])
    along = np.concatenate([leading, -leaving])  # either wall at a corner may be the ending one
    into = np.concatenate([_right_of(leading), -_right_of(-leaving)])
    reach = _ONWARD_M + walls.distance(start + _INWARD_M * into + _ONWARD_M * along, along)
    found = (reach >= NARROWEST_M) & (reach <= WIDEST_M)
    line = np.stack([start[found], start[found] + reach[found, None] * along[found]], axis=1)
    line, ends_at_corner = _snapped(line, corner)
    into = _squared(line, into[found])
    is_corner = np.stack([np.ones(len(line), dtype=bool), ends_at_corner], axis=1)
    return Fronts(line, into, is_corner, _room(line, into, walls))


def _corners(shape: Polygon | MultiPolygon) -> tuple[Floats, Floats, Floats]:
    """Return corners that project into the free space (k, 2), and the directions of their incoming and outgoing edges.

    Rings are traversed with the free space on the left.
    """
    import shapely

    corner, leading, leaving = [], [], []
    for ring in shapely.get_rings(shapely.get_parts(shapely.orient_polygons(shape))):
        points = shapely.get_coordinates(ring)[:-1]
        direction = _directions(np.roll(points, -1, axis=0) - points)
        corner.append(points)
        leaving.append(direction)
        leading.append(np.roll(direction, 1, axis=0))
    at, before, after = np.concatenate(corner), np.concatenate(leading), np.concatenate(leaving)
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    juts = turn < -_CORNER
    return at[juts], before[juts], after[juts]


def _directions(edge: Floats) -> Floats:
    """Return unit directions of edges (k, 2), along an axis if within a step of it, as short edges are noisy."""
    length = np.hypot(*edge.T)[:, None]
    axis = np.where(np.abs(edge) > np.abs(edge[:, ::-1]), np.sign(edge), 0.0)
    off = np.abs(edge).min(axis=1)
    return np.where((off <= np.minimum(_STEP_M, length[:, 0] / 2))[:, None], axis, edge / length)


def _right_of(direction: Floats) -> Floats:
    return np.stack([direction[:, 1], -direction[:, 0]], axis=1)


def _snapped(line: Floats, corner: Floats) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Move far ends to a nearby corner; also return which ones were moved."""
    from scipy.spatial import cKDTree

    if not len(line):
        return line, np.zeros(0, dtype=bool)
    apart, nearest = cKDTree(corner).query(line[:, 1], distance_upper_bound=_SNAP_M)
    close = np.isfinite(apart)
    snapped = line.copy()
    snapped[close, 1] = corner[nearest[close]]
    return snapped, close


def _squared(line: Floats, into: Floats) -> Floats:
    """Return the unit normals of lines on the side of ``into``."""
    along = line[:, 1] - line[:, 0]
    normal = _right_of(along) / np.hypot(*along.T)[:, None]
    side = np.where((normal * into).sum(axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(normal * side[:, None])


def _room(line: Floats, into: Floats, walls: Walls) -> Floats:
    """Return the width of the space a little in front of each front, in the front's direction."""
    along, middle = _right_of(into), line.mean(axis=1)
    widest = np.zeros(len(line))
    for look in _LOOKS_M:
        at = middle - look * into
        wide = walls.distance(at, along) + walls.distance(at, -along)
        widest = np.maximum(widest, np.minimum(wide, _FARTHEST_M))
    return np.where(walls.distance(middle, -into) >= _STAND_M, widest, 0.0)
