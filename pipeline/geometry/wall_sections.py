"""Compute wall areas (polygons) from horizontal sections of a mesh, and find what ends below the walls beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate, pairwise

import manifold3d
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    EMPTY,
    Shapes,
    are_edges_of,
    are_too_narrow,
    buffer_mitred,
    clip_to_box,
    drop_lines_and_points,
    drop_thin_parts,
    enclosed_pieces,
    intersect,
    node_on_grid,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.mesh_slicing import MeshSlicer, SectionSegments, winding_number
from pipeline.geometry.meshes import Mesh, box_around_polygon, cells_along
from pipeline.geometry.prisms import Prisms
from pipeline.tolerances import (
    BESIDE_M,
    CM_M,
    CRACK_M,
    FOOT_M,
    HALF_CM_M,
    LARGELY,
    LOOKS,
    MM_M,
    MOST,
    NEARLY_ALL,
    PATCH_M2,
    POINT_M,
    SLIVER_M,
    SOME,
    SPECK_M2,
    THIN_WALL_M,
    WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# From the raw segments of a section to the area of its walls: solids and sheets in one file.
#
# The segments of a plane are noded together and cut it into faces. Whether a face is wall is decided face by face,
# never component by component: walls may fall into hundreds of open shells (Sweet Home), and one file may hold solid
# walls and sheets. Rules for a face:
#
# R1  A thin face is wall: no disc of ``solid_m`` across fits into it. A thin face that is open space is closed all
#     round at this height, so nobody gets into it either.
# R2  A thick face is solid if it lies in a closed body: the section's segments wind around it, and a top and a bottom
#     lie over and under it (a room of sheets that look outwards has neither). Only its thick part is massive (a
#     chimney, a slab); the thin rest of the body is wall, since walls and chimney may be one body. If most of its edge
#     lies along other bodies inside it, the face is a room: a closed cladding stands around the walls of the house.
# R3  An edge between two faces that are not wall is a sheet, and gets the thickness ``sheet_m``, with flat ends. A slit
#     between two sheets is not a face.
# R4  A solid wall thinner than ``sheet_m`` gets that thickness too: on the 1 cm grid of a plan it would vanish.
# R5  The segments of a mesh of many small faces (a scan) are simplified first: a corner every few centimetres would
#     split every lintel into strips too short for doors.
# R6  A body that fills most of the plan above the doors, but not at breast height, is not massive. It is a box of
#     rooms, drawn as sheets that look outwards, with doors and windows cut out. Then nothing in the storey is massive.
# ---------------------------------------------------------------------------------------------------------------------

_OFF_GRID = 0.137
"""Cells of the grid begin here, so that no edge of a cell lies on a round number, where models have their vertices."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WallSection:
    """What stands at one height: ``walls`` (R1, R3) and, apart from them, massive ``solids`` (R2), such as slabs.

    ``closets`` are the parts of ``walls`` known to be space, which walls close all round above the heads of doors.
    """

    walls: BaseGeometry
    solids: BaseGeometry
    closets: BaseGeometry = EMPTY


def section_from_segments(
    cut: SectionSegments, *, sheet_m: float, solid_m: float, sheets: bool = True, winding: bool = True
) -> WallSection:
    """Walls and solids of a plane's segments.

    Without ``sheets`` only closed bodies count: near the floor, a lone edge is the rim of a slab. Without ``winding``,
    the directions of faces are not used, and nothing is massive.
    """
    cells = [cells_along(cut.ends[:, :, axis].ravel(), POINT_M, -_OFF_GRID) for axis in (0, 1)]
    snapped = np.asarray((np.stack(cells, axis=-1) + 0.5 - _OFF_GRID) * POINT_M, np.float64).reshape(-1, 2, 2)
    real = np.any(snapped[:, 0] != snapped[:, 1], axis=1)
    snapped, body = snapped[real], cut.body[real]
    if not len(snapped):
        return WallSection(EMPTY, EMPTY)
    if _is_dense(snapped):
        lines = _lines_of(snapped)
        return _arrange(replace(cut, ends=snapped, body=body), lines, sheet_m, solid_m, sheets=sheets, winding=winding)
    rings, rest = chain_closed_rings(snapped, body, POINT_M, solid_m / 2)
    if rings is None:
        lines = shapely.linestrings(snapped)
        return _arrange(replace(cut, ends=snapped, body=body), lines, sheet_m, solid_m, sheets=sheets, winding=winding)
    strips = shapely.orient_polygons(_strips(rings.polygons(rings.thickness < NEARLY_ALL * sheet_m), sheet_m))
    thin = unite_rings(rings.rings + [shapely.get_coordinates(s)[:-1] for s in strips], CRACK_M)
    if not rest.any():
        return WallSection(thin, EMPTY)
    loose = replace(cut, ends=snapped[rest], body=body[rest])
    lines = shapely.linestrings(snapped[rest])
    others = _arrange(loose, lines, sheet_m, solid_m, sheets=sheets, winding=winding)
    hollow = _hollow_parts(others.solids, thin)
    if hollow.is_empty:
        return WallSection(close_cracks(unite([thin, others.walls])), others.solids, others.closets)
    massive, lining = _split_solids(subtract(others.solids, hollow), solid_m)
    return WallSection(close_cracks(unite([thin, others.walls, lining])), massive, others.closets)


