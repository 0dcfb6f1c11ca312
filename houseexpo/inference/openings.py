"""Find candidates for doors (openings) in a free space: short gaps between walls, the most likely first.

An opening lies between two *fronts* that face each other through the thickness of a wall. A front is a face of a
wall, extended past the wall's end to the opposite wall.

::

        room
    =========A.......B=========      A, B, C, D  corners of two wall ends
      wall   |opening |  wall        A..B, C..D  fronts
    =========C.......D=========
        room
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.tolerances import (
    ASIDE,
    AXIS_STEP_M,
    COMMON_DOOR_M,
    CORNER,
    DEEPEST_DOOR_M,
    DOOR_M,
    FARTHEST_LOOK_M,
    FRONT_DEPTH_M,
    FRONT_SNAP_M,
    FRONTS_FACING,
    HINT_M,
    INWARD_M,
    LOOKS_M,
    RAY_START_M,
    SAME_M,
    SHALLOW_M,
    SHALLOWEST_DOOR_M,
    STRAIGHTEN_WALLS_M,
    USUAL_DEPTH_M,
    WIDER_M,
)

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Floats = npt.NDArray[np.float64]


_RAY_WALL_PAIRS: Final = 500_000  # rays times walls at once: 4 MB per array


@dataclass(frozen=True, eq=False)
class OpeningCandidate:
    """A candidate: its two fronts (2, 2, 2) in the same direction, and the unit vectors (2, 2) from them into it.

    ``width`` and ``depth`` are in metres; ``room`` is the width of the narrower of the two spaces in front of it;
    ``whole`` is the number of jambs where a wall ends; a candidate with a lower ``cost`` is more likely a door.
    """

    fronts: Floats
    into: Floats
    width: float
    depth: float
    room: float
    whole: int
    cost: float

    @property
    def middle(self) -> Floats:
        """The middle of the candidate (2,), metres."""
        return np.asarray(self.fronts.mean(axis=(0, 1)))

    @property
    def segment(self) -> Floats:
        """The line (2, 2) from jamb to jamb on the wall's centre line, metres."""
        return np.asarray(self.fronts.mean(axis=0))


def find_openings(space: Polygon | MultiPolygon) -> list[OpeningCandidate]:
    """Return all candidates of a free space (metres), the most likely first.

    R1  Two fronts lie opposite each other, at most 0.8 m apart, and the line of sight between them is free.
    R2  A jamb is *whole* if a wall ends there with both corners. A passage along a wall has one whole jamb. One between
        two walls, each of which starts where the other ends, has none, which is the weakest evidence.
    R3  The space is wider by 0.12 m on both sides. If a narrow passage through a thin wall has a whole jamb, one side
        need only be slightly wider, as in a closet that is hardly wider than its door.
    R4  A wide passage must have a whole jamb. One that is deeper than most walls must be narrow and have a whole jamb.
    """
    import shapely

    shape = shapely.simplify(space, STRAIGHTEN_WALLS_M)
    walls = _Walls(shape)
    fronts = find_wall_fronts(shape, walls)
    first, second = _opposite(fronts)
    to = fronts.middle[second] - fronts.middle[first]
    span = np.hypot(*to.T)
    clear = walls.distance(fronts.middle[first], to / span[:, None]) > span
    found = (_neck(fronts, i, j) for i, j in zip(first[clear].tolist(), second[clear].tolist(), strict=True))
    return sorted((n for n in found if n is not None), key=lambda n: (n.cost, *n.middle))


def _opposite(fronts: _Fronts) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return pairs of fronts that may be the two faces of one wall (R1)."""
    from scipy.spatial import cKDTree

    if not len(fronts.line):
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    pairs = cKDTree(fronts.middle).query_pairs(1.5 * DEEPEST_DOOR_M, output_type="ndarray")
    i, j = pairs.T
    to = fronts.middle[j] - fronts.middle[i]
    depth = (to * fronts.into[i]).sum(axis=1)
    aside = np.abs(to[:, 0] * fronts.into[i, 1] - to[:, 1] * fronts.into[i, 0])
    facing = (fronts.into[i] * fronts.into[j]).sum(axis=1) < FRONTS_FACING
    near = (
        (depth > SHALLOWEST_DOOR_M)
        & (depth <= DEEPEST_DOOR_M)
        & (aside < ASIDE * np.minimum(fronts.width[i], fronts.width[j]))
    )
    return i[facing & near], j[facing & near]


def _neck(fronts: _Fronts, i: int, j: int) -> OpeningCandidate | None:
    """Return the candidate between two fronts, or None if it violates R3 or R4."""
    line, width = fronts.line[[i, j]], fronts.width[[i, j]]
    corner = fronts.is_corner[[i, j]]
    if (line[0, 1] - line[0, 0]) @ (line[1, 1] - line[1, 0]) < 0:
        line[1], corner[1] = line[1, ::-1], corner[1, ::-1].copy()
    whole = int(corner.all(axis=0).sum())  # R2
    depth = float((line[1] - line[0]).mean(axis=0) @ fronts.into[i])
    across = float(width.min())
    widens = np.sort(fronts.room[[i, j]] - width)
    narrow = across <= COMMON_DOOR_M and whole > 0
    if widens[0] < (HINT_M if narrow and depth <= SHALLOW_M else WIDER_M) or widens[1] < WIDER_M:  # R3
        return None
    if not narrow and (depth > USUAL_DEPTH_M or (across > COMMON_DOOR_M and not whole)):  # R4
        return None
    cost = across + 0.5 * depth + 0.35 * (2 - whole) + float(np.ptp(width)) - 0.3 * min(float(widens[0]), 0.5)
    return OpeningCandidate(line, fronts.into[[i, j]], across, depth, float(fronts.room[[i, j]].min()), whole, cost)


@dataclass(frozen=True, eq=False)
class _Fronts:
    """Lines (k, 2, 2) across openings, and the unit vectors (k, 2) from them into the opening.

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


