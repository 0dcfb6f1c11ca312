r"""Measure where a disc robot can go: the areas for its centre (polygons), and their number, shares and bottlenecks.

A disc of a given radius can be where its centre is at least that far from all walls. These areas are the free space,
eroded by the radius. They are in several pieces if a passage between them is too narrow.

A passage is a narrow place: it runs from a corner to another corner or to a wall, and shows which robots fit through.

::

    ======A                          A, B  corners that project into the space
    wall  |\
    ======A-B===                     A-B   a passage from corner to corner
          :  wall
    ......:.............             A..:  a passage from a corner straight to a wall
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.errors import PlanError
from houseexpo.plan import RADII_M, Navigability, NavigabilityByRadius, PlanData
from houseexpo.tolerances import (
    COMMON_OPENING_M,
    ROBOT_SPECK_M2,
    ROUND,
    SAME_M,
    SPLIT_M,
    SPLIT_STEP_M,
    STRAIGHTEN_AREA_M,
)

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon


_SPECK_RADIUS_M: Final = (ROBOT_SPECK_M2 / np.pi) ** 0.5


def navigability(space: PlanData | Polygon | MultiPolygon, radii: Sequence[float] = RADII_M) -> NavigabilityByRadius:
    """Measure the areas that a disc robot can reach, for each radius in metres.

    The result maps each radius, as text with two decimals (``"0.20"``), to three figures:

    1. ``components``: the centre of the disc can be in the free space eroded by the radius. This is the number of its
       connected pieces; pieces under 0.1 m2 are ignored, here and below.
    2. ``largest_share`` is the largest piece's share of the area of all pieces, 0.0 without pieces.
    3. ``narrowest`` is the width of the bottleneck of the largest piece, metres. The piece is eroded further until it
       splits in two; twice the radius at which it does is the narrowest place between any two of its points. If it
       never splits, there is no passage, and ``narrowest`` is the diameter of the widest disc that fits. A part counts
       if it outlasts the split by up to 0.05 m of radius.

    Walls are first straightened by at most 0.01 m, and ``narrowest`` is rounded to 0.01 m. The result agrees with exact
    geometry for a disc that is wider or narrower than a passage by more than 0.02 m.

    Parameters
    ----------
    space
        A plan, whose free space is measured, or a free space itself, metres.
    radii
        Radii of the robot, metres.

    Raises
    ------
    PlanError
        A radius is negative or not finite.
    """
    if odd := [radius for radius in radii if not 0 <= radius < math.inf]:
        raise PlanError(f"expected radii of 0 m or more, found {odd[0]!r}", "navigability")
    standing = _Pieces(straighten_walls(space.free_space if isinstance(space, PlanData) else space))
    said = cache(Navigability)  # most radii of a plan have the same figures
    found = {}
    for radius in radii:
        pieces = standing.at(radius)
        narrowest = standing.width(pieces[0], radius) if pieces else 0.0
        found[f"{radius:.2f}"] = said(len(pieces), _largest_share(pieces), round(narrowest, 2))
    return NavigabilityByRadius(found)


def disc_centre_areas(space: Polygon | MultiPolygon, radius_m: float) -> list[Polygon]:
    """Return the areas in which the centre of a disc can be, the largest first, without those under 0.1 m2.

    Walls are first straightened by at most 0.01 m.
    """
    return erode(straighten_walls(space), radius_m)


def straighten_walls(shape: Polygon | MultiPolygon) -> Polygon | MultiPolygon:
    """Return the shape with walls straightened by at most 0.01 m; it is valid and keeps all parts and holes."""
    quick = shape.simplify(STRAIGHTEN_AREA_M, preserve_topology=False)  # seven times faster, but may lose thin parts
    if shape.geom_type != "Polygon" or quick.geom_type != "Polygon" or quick.is_empty:
        return shape.simplify(STRAIGHTEN_AREA_M)
    lost = abs(shape.area - quick.area)
    alike = len(shape.interiors) == len(quick.interiors) and lost < STRAIGHTEN_AREA_M * shape.length
    return quick if alike else shape.simplify(STRAIGHTEN_AREA_M)


def erode(shape: Polygon | MultiPolygon, radius: float, least_m2: float = ROBOT_SPECK_M2) -> list[Polygon]:
    """Return the areas in which the centre of a disc can be, the largest first, without those under ``least_m2``."""
    import shapely

    found = shapely.buffer(shape, -radius, quad_segs=8)
    if found.geom_type == "Polygon":  # a fast path for the common case
        return [found] if found.area >= least_m2 else []
    parts = shapely.get_parts(found)
    areas = shapely.area(parts)
    return [parts[i] for i in np.argsort(-areas, kind="stable") if areas[i] >= least_m2]


class _Piece(NamedTuple):
    """A connected piece, already eroded by ``radius``, metres; 0.0 for a whole piece that needs no erosion."""

    polygon: Polygon
    radius: float


class _Pieces:
    """The pieces of a free space for any radius. Radii share results, since most have the same bottleneck.

    Erosions take most of the time. Between the widths of passages (``find_passages``) no piece splits, so that most
    erosions can be skipped.
    """

    def __init__(self, shape: Polygon | MultiPolygon) -> None:
        self._shape = shape
        self._passages, self._widest_m = find_passages(shape, COMMON_OPENING_M), COMMON_OPENING_M
        self._eroded: dict[float, list[Polygon]] = {}
        self._known: list[tuple[float, float, Polygon]] = []  # (from radius, split at radius, the piece at from)

    def at(self, radius: float) -> list[_Piece]:
        """Return the pieces at this radius (metres), the largest first."""
        if radius < self._radius_of_one_piece:
            return [_Piece(self._shape, 0.0)]
        return [_Piece(polygon, radius) for polygon in self._erode(radius)]

    def width(self, piece: _Piece, radius: float) -> float:
        """Return twice the radius at which the piece splits, or the diameter of the widest disc if it never does."""
        for start, split, whole in self._known:
            if start <= radius < split and (whole is piece.polygon or _contains_piece(whole, piece.polygon)):
                return 2.0 * split
        split = self._split(piece, radius)
        self._known.append((radius, split, piece.polygon))
        return 2.0 * split

    @cached_property
    def _radius_of_one_piece(self) -> float:
        """Return a radius, metres, up to which the space is certainly one piece that is large enough to count."""
        import shapely

        if self._shape.geom_type != "Polygon":
            return -1.0
        room = shapely.distance(self._shape.boundary, self._shape.representative_point())
        narrowest = min([self._widest_m / 2.0, *self._passages.radius[:1]])
        return float(min(room - _SPECK_RADIUS_M, narrowest * (1.0 - ROUND)))

    def _split(self, piece: _Piece, radius: float) -> float:
        import shapely

        passages, low = self._passage_radii(piece, radius), radius
        while True:
            high = low + SPLIT_STEP_M
            if high * (1.0 + ROUND) > self._widest_m / 2.0:
                self._passages, self._widest_m = find_passages(self._shape), np.inf
                passages = self._passage_radii(piece, radius)
            ahead = passages[passages > low * (1.0 - ROUND)]
            none = not ahead.size and np.isinf(self._widest_m)
            count = self._count(piece, high) if ahead.size and ahead[0] < high * (1.0 + ROUND) else 1
            if count > 1:
                return self._bisect(piece, ahead, low * (1.0 - ROUND), high * (1.0 + ROUND))
            if count == 0 or none:
                disc = shapely.maximum_inscribed_circle(piece.polygon, tolerance=SPLIT_M)
                return piece.radius + float(disc.length)
            low = high

    def _passage_radii(self, piece: _Piece, radius: float) -> Floats:
        """Return the radii of the passages of a piece, ascending; the piece may end at a passage of equal width."""
        import shapely

        middles = shapely.points(self._passages.middle)
        inside = shapely.dwithin(piece.polygon, middles, ROUND * radius)
        return np.asarray(self._passages.radius[inside])

    def _bisect(self, piece: _Piece, passages: Floats, low: float, high: float) -> float:
        """Return the radius, between two radii, at which the piece splits because one of its passages closes."""
        while high - low > SPLIT_M:
            between = passages[(passages > low) & (passages < high)]
            first, last = (between[0], between[-1]) if between.size else (low, high)
            middle = float(first + last) / 2.0
            if between.size and last - first < SPLIT_M:
                return middle
            low, high = (low, middle) if self._count(piece, middle) > 1 else (middle, high)
        return (low + high) / 2.0

    def _count(self, piece: _Piece, radius: float) -> int:
        return sum(_contains_piece(piece.polygon, part) for part in self._erode(radius))

    def _erode(self, radius: float) -> list[Polygon]:
        radius = round(radius, 6)
        if radius not in self._eroded:
            self._eroded[radius] = erode(self._shape, radius)
        return self._eroded[radius]


def _largest_share(pieces: Sequence[_Piece]) -> float:
    """Return the share of the largest piece, which comes first, in the area of all."""
    if len(pieces) <= 1:
        return float(len(pieces))
    return round(float(pieces[0].polygon.area / sum(piece.polygon.area for piece in pieces)), 4)


def _contains_piece(whole: Polygon, part: Polygon) -> bool:
    """Return whether a piece at a greater radius is part of ``whole``."""
    return bool(whole.covers(part.representative_point()))


Floats = npt.NDArray[np.float64]


class Passages(NamedTuple):
    """Passages, sorted: ``radius`` (k,) of the widest disc that fits through, and ``middle`` (k, 2), both in metres."""

    radius: Floats
    middle: Floats


class _Edges(NamedTuple):
    """Edges with the free space on their left: start (n, 2), length (n,), unit vector (n, 2), previous edge (n,)."""

    start: Floats
    length: Floats
    unit: Floats
    before: npt.NDArray[np.int64]


def find_passages(space: Polygon | MultiPolygon, widest_m: float = np.inf) -> Passages:
    """Find the passages of a valid shape (metres, no vertex repeated), up to a width.

    The area in which the centre of a growing disc can be splits only where two walls touch the disc on opposite sides.
    Each passage therefore

    P1  starts at a corner that projects into the space, in the sector between the perpendiculars to its two walls,
    P2  ends at another such corner, or at the foot of the perpendicular to a wall,
    P3  and is the diameter of a disc that no wall reaches into.

    The area need not split when a passage closes, since there may be another way around.
    """
    import shapely

    edges = _edges(space)
    start, unit = edges.start, edges.unit
    arriving = unit[edges.before]
    juts = arriving[:, 0] * unit[:, 1] < arriving[:, 1] * unit[:, 0]
    corner, leaving, back = start[juts], unit[juts], -arriving[juts]
    found = _to_corners(corner, leaving, back, widest_m), _to_walls(corner, leaving, back, edges, widest_m)
    radius, middle = (np.concatenate(both) for both in zip(*found, strict=True))
    open_ = shapely.distance(space.boundary, shapely.points(middle)) > radius - SAME_M  # P3
    radius, middle = radius[open_], middle[open_]
    order = np.argsort(radius, kind="stable")
    return Passages(radius[order], middle[order])


def _edges(space: Polygon | MultiPolygon) -> _Edges:
    import shapely

    rings = shapely.get_rings(shapely.get_parts(shapely.orient_polygons(space)))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    real = ring[1:] == ring[:-1]  # other pairs would lead from ring to ring
    along, start = (points[1:] - points[:-1])[real], points[:-1][real]
    last = np.cumsum(np.bincount(ring) - 1) - 1
    before = np.arange(-1, len(start) - 1)
    before[np.append(0, last + 1)[:-1]] = last
    length = np.hypot(along[:, 0], along[:, 1])
    return _Edges(start, length, along / length[:, None], before)


def _to_corners(corner: Floats, leaving: Floats, back: Floats, widest_m: float) -> tuple[Floats, Floats]:
    """Return radii and middles from corner to corner; ``leaving`` and ``back`` are the directions of its walls."""
    ahead = leaving @ corner.T < (_dot(leaving, corner) + SAME_M)[:, None]
    ahead &= back @ corner.T < (_dot(back, corner) + SAME_M)[:, None]
    one, other = np.nonzero(ahead & ahead.T)  # P1 at either end
    one, other = one[one < other], other[one < other]
    across = corner[other] - corner[one]
    width = np.hypot(across[:, 0], across[:, 1])
    near = width <= widest_m
    return width[near] / 2.0, (corner[one] + across / 2.0)[near]


def _to_walls(corner: Floats, leaving: Floats, back: Floats, edges: _Edges, widest_m: float) -> tuple[Floats, Floats]:
    """Return radii and middles of passages from a corner to the foot of a perpendicular."""
    start, length, unit, _ = edges
    left = np.stack([-unit[:, 1], unit[:, 0]])
    away = corner @ left - _dot(start, left.T)
    meets = (away > 0.0) & (away <= widest_m)
    meets &= (leaving @ left > -SAME_M) & (back @ left > -SAME_M)  # P1
    which, wall = np.nonzero(meets)
    along = _dot(corner[which] - start[wall], unit[wall])
    foot = (along > -SAME_M) & (along < length[wall] + SAME_M)  # P2
    which, wall = which[foot], wall[foot]
    radius = away[which, wall] / 2.0
    return radius, corner[which] - radius[:, None] * left.T[wall]


def _dot(one: Floats, other: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", one, other))