def section_from_bodies(bodies: Shapes, *, sheet_m: float, solid_m: float) -> WallSection:
    """Return the walls and solids of upright bodies, given as plan polygons (n,) (R1, R2, R4)."""
    filled, spaces = enclosed_pieces(unite(_not_too_slim(bodies, sheet_m)))
    walls = np.array(polygons_of(filled), dtype=np.object_)
    if not len(walls):
        return WallSection(EMPTY, EMPTY)
    narrow = [space for space, is_narrow in zip(spaces, are_too_narrow(spaces, solid_m), strict=True) if is_narrow]
    thin = are_too_narrow(walls, solid_m)
    if thin.all() and not narrow:
        return WallSection(close_cracks(filled), EMPTY)
    solids = unite(walls[~thin])
    massive, rest = _split_solids(solids, solid_m)
    standing = close_cracks(unite([*walls[thin], *narrow, rest]))
    closets = [space for space, is_slim in zip(narrow, are_too_narrow(narrow, WALL_M), strict=True) if not is_slim]
    return WallSection(standing, massive, unite(closets))


def _is_dense(segments: Floats) -> bool:
    """Return whether the section follows a mesh of small faces: half of all its length lies in short segments."""
    length = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
    return bool(length[length < THIN_WALL_M].sum() > length.sum() / 2)


def _lines_of(segments: Floats) -> npt.NDArray[np.object_]:
    """Return the segments as lines with as few corners as ``CM_M`` allows."""
    order = np.lexsort((segments[:, :, 1], segments[:, :, 0]), axis=1)
    once = np.unique(np.take_along_axis(segments, order[:, :, None], axis=1), axis=0)  # two sheets may coincide
    merged = shapely.line_merge(shapely.multilinestrings(shapely.linestrings(once)))
    return np.asarray(shapely.simplify(shapely.get_parts(merged), CM_M))


def _not_too_slim(faces: npt.NDArray[np.object_], sheet_m: float) -> npt.NDArray[np.object_]:
    """Return the faces, and for each that is thinner than ``sheet_m`` a strip of that width along it."""
    slim = 2 * shapely.area(faces) / shapely.length(faces) < NEARLY_ALL * sheet_m  # thickness of a long strip
    return np.concatenate([faces, _strips(faces[slim], sheet_m)]) if slim.any() else faces


def _strips(slim: npt.NDArray[np.object_], sheet_m: float) -> npt.NDArray[np.object_]:
    """Return strips, ``sheet_m`` wide, along the straight ones of the faces."""
    if not len(slim):
        return slim
    boxes = shapely.minimum_rotated_rectangle(slim)
    is_box = shapely.get_type_id(boxes) == shapely.GeometryType.POLYGON
    straight = np.asarray(boxes[is_box & (shapely.area(slim) > 0.9 * shapely.area(boxes))], np.object_)
    if not len(straight):
        return straight
    strips = np.atleast_1d(shapely.buffer(_spines(straight), sheet_m / 2, cap_style="flat"))
    return np.asarray(strips[~shapely.is_empty(strips)])


