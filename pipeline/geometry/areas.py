"""Overlay shapely areas without stray lines and points, find spaces that walls enclose, take outlines, triangulate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import manifold3d
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.tolerances import OVERLAY_GRID_M, SPECK_M2

# ---------------------------------------------------------------------------------------------------------------------
# Overlays of areas that give areas: the lines and points that a touching pair leaves behind are dropped.
# ---------------------------------------------------------------------------------------------------------------------

EMPTY = Polygon()
Shapes = npt.NDArray[np.object_]
_AREAS = (Polygon, MultiPolygon)
_MITRE, _ROUND = int(shapely.BufferJoinStyle.mitre), int(shapely.BufferCapStyle.round)  # shapely looks names up slowly


def polygons_of(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons of any geometry, largest first; lines and points are left out."""
    if isinstance(shape, Polygon):
        return [] if shape.is_empty else [shape]
    parts = shapely.get_parts(shape)
    if not isinstance(shape, MultiPolygon):
        parts = shapely.get_parts(parts)
        parts = parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON]
    parts = parts[~shapely.is_empty(parts)]
    if len(parts) > 1:
        below = -shapely.area(parts)
        order = np.argsort(below, kind="stable")
        if (np.diff(below[order]) == 0).any():  # equal ones by place
            order = np.lexsort((*shapely.bounds(parts).T[::-1], below))
        parts = parts[order]
    return list(parts)


def dot_product(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> Any:
    """Return the scalar products of plane vectors (..., 2) with (2,), or pairwise with (..., 2).

    ``@`` rounds as the processor's own linear algebra kernel does, so that plans would differ between machines.
    """
    return one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]


def drop_lines_and_points(shape: BaseGeometry) -> BaseGeometry:
    """Return only the areas of a geometry."""
    if isinstance(shape, _AREAS):
        return shape
    found = polygons_of(shape)
    return shapely.multipolygons(found) if found else EMPTY


def ignore_division_warnings() -> np.errstate:
    """Silence NumPy's warnings from GEOS, which divides by the length of edges, also where it is 0."""
    return np.errstate(divide="ignore", invalid="ignore")


def buffer_mitred(shape: Any, distance_m: float, limit: float = 2.0) -> Any:
    """Grow an area, or each of an array of areas, by metres, with square corners; a negative distance shrinks it."""
    with ignore_division_warnings():
        return shapely.buffer(shape, distance_m, cap_style=_ROUND, join_style=_MITRE, mitre_limit=limit)


def clip_to_box(shape: BaseGeometry, x1: float, y1: float, x2: float, y2: float) -> BaseGeometry:
    """Return the part of an area in a rectangle; lines may be left on its edge."""
    try:
        return shapely.clip_by_rect(shape, x1, y1, x2, y2)
    except shapely.errors.GEOSException:  # clip_by_rect is quick, but fails on rings that touch the edge in a point
        return intersect(shape, shapely.box(x1, y1, x2, y2))


def subtract(a: BaseGeometry, b: BaseGeometry) -> BaseGeometry:
    """Return the part of ``a`` outside ``b``."""
    return drop_lines_and_points(_robust(shapely.difference, a, b))


def intersect(a: BaseGeometry, b: BaseGeometry) -> BaseGeometry:
    """Return what ``a`` and ``b`` share."""
    if a is b:
        return drop_lines_and_points(a)
    return drop_lines_and_points(_robust(shapely.intersection, a, b))


def intersect_pairs(a: Shapes, b: Shapes) -> Shapes:
    """Return the intersection of each of ``a`` (n,) with its partner in ``b`` (n,), lines and points included."""
    return _overlay_pairs(shapely.intersection, a, b)


def shares_inside(shapes: Sequence[Polygon] | Shapes, area: BaseGeometry | None) -> npt.NDArray[np.float64]:
    """Return the share of each of the shapes (n,) that lies in an area; 0 if the area is None or empty."""
    if area is None or area.is_empty:
        return np.zeros(len(shapes))
    return np.asarray(areas_inside(shapes, area) / shapely.area(shapes))