def find_wall_fronts(shape: Polygon | MultiPolygon, walls: _Walls) -> _Fronts:
    """Return every front with the width of a door in a free space (metres), whose edges are ``walls``."""
    corner, leading, leaving = _corners(shape)
    start = np.concatenate([corner, corner])
    along = np.concatenate([leading, -leaving])  # either wall at a corner may be the ending one
    into = np.concatenate([_right_of(leading), -_right_of(-leaving)])
    reach = RAY_START_M + walls.distance(start + INWARD_M * into + RAY_START_M * along, along)
    found = (reach >= DOOR_M[0]) & (reach <= DOOR_M[1])
    line = np.stack([start[found], start[found] + reach[found, None] * along[found]], axis=1)
    line, ends_at_corner = _snap_ends(line, corner)
    into = _normals(line, into[found])
    is_corner = np.stack([np.ones(len(line), dtype=bool), ends_at_corner], axis=1)
    return _Fronts(line, into, is_corner, _space_in_front(line, into, walls))


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
    juts = turn < -CORNER
    return at[juts], before[juts], after[juts]


def _directions(edge: Floats) -> Floats:
    """Return unit directions of edges (k, 2), snapped to an axis within a step of it, since short edges are noisy."""
    length = np.hypot(*edge.T)[:, None]
    axis = np.where(np.abs(edge) > np.abs(edge[:, ::-1]), np.sign(edge), 0.0)
    off = np.abs(edge).min(axis=1)
    return np.where((off <= np.minimum(AXIS_STEP_M, length[:, 0] / 2))[:, None], axis, edge / length)


def _right_of(direction: Floats) -> Floats:
    return np.stack([direction[:, 1], -direction[:, 0]], axis=1)


def _snap_ends(line: Floats, corner: Floats) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Move far ends to a nearby corner; also return which ends were moved."""
    from scipy.spatial import cKDTree

    if not len(line):
        return line, np.zeros(0, dtype=bool)
    apart, nearest = cKDTree(corner).query(line[:, 1], distance_upper_bound=FRONT_SNAP_M)
    close = np.isfinite(apart)
    snapped = line.copy()
    snapped[close, 1] = corner[nearest[close]]
    return snapped, close


def _normals(line: Floats, into: Floats) -> Floats:
    """Return the unit normals of lines on the side of ``into``."""
    along = line[:, 1] - line[:, 0]
    normal = _right_of(along) / np.hypot(*along.T)[:, None]
    side = np.where((normal * into).sum(axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(normal * side[:, None])


def _space_in_front(line: Floats, into: Floats, walls: _Walls) -> Floats:
    """Return the width of the space a little in front of each front, in the front's direction."""
    along, middle = _right_of(into), line.mean(axis=1)
    widest = np.zeros(len(line))
    for look in LOOKS_M:
        at = middle - look * into
        wide = walls.distance(at, along) + walls.distance(at, -along)
        widest = np.maximum(widest, np.minimum(wide, FARTHEST_LOOK_M))
    return np.where(walls.distance(middle, -into) >= FRONT_DEPTH_M, widest, 0.0)


class _Walls:
    """The edges of a shape (metres) as obstacles."""

    def __init__(self, shape: Polygon | MultiPolygon) -> None:
        import shapely

        points, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(shape)), return_index=True)
        same = ring[1:] == ring[:-1]
        self._start = points[:-1][same]
        self._edge = (points[1:] - points[:-1])[same]

    def distance(self, origins: Floats, directions: Floats) -> Floats:
        """Return the distance (k,) from each origin (k, 2) along its unit direction (k, 2) to the first wall, metres.

        It is infinite if there is no wall. A ray along a wall does not hit it.
        """
        step = max(1, _RAY_WALL_PAIRS // max(1, len(self._start)))
        parts = [self._nearest(origins[k : k + step], directions[k : k + step]) for k in range(0, len(origins), step)]
        return np.concatenate(parts) if parts else np.empty(0)

    def _nearest(self, origins: Floats, directions: Floats) -> Floats:
        ray_x, ray_y = directions[:, :1], directions[:, 1:]
        wall_x, wall_y = self._edge.T
        to_x, to_y = self._start[:, 0] - origins[:, :1], self._start[:, 1] - origins[:, 1:]
        turn = ray_x * wall_y - ray_y * wall_x
        with np.errstate(divide="ignore", invalid="ignore"):  # parallel lines do not meet
            along_ray = (to_x * wall_y - to_y * wall_x) / turn
            along_wall = (to_x * ray_y - to_y * ray_x) / turn
        meets = (along_wall >= 0.0) & (along_wall <= 1.0) & (along_ray > SAME_M)
        return np.asarray(np.where(meets, along_ray, np.inf).min(axis=1, initial=np.inf))