def _spines(boxes: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
    """Return the long middle lines of rectangles."""
    corners = shapely.get_coordinates(boxes).reshape(len(boxes), -1, 2)
    middles = (corners[:, :-1] + corners[:, 1:]) / 2
    length = np.hypot(*np.moveaxis(np.diff(corners[:, :3], axis=1), 2, 0))
    first = (length[:, 0] > length[:, 1]).astype(np.int64)
    rows = np.arange(len(boxes))
    return np.atleast_1d(shapely.linestrings(np.stack([middles[rows, first], middles[rows, first + 2]], axis=1)))


def _arrange(
    cut: SectionSegments,
    drawn: npt.NDArray[np.object_],
    sheet_m: float,
    solid_m: float,
    *,
    sheets: bool,
    winding: bool,
) -> WallSection:
    lines = node_on_grid(drawn, POINT_M)
    faces = shapely.get_parts(shapely.polygonize(lines))
    thick = ~shapely.is_empty(buffer_mitred(faces, -solid_m / 2))
    solid = thick.copy()
    solid[thick] = winding and _inside(shapely.point_on_surface(faces[thick]), cut)
    if solid.any():
        winds = winding_number(shapely.point_on_surface(faces), cut.ends)
        for times in np.unique(winds[solid & (winds < winds.max())]):
            which = np.flatnonzero(solid & (winds == times))
            solid[which] = ~_are_hollow(faces[which], unite(faces[winds > times]))
    solids = unite(faces[solid])
    massive, rest = _split_solids(solids, solid_m)
    thin = ~thick & (2 * shapely.area(faces) / shapely.length(faces) > CM_M)
    body = unite([*_not_too_slim(faces[thin], sheet_m), rest])
    if not sheets:
        return WallSection(close_cracks(body), massive)
    if are_edges_of(faces[thin | solid], lines):
        walls = close_cracks(unite([body, EMPTY]))
    else:
        closed = unite([*faces[thin], solids])
        loose = shapely.difference(shapely.multilinestrings(lines), shapely.buffer(closed, 2 * POINT_M))
        walls = close_cracks(unite([body, thicken_lines(loose, sheet_m)]))
    closets = find_closets(faces[thin], solids, cut.ends) if winding else EMPTY
    return WallSection(walls, massive, closets)


def _is_filled(found: WallSection, walls: BaseGeometry) -> bool:
    """Return whether most of what walls and massive bodies enclose is massive."""
    if found.solids.is_empty:
        return False
    enclosed = unite(Polygon(part.exterior) for part in polygons_of(unite([found.solids, walls])))
    return bool(found.solids.area > MOST * enclosed.area)


def _split_solids(solids: BaseGeometry, solid_m: float) -> tuple[BaseGeometry, BaseGeometry]:
    """Return the massive part of solid bodies, and their thin rest, which is wall."""
    if solids.is_empty:
        return EMPTY, EMPTY
    massive = drop_thin_parts(solids, solid_m)
    return massive, drop_thin_parts(subtract(solids, massive), CRACK_M)


def _hollow_parts(solids: BaseGeometry, bodies: BaseGeometry) -> BaseGeometry:
    """Return the parts of the solids that lie among bodies within them (rooms in a cladding)."""
    within = intersect(bodies, solids)
    if within.is_empty:
        return EMPTY
    parts = np.array(polygons_of(subtract(solids, within)), np.object_)
    return unite(parts[_are_hollow(parts, within)])


def _are_hollow(faces: Shapes, within: BaseGeometry) -> npt.NDArray[np.bool_]:
    """Return which solid faces lie among bodies that stand ``within`` the solid, along most of their edges."""
    edges = shapely.boundary(faces)
    beside = shapely.intersection(edges, buffer_mitred(within, POINT_M))
    return np.asarray(shapely.length(beside) > LARGELY * shapely.length(edges), np.bool_)


def thicken_lines(lines: BaseGeometry, thickness_m: float) -> BaseGeometry:
    """Half the thickness on each side of every line, corners mitred, ends flat (round ones would narrow doors)."""
    if lines.is_empty:
        return EMPTY
    merged = shapely.line_merge(shapely.multilinestrings(shapely.get_parts(lines)))
    tips = _turning_points(merged)
    if len(tips):
        apart = shapely.difference(merged, shapely.union_all(shapely.buffer(tips, MM_M)))
        merged = shapely.line_merge(shapely.multilinestrings(shapely.get_parts(apart)))
    return shapely.buffer(merged, thickness_m / 2, cap_style="flat", join_style="mitre", mitre_limit=2.0)


def _turning_points(lines: BaseGeometry) -> npt.NDArray[np.object_]:
    """Return the points at which a line turns back on itself, as at the end of two sheets with a slit between them."""
    found: list[Floats] = []
    for line in shapely.get_parts(lines):
        points = shapely.get_coordinates(line)
        if line.is_ring:
            points = np.concatenate([points, points[1:2]])
        along = np.diff(points, axis=0)
        length = np.hypot(*along.T)
        back = (along[:-1] * along[1:]).sum(axis=1) < -0.9 * length[:-1] * length[1:]
        found.append(points[1:-1][back])
    return np.atleast_1d(shapely.points(np.concatenate(found))) if found else np.zeros(0, np.object_)


def close_cracks(walls: BaseGeometry, width_m: float = CRACK_M) -> BaseGeometry:
    """Join walls that nearly touch; corners stay as they are."""
    grown = buffer_mitred(walls, width_m / 2, limit=3.0)
    return drop_lines_and_points(buffer_mitred(grown, -width_m / 2, limit=3.0))


def _inside(points: npt.NDArray[np.object_], cut: SectionSegments) -> npt.NDArray[np.bool_]:
    """Return which points lie in a closed body: all round, above and below."""
    around = winding_number(points, cut.ends) > 0
    around[around] = cut.caps.close(shapely.get_coordinates(points[around]), cut.height)
    return around


# ---------------------------------------------------------------------------------------------------------------------
# Bodies that are each cut in simple closed rings: SUNCG's case, every slab a box of its own.
#
# Tracing their rings and uniting these with Clipper (manifold3d) costs a tenth of noding all segments of the plane.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class MeasuredRings:
    """Rings (n, 2), unclosed; for each its signed area (m2, counter-clockwise positive) and its thickness (m).

    The thickness is exact for a long strip; for any convex ring it is at least the radius of the largest disc in it.
    """

    rings: list[Floats]
    area: Floats
    thickness: Floats

    @classmethod
    def of(cls, rings: list[Floats]) -> MeasuredRings:
        """Measure them all at once."""
        length = np.array([len(ring) for ring in rings])
        start = np.cumsum(length) - length
        points = np.concatenate(rings)
        after = np.arange(1, len(points) + 1)
        after[start + length - 1] = start
        (x, y), (x2, y2) = points.T, points[after].T
        area = np.add.reduceat(x * y2 - x2 * y, start) / 2
        around = np.add.reduceat(np.hypot(x2 - x, y2 - y), start)
        return cls(rings, area, 2 * np.abs(area) / around)

    def polygons(self, which: npt.NDArray[np.bool_]) -> Shapes:
        """Return the areas in these of the rings."""
        chosen = [self.rings[k] for k in np.flatnonzero(which)]
        if not chosen:
            return np.zeros(0, np.object_)
        of_ring = np.repeat(np.arange(len(chosen)), [len(ring) for ring in chosen])
        return np.asarray(shapely.polygons(shapely.linearrings(np.concatenate(chosen), indices=of_ring)))


def chain_closed_rings(
    ends: Floats, body: npt.NDArray[np.int64], grid_m: float, thickest_m: float = np.inf
) -> tuple[MeasuredRings | None, npt.NDArray[np.bool_]]:
    """Return the counter-clockwise rings of oriented segments (n, 2, 2), and which segments (n,) are in no ring.

    Rings are built body by body. Ends that round to the same place of the grid are the same. A body is left out as a
    whole if a segment of it does not continue in exactly one other, or if a ring of it runs clockwise (a hole, a body
    turned inside out) or is thicker than ``thickest_m``.
    """
    places = np.round(ends / grid_m).astype(np.int64)
    places -= places.min(axis=(0, 1))
    if places.max() >= 1 << 24 or body.max() >= 1 << 14:
        return None, np.ones(len(ends), np.bool_)  # too large for the integer keys: 1.6 km, 16,384 bodies
    keys = (body[:, None] << 48) + (places[:, :, 0] << 24) + places[:, :, 1]
    good = np.ones(int(body.max()) + 1, np.bool_)
    order = np.argsort(keys[:, 0], kind="stable")
    starts = keys[order, 0]
    good[body[order[1:][starts[1:] == starts[:-1]]]] = False
    good[body[~_are_in_sorted(keys[:, 1], starts) | ~_are_in_sorted(keys[:, 0], np.sort(keys[:, 1]))]] = False
    order = order[good[body[order]]]
    if not len(order):
        return None, np.ones(len(ends), np.bool_)
    after = np.zeros(len(ends), np.int64)
    after[order] = order[np.searchsorted(keys[order, 0], keys[order, 1])]
    cycles = [cycle for cycle in _cycles(np.sort(order).tolist(), after.tolist()) if len(cycle) > 2]
    if not cycles:
        return None, ~good[body]
    rings = MeasuredRings.of(_parts(ends[np.concatenate(cycles), 0], [len(cycle) for cycle in cycles]))
    of_ring = body[[cycle[0] for cycle in cycles]]
    good[of_ring[(rings.area <= 0) | (rings.thickness >= thickest_m)]] = False
    kept = np.flatnonzero(good[of_ring])
    rest = ~good[body]
    if not len(kept):
        return None, rest
    return MeasuredRings([rings.rings[k] for k in kept], rings.area[kept], rings.thickness[kept]), rest


def _are_in_sorted(keys: npt.NDArray[np.int64], ordered: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Return which of the keys stand in a sorted array."""
    return np.asarray(ordered[np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)] == keys)


def _parts(points: Floats, lengths: list[int]) -> list[Floats]:
    """Rows of an array in parts of such lengths."""
    stops = list(accumulate(lengths))
    return [points[stop - length : stop] for stop, length in zip(stops, lengths, strict=True)]


def _cycles(segments: list[int], after: list[int]) -> list[list[int]]:
    """Rings of segments, each followed by the one that ``after`` says."""
    done = bytearray(len(after))
    found = []
    for first in segments:
        cycle, at = [], first
        while not done[at]:
            done[at] = 1
            cycle.append(at)
            at = after[at]
        if cycle:
            found.append(cycle)
    return found


def unite_rings(rings: list[Floats], crack_m: float) -> BaseGeometry:
    """Return the area of all rings together, with cracks up to ``crack_m`` wide closed and corners kept."""
    section = manifold3d.CrossSection(rings, manifold3d.FillRule.Positive)
    mitre = manifold3d.JoinType.Miter
    closed = section.offset(crack_m / 2, mitre, 3.0).offset(-crack_m / 2, mitre, 3.0)
    if closed.is_empty():
        return EMPTY
    found = MeasuredRings.of(closed.to_polygons())
    shells = [ring for ring, area in zip(found.rings, found.area, strict=True) if area > 0]
    holes = [ring for ring, area in zip(found.rings, found.area, strict=True) if area <= 0]
    return unite(_with_holes(shells, holes))


def _with_holes(shells: list[Floats], holes: list[Floats]) -> list[Polygon]:
    """Return the shells, each with its holes: a hole belongs to the smallest shell around it."""
    outlines = [Polygon(shell) for shell in shells]
    inside: list[list[Floats]] = [[] for _ in shells]
    for hole in holes:
        point = shapely.points(hole[0])
        around = [k for k, outline in enumerate(outlines) if len(outlines) == 1 or outline.intersects(point)]
        inside[min(around, key=lambda k: outlines[k].area)].append(hole)
    return [Polygon(shell, own) for shell, own in zip(shells, inside, strict=True)]


# ---------------------------------------------------------------------------------------------------------------------
# Closets and shafts: narrow spaces in a closed body, as wide as the walls of other houses are thick.
#
# A section over the heads of the doors cuts no opening to such a space, and its width is that of a thick wall. If the
# body is closed and wound consistently, winding tells them apart: the section winds around the wall on every side, but
# not around the space. Sheets around a room do not give this pattern, whichever way they look.
# ---------------------------------------------------------------------------------------------------------------------


def find_closets(
    faces: npt.NDArray[np.object_], solids: BaseGeometry, segments: npt.NDArray[np.float64]
) -> BaseGeometry:
    """Return the closets among the narrow ``faces`` of a section.

    ``solids`` are its massive bodies, ``segments`` (n, 2, 2) are oriented.
    """
    wide = ~shapely.is_empty(buffer_mitred(faces, -WALL_M / 2))
    if not wide.any():
        return EMPTY
    winds = winding_number(shapely.point_on_surface(faces), segments)
    spaces = faces[wide & (winds == 0)]
    if not len(spaces):
        return EMPTY
    walls = unite([*faces[winds > 0], solids])
    around = shapely.difference(buffer_mitred(spaces, CRACK_M), spaces)
    closed = np.array([intersect(band, walls).area > NEARLY_ALL * band.area for band in around], np.bool_)
    return unite(spaces[closed])


# ---------------------------------------------------------------------------------------------------------------------
# Walls made of two sheets, one on each face: the slit between them is wall, and their faces are the wall's faces.
#
# R1  A slit narrower than any door is the inside of a wall if two sheets stand along much of its edge. No wall needs to
#     lie over it: beside an opening up to the ceiling, the slit is open at all heights.
# R2  A sheet of such a wall needs no thickness of its own: its outer half is removed, except where more wall stands
#     against it.
# ---------------------------------------------------------------------------------------------------------------------


def fill_slits_between_sheets(walls: BaseGeometry, sheet_m: float) -> BaseGeometry:
    """Return walls with the slits between their sheets filled; ``sheet_m`` is the thickness given to a sheet."""
    thick = drop_thin_parts(walls, LIKE_A_SHEET * sheet_m)
    if walls.area - thick.area < SPECK_M2 / 2:
        return walls
    sheets = drop_thin_parts(subtract(walls, thick), SLIVER_M)  # without the crumbs of corners
    if sheets.area < SPECK_M2:
        return walls
    slits = unite(p for p in _gaps_between_sheets(sheets, walls) if _walled_share(p, walls) > SOME)  # R1
    if slits.is_empty:
        return walls
    around = buffer_mitred(slits, sheet_m + POINT_M)
    outer = intersect(walls, subtract(around, buffer_mitred(slits, sheet_m / 2)))
    more = drop_thin_parts(subtract(walls, buffer_mitred(slits, sheet_m + 2 * POINT_M)), SLIVER_M)
    left = subtract(unite([walls, slits]), subtract(outer, buffer_mitred(more, 2 * sheet_m)))  # R2
    return close_cracks(left, sheet_m / 2 + HALF_CM_M)


def long_slits_between_sheets(walls: BaseGeometry) -> BaseGeometry:
    """Return the slits between walls that are longer than any is wide."""
    return unite(p for p in _gaps_between_sheets(walls, walls) if box_around_polygon(p).width > WALL_M)


def _gaps_between_sheets(faces: BaseGeometry, walls: BaseGeometry) -> list[Polygon]:
    closed = buffer_mitred(buffer_mitred(faces, WALL_M / 2), -WALL_M / 2)
    if faces is walls and closed.area - walls.area < CM_M * CM_M:
        return []
    return polygons_of(drop_thin_parts(subtract(closed, walls), CM_M))


def _walled_share(slit: Polygon, walls: BaseGeometry) -> float:
    """Return the share of a slit's edge that lies along walls."""
    x1, y1, x2, y2 = slit.bounds
    near = clip_to_box(walls, x1 - SLIVER_M, y1 - SLIVER_M, x2 + SLIVER_M, y2 + SLIVER_M)
    return float(shapely.intersection(slit.exterior, shapely.buffer(near, POINT_M)).length / slit.exterior.length)


# ---------------------------------------------------------------------------------------------------------------------
# The sections of one storey, each made once: what stands at a height, floors and slabs left out.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class WallSections:
    """Sections of a mesh, or of upright bodies, at heights in metres above the level's floor.

    ``sheet_m`` is the thickness given to a single sheet, ``solid_m`` the greatest thickness of a hollow wall.
    ``foot_m`` is a height near the floor: a massive body that does not stand there is a slab. For upright bodies,
    heights between which no body begins or ends share one section. For a mesh, each height has its own section:
    rounding differs where the triangles of a wall meet.
    """

    cutter: MeshSlicer | Prisms
    sheet_m: float
    solid_m: float
    foot_m: float
    winding: bool = True
    _made: dict[float, BaseGeometry] = field(default_factory=dict)
    _closets: dict[float, BaseGeometry] = field(default_factory=dict)
    _layers: dict[int | tuple[float, bool], tuple[WallSection, BaseGeometry]] = field(default_factory=dict)
    _of_layers: dict[int, BaseGeometry] = field(default_factory=dict)

    @cached_property
    def foot(self) -> BaseGeometry:
        """All that stands near the floor, massive bodies included."""
        found, walls = self._section(self.foot_m, self._layer(self.foot_m), upright_only=False)
        return unite([walls, found.solids])

    def _section(self, height: float, layer: int | None, *, upright_only: bool) -> tuple[WallSection, BaseGeometry]:
        """Return a section, and its walls without the slits between their sheets."""
        key = (height, upright_only) if layer is None else layer
        if key in self._layers:
            return self._layers[key]
        if isinstance(self.cutter, Prisms):
            bodies = self.cutter.bodies_at(height)
            found = section_from_bodies(bodies, sheet_m=self.sheet_m, solid_m=self.solid_m)
        else:
            cut = self.cutter.cut(height, upright_only=upright_only)
            found = section_from_segments(cut, sheet_m=self.sheet_m, solid_m=self.solid_m, winding=self.winding)
        made = found, fill_slits_between_sheets(found.walls, self.sheet_m)
        self._layers[key] = made
        return made

    def _layer(self, height: float) -> int | None:
        """Return the number of the layer between two ends of bodies, or None if each height has its own section."""
        return int((self.cutter.heights < height).sum()) if isinstance(self.cutter, Prisms) else None

    def at(self, height: float) -> BaseGeometry:
        """Return the walls at a height, and those massive bodies that stand near the floor too.

        Heights that share a section give the same geometry object.
        """
        if height not in self._made:
            layer = self._layer(height)
            found, walls = self._section(height, layer, upright_only=True)
            self._closets[height] = found.closets
            made = self._of_layers.get(layer) if layer is not None else None
            if made is None:
                massive = [
                    part for part in polygons_of(found.solids) if intersect(part, self.foot).area > MOST * part.area
                ]
                made = unite([walls, *massive]) if massive else walls
            if layer is not None:
                self._of_layers[layer] = made
            self._made[height] = made
        return self._made[height]

    def believed(self, breast_m: float, top_m: float) -> WallSections:
        """Return these sections, or sections without massive bodies if winding makes a block of the rooms (R6)."""
        if isinstance(self.cutter, Prisms):  # their sections use no winding
            return self
        below, over = (self._section(height, None, upright_only=True) for height in (breast_m, top_m))
        if _is_filled(*below) or not _is_filled(*over):
            return self
        return WallSections(self.cutter, self.sheet_m, self.solid_m, self.foot_m, winding=False)

    @property
    def closets(self) -> BaseGeometry:
        """The closets of all sections made so far: narrow spaces in a closed body."""
        return unite([closet for closet in self._closets.values() if not closet.is_empty])

    def closets_at(self, one_m: float, other_m: float) -> BaseGeometry:
        """Return the closets common to two heights; ``at`` must have been called with both."""
        return intersect(self._closets[one_m], self._closets[other_m])


# ---------------------------------------------------------------------------------------------------------------------
# Where things end: below the walls beside them, with them, or at a sloped roof.
# ---------------------------------------------------------------------------------------------------------------------

GOES_ON = 0.75
LIKE_A_SHEET = 1.3
HEADROOM_M = (1.0, 1.9)


def find_overhangs(above: Sequence[BaseGeometry], standing: BaseGeometry) -> BaseGeometry:
    """Return what hangs over free floor, in sections ``above`` each other, up to where the walls beside it end."""
    found: list[BaseGeometry] = []
    higher, kept = EMPTY, EMPTY
    for here in reversed(above):
        if here is higher:  # sections of one layer are one geometry
            continue
        closing = drop_thin_parts(subtract(here, standing), SLIVER_M)
        loose: list[Polygon] = []
        if not higher.is_empty:
            walls = intersect(here, standing)
            ending = drop_thin_parts(subtract(closing, kept), SLIVER_M)
            house_goes_on = intersect(walls, higher).area > GOES_ON * walls.area
            loose = [part for part in polygons_of(ending) if _walls_go_on(part, walls, higher, alone=house_goes_on)]
        kept = subtract(closing, unite(loose)) if loose else closing
        found.append(kept)
        higher = here
    return drop_thin_parts(unite(found), SLIVER_M) if len(found) > 1 else kept


@dataclass(frozen=True, eq=False)
class LowPiece:
    """A piece that stands on the floor and ends; ``stood_m`` is the height, m, of the last section that has it."""

    part: Polygon
    stood_m: float


def find_pieces_below_wall_tops(
    standing: BaseGeometry, above: Sequence[BaseGeometry], heights: Sequence[float]
) -> list[LowPiece]:
    """Return the pieces of ``standing`` that end, in sections ``above`` each other, below the walls beside them.

    ``heights``, metres, are those of ``standing`` and of the sections above it.
    """
    found: list[LowPiece] = []
    present = standing
    for here, below_m in zip(above, heights, strict=False):
        still = intersect(present, here)
        house_goes_on = still.area > 0.5 * present.area
        found += [
            LowPiece(part, below_m)
            for part in polygons_of(drop_thin_parts(subtract(present, still), SLIVER_M))
            if _walls_go_on(part, subtract(_around(part, present), part), here, alone=house_goes_on)
        ]
        present = still
    return found


def _around(part: Polygon, walls: BaseGeometry) -> BaseGeometry:
    x1, y1, x2, y2 = part.bounds
    return clip_to_box(walls, x1 - 1.0, y1 - 1.0, x2 + 1.0, y2 + 1.0)


def _walls_go_on(part: Polygon, walls: BaseGeometry, higher: BaseGeometry, *, alone: bool) -> bool:
    """Return whether the walls beside a part reach higher than it; ``alone`` is the answer without walls beside it.

    The walls on both sides have to: under a sloped roof, only the wall on one side of a door does.
    """
    beside = intersect(shapely.buffer(part, BESIDE_M, quad_segs=2), _around(part, walls))
    if beside.is_empty:
        return alone
    return bool(intersect(beside, _around(part, higher)).area > GOES_ON * beside.area)


def find_low_headroom(mesh: Mesh) -> BaseGeometry:
    """Return where a roof or a ceiling hangs too low to stand under: the plan area of large faces at such a height."""
    if isinstance(mesh, Prisms):  # without triangles where no body has so large a face
        mesh = Prisms(each for each in mesh.bodies if each.area.area > PATCH_M2)
    if not ((mesh.heights > HEADROOM_M[0]) & (mesh.heights < HEADROOM_M[1])).any():
        return EMPTY
    corners = mesh.vertices[mesh.faces]
    top = corners[:, :, 2].max(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    plan_m2 = np.abs(normal[:, 2]) / 2
    low = (top > HEADROOM_M[0]) & (top < HEADROOM_M[1]) & (plan_m2 > PATCH_M2)
    return unite(shapely.polygons(corners[low][:, :, :2])) if low.any() else EMPTY


def ends_at_sloped_roof(part: Polygon, cutter: MeshSlicer | Prisms, stood_m: float = FOOT_M) -> bool:
    """Return whether a piece that stands at the height ``stood_m`` ends above it at a sloped roof."""
    inside = np.array([p.coords[0] for p in _places(part)])
    meets = cutter.caps.slopes_over(inside, WALL_M, stood_m)
    return bool(meets.sum() > len(meets) / 2)


def _places(part: Polygon) -> list[shapely.Point]:
    """Points spread over a part: one in each of a few pieces of it."""
    x1, y1, x2, y2 = part.bounds
    along_x = x2 - x1 >= y2 - y1
    edges = np.linspace(x1 if along_x else y1, x2 if along_x else y2, LOOKS + 1)
    boxes = [shapely.box(a, y1, b, y2) if along_x else shapely.box(x1, a, x2, b) for a, b in pairwise(edges)]
    pieces = [intersect(part, box) for box in boxes]
    return [piece.representative_point() for piece in pieces if not piece.is_empty]