def areas_inside(shapes: Sequence[Polygon] | Shapes, area: BaseGeometry) -> npt.NDArray[np.float64]:
    """Return how much of each of the shapes (n,) lies in an area, m2."""
    each, found = np.array(shapes, np.object_), np.zeros(len(shapes))
    (x1, y1, x2, y2), boxes = area.bounds if not area.is_empty else (1.0, 1.0, 0.0, 0.0), shapely.bounds(each)
    near = (boxes[:, 0] <= x2) & (boxes[:, 2] >= x1) & (boxes[:, 1] <= y2) & (boxes[:, 3] >= y1)
    found[near] = shapely.area(intersect_pairs(each[near], np.full(int(near.sum()), area, np.object_)))
    return found


def shares_of_places(places: Shapes, area: BaseGeometry) -> npt.NDArray[np.float64]:
    """Return the share of each place (n,) that lies in an area; quick where each place is small beside the area."""
    found = np.zeros(len(places))
    if area.is_empty or not len(places):
        return found
    shapely.prepare(area)
    found[shapely.covers(area, places)] = 1.0
    partly = shapely.intersects(area, places) & (found == 0.0) & (shapely.area(places) > 0.0)
    for k in np.flatnonzero(partly).tolist():
        found[k] = intersect(places[k], clip_to_box(area, *places[k].bounds)).area / places[k].area
    return found


@lru_cache(maxsize=1)  # names, grounds and confidences ask for the same rooms
def shared_areas(shapes: tuple[Polygon, ...], others: tuple[Polygon, ...]) -> npt.NDArray[np.float64]:
    """Return how much each of the shapes (n,) shares with each of the others (m,), (n, m) m2."""
    one, other = np.array(shapes, np.object_), np.array(others, np.object_)
    k, j = shapely.STRtree(other).query(one, predicate="intersects")
    found = np.zeros((len(one), len(other)))
    found[k, j] = shapely.area(one)[k]
    differ = one[k] != other[j]
    k, j = k[differ], j[differ]
    found[k, j] = shapely.area(intersect_pairs(one[k], other[j]))
    found.flags.writeable = False
    return found


def overlaps(shapes: tuple[Polygon, ...], others: tuple[Polygon, ...]) -> npt.NDArray[np.float64]:
    """Return the intersection over union of each of the shapes (n,) with each of the others (m,), (n, m)."""
    shared = shared_areas(shapes, others)
    return np.asarray(shared / (shapely.area(shapes)[:, None] + shapely.area(others) - shared))


def subtract_pairs(a: Shapes, b: Shapes) -> Shapes:
    """Return the part of each of ``a`` (n,) outside its partner in ``b`` (n,)."""
    return _overlay_pairs(shapely.difference, a, b)


def unite(shapes: Iterable[BaseGeometry]) -> BaseGeometry:
    """Return the union of the shapes."""
    return drop_lines_and_points(_robust(shapely.union_all, list(shapes)))


def _robust(operation: Callable[..., BaseGeometry], *shapes: Any) -> BaseGeometry:
    """Overlay exactly; if GEOS fails by rounding, overlay the mended shapes on a grid of ``OVERLAY_GRID_M``.

    A grid alone is not enough: buffers with square corners are sometimes invalid.
    """
    try:
        return operation(*shapes)
    except shapely.errors.GEOSException:
        return operation(*(_mend(shape) for shape in shapes), grid_size=OVERLAY_GRID_M)


def _overlay_pairs(operation: Callable[..., Any], a: Shapes, b: Shapes) -> Shapes:
    """Overlay all pairs at once; if GEOS fails on one, overlay each pair by itself with ``_robust``."""
    try:
        return np.asarray(operation(a, b))
    except shapely.errors.GEOSException:
        found = np.empty(len(a), np.object_)
        found[:] = [drop_lines_and_points(_robust(operation, one, other)) for one, other in zip(a, b, strict=True)]
        return found


def _mend(shape: Any) -> Any:
    """Return a shape, or each of a list of shapes, made valid and without the lines that this leaves."""
    if isinstance(shape, BaseGeometry):
        return drop_lines_and_points(shapely.make_valid(shape))
    return [_mend(each) for each in shape]


# ---------------------------------------------------------------------------------------------------------------------
# Bounded pieces of the free space between walls.
# ---------------------------------------------------------------------------------------------------------------------

OUTSIDE = -1
WALL = -2


def enclosed_pieces(walls: BaseGeometry) -> tuple[BaseGeometry, list[Polygon]]:
    """Return the walls, and every piece of free space that they close all round, largest first.

    Specks (cracks between pieces of one wall) count as wall, and are filled.
    """
    rooms, specks = _rooms_and_specks(walls)
    return (unite([walls, *specks]) if specks else walls), rooms


def enclosed_area(walls: BaseGeometry) -> float:
    """Square metres of free space that the walls close all round."""
    return float(sum(room.area for room in _rooms_and_specks(walls)[0]))


def _rooms_and_specks(walls: BaseGeometry) -> tuple[list[Polygon], list[Polygon]]:
    """Return the areas that walls close all round, largest first: the rooms, and the specks too small for a room."""
    parts = polygons_of(walls)
    holes = [hole for part in parts for hole in shapely.polygons(shapely.get_rings(part)[1:])]
    if not holes:
        return [], []
    free: list[Polygon] = []
    hole_of, part_in = shapely.STRtree(parts).query(holes, predicate="contains")
    for k, hole in enumerate(holes):
        standing = [Polygon(parts[i].exterior) for i in part_in[hole_of == k]]  # its own holes come by themselves
        free += polygons_of(subtract(hole, unite(standing))) if standing else [hole]
    free.sort(key=lambda p: (-p.area, p.bounds))
    rooms = [p for p in free if p.area > SPECK_M2]
    return rooms, free[len(rooms) :]


def fill_enclosed(walls: BaseGeometry) -> BaseGeometry:
    """Return the walls and the areas that they enclose, as one area."""
    return unite(Polygon(part.exterior) for part in polygons_of(walls))


def drop_thin_parts(shape: BaseGeometry, width_m: float) -> BaseGeometry:
    """Return the shape without what is thinner than ``width_m`` (morphological opening, square corners)."""
    eroded = buffer_mitred(shape, -width_m / 2)
    if eroded.is_empty:
        return eroded
    grown = buffer_mitred(eroded, width_m / 2 + 1e-6)
    return intersect(grown, shape)


def drop_thin_parts_of_each(shapes: Sequence[BaseGeometry], width_m: float) -> Shapes:
    """``drop_thin_parts`` for each of the shapes."""
    given = np.array(shapes, dtype=np.object_)
    return intersect_pairs(buffer_mitred(buffer_mitred(given, -width_m / 2), width_m / 2 + 1e-6), given)


def smooth_edges(shape: BaseGeometry, width_m: float) -> BaseGeometry:
    """Return an area closed over gaps narrower than ``width_m``, and then without what is thinner than that.

    Corners are kept square. Clipper, which Manifold holds, takes a tenth of the time of GEOS, and rounds to 1e-8 m.
    """
    rings = shapely.get_rings(shapely.orient_polygons(np.array(polygons_of(shape), np.object_)))
    whole = manifold3d.CrossSection([shapely.get_coordinates(ring)[:-1] for ring in rings])
    reach, mitred = width_m / 2, manifold3d.JoinType.Miter
    closed = whole.offset(reach, mitred).offset(-reach, mitred)
    opened = closed.offset(-reach, mitred).offset(reach + 1e-6, mitred) ^ closed
    if opened.is_empty():
        return EMPTY
    found: list[Polygon] = []
    for part in opened.decompose():
        parts = [shapely.linearrings(ring) for ring in part.to_polygons()]
        (outer,) = (ring for ring in parts if ring.is_ccw)
        piece = Polygon(outer, [ring for ring in parts if not ring.is_ccw])
        found += [piece] if piece.is_valid else polygons_of(_mend(piece))
    return shapely.multipolygons(found)


def are_too_narrow(shapes: Sequence[Polygon] | Shapes, width_m: float) -> npt.NDArray[np.bool_]:
    """Return for each of the shapes whether it is narrower than ``width_m`` everywhere (its opening is empty)."""
    return np.asarray(shapely.is_empty(buffer_mitred(np.array(shapes, dtype=np.object_), -width_m / 2)), np.bool_)


def locate_points(points: npt.NDArray[np.float64], rooms: list[Polygon], walls: BaseGeometry) -> npt.NDArray[np.int64]:
    """For each point (n, 2): the index of the room that holds it, WALL, or OUTSIDE."""
    found = np.full(len(points), OUTSIDE, np.int64)
    if not len(points):
        return found
    geometry = shapely.points(points)
    shapely.prepare(walls)
    found[shapely.intersects(walls, geometry)] = WALL
    if rooms:
        which, room = shapely.STRtree(rooms).query(geometry, predicate="intersects").astype(np.int64)
        found[which[::-1]] = room[::-1]
    return found


# ---------------------------------------------------------------------------------------------------------------------
# The rings of areas with the corners that they have, and no others.
# ---------------------------------------------------------------------------------------------------------------------

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class OutlineCorners:
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

    def only(self, kept: npt.NDArray[np.bool_]) -> OutlineCorners:
        """Return the same rings with these of the corners (n,)."""
        return OutlineCorners(self.points[kept], self.ring[kept], self.area[kept])


def trace_outlines(areas: Sequence[Polygon], detail_m: float) -> OutlineCorners:
    """Return the rings of some areas, without details smaller than ``detail_m``.

    Simplifying (Douglas-Peucker) keeps the point farthest from the line between two others. On an edge parallel to that
    line, this may be a point in the middle of the edge; such points are dropped here.
    """
    shapes = shapely.orient_polygons(shapely.simplify(np.array(areas, dtype=np.object_), detail_m))
    rings, of_area = shapely.get_rings(shapes, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    closed = OutlineCorners(points, ring, of_area[ring])
    return _corners(closed.only(np.diff(ring, append=-1) == 0), detail_m)


def _corners(found: OutlineCorners, detail_m: float) -> OutlineCorners:
    """Drop points on the line between their neighbours; of two such points in a row, drop only the first."""
    before = found.points[found.before]
    along, to = found.points[found.after] - before, found.points - before
    length = np.hypot(*along.T)
    off = np.abs(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]) / np.where(length > 0, length, 1.0)
    between = (to * along).sum(axis=1) / np.where(length > 0, length, 1.0) ** 2
    straight = (off < detail_m) & (between > 0) & (between < 1)
    kept = ~straight | straight[found.before]
    too_few = np.bincount(found.ring, kept) < 3
    return found.only(kept | too_few[found.ring])


# ---------------------------------------------------------------------------------------------------------------------
# Triangles of a polygon, without new corners.
# ---------------------------------------------------------------------------------------------------------------------


def triangulate(polygon: shapely.Polygon) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Return a polygon's corners (n, 2), ring by ring, the outer one counterclockwise, and its triangles (m, 3).

    GEOS makes the better triangles, but fails on some valid polygons, such as one with a hole that touches the outer
    ring in a corner. Manifold triangulates these.
    """
    outline = shapely.orient_polygons(polygon)
    rings = [shapely.get_coordinates(ring)[:-1] for ring in (outline.exterior, *outline.interiors)]
    corners = np.concatenate(rings)
    try:
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(outline))
    except shapely.GEOSException:
        return corners, np.asarray(manifold3d.triangulate(rings), np.int64)
    number = {point: k for k, point in enumerate(map(tuple, corners.tolist()))}
    used = shapely.get_coordinates(shapely.orient_polygons(triangles)).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    return corners, np.array([number[point] for point in map(tuple, used.tolist())], np.int64).reshape(-1, 3)


# Cut lines where they meet, on a grid, and tell whether lines are edges of the faces that they bound.


def node_on_grid(lines: Shapes, grid_m: float) -> Shapes:
    """Return lines cut where they meet, with all ends on a grid of ``grid_m`` metres, as ``shapely.union_all`` does.

    GEOS takes seven times as long with a grid as without, and most walls meet only in their corners. So the ends are
    rounded to the grid first, and the grid is left out if lines then cut each other only on it, with no end beside
    another line. The results are the same but for the sign of 0.
    """
    ends = shapely.get_coordinates(lines)
    if len(ends) == 2 * len(lines):
        pieces = shapely.get_parts(
            shapely.union_all(shapely.linestrings(round_to_grid(ends, grid_m).reshape(-1, 2, 2)))
        )
        found = shapely.get_coordinates(pieces)
        whole = len(found) == 2 * len(pieces) and np.array_equal(round_to_grid(found, grid_m), found)
        if whole and _meet_at_ends(found.reshape(-1, 2, 2), grid_m):
            return np.asarray(pieces)
    pieces = shapely.get_parts(shapely.union_all(lines, grid_size=grid_m))
    return np.asarray(pieces[shapely.get_type_id(pieces) == shapely.GeometryType.LINESTRING])


def round_to_grid(points: Floats, grid_m: float) -> Floats:
    """Round as GEOS does, but for the sign of 0: points (..., 2) on a grid of ``grid_m`` metres."""
    per_m = 1 / grid_m
    return np.asarray(np.floor(points * per_m + 0.5) / per_m)


def _meet_at_ends(lines: Floats, grid_m: float) -> bool:
    """Return whether no end of any of the lines (n, 2, 2) lies on another line, or within ``grid_m`` beside it."""
    points = np.unique(_as_numbers(lines)).view(np.float64).reshape(-1, 2)
    low, high = lines.min(axis=1) - grid_m, lines.max(axis=1) + grid_m
    line, point = shapely.STRtree(shapely.points(points)).query(shapely.box(*low.T, *high.T))
    along, to = lines[line, 1] - lines[line, 0], points[point] - lines[line, 0]
    aside = np.abs(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0])
    return bool((aside < grid_m * np.hypot(*along.T)).sum() == 2 * len(lines))


def are_edges_of(faces: Shapes, lines: Shapes) -> bool:
    """Return whether each of some lines, which have two ends and cut the plane, is an edge of one of the faces."""
    corners, ring = shapely.get_coordinates(shapely.get_rings(faces), return_index=True)
    ends = shapely.get_coordinates(lines)
    if len(ends) != 2 * len(lines):
        return False
    place = np.unique(np.concatenate([_as_numbers(corners), _as_numbers(ends)]), return_inverse=True)[1]
    goes_on = np.flatnonzero(ring[1:] == ring[:-1])
    edges = _edge_numbers(place[goes_on], place[goes_on + 1], len(place))
    drawn = place[len(corners) :]
    return bool(np.isin(_edge_numbers(drawn[::2], drawn[1::2], len(place)), edges).all())


def _as_numbers(points: Floats) -> npt.NDArray[np.complex128]:
    """Return points (..., 2) as complex numbers, which sort much faster than rows."""
    return np.ascontiguousarray(points).view(np.complex128).reshape(-1)


def _edge_numbers(start: Indices, end: Indices, count: int) -> Indices:
    """Return a number for each edge between two of ``count`` points, the same for both directions of the edge."""
    return np.asarray(np.minimum(start, end) * count + np.maximum(start, end), np.int64)
