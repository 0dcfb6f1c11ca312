"""Cut meshes at a height into oriented segments, tell which points lie inside bodies, and choose heights to cut at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.meshes import Mesh, are_pieces_closed, label_pieces
from pipeline.tolerances import (
    FOOT_M,
    HALF_CM_M,
    HAND_M,
    HEAD_M,
    LAP_M,
    LARGELY,
    MM_M,
    PARTITION_M,
    PATCH_M2,
    SAME,
    SHEET_M,
    SPECK,
)

# ---------------------------------------------------------------------------------------------------------------------
# Mesh and plane: the raw segments of a horizontal section, oriented so that a solid's inside lies to their left.
#
# R1  Each segment has the number of its body: faces that share vertices (by index) are one body. SUNCG writes every
#     slab of a wall as a body of its own, and so do most modellers.
# R2  A small face that is not upright counts as upright if the faces around it are: in a scan, specks of a wall look in
#     any direction, and without them the wall would have holes at every height.
# R3  A closed body is wall at a height if upright faces make most of its outline there: a gable has a slope at each
#     end, a roof has little else. Of an open body, only the upright faces count.
# ---------------------------------------------------------------------------------------------------------------------

STEEP = 0.5
"""A face whose unit normal has |z| below this is upright: a wall, not a floor, a roof or a slope."""


@dataclass(frozen=True, eq=False)
class SectionSegments:
    """A section: ``ends`` (n, 2, 2) metres, the body's inside to the left of each; ``body`` (n,) numbers the bodies.

    ``height`` and ``caps`` tell what lies over and under a point of it.
    """

    ends: npt.NDArray[np.float64]
    body: npt.NDArray[np.int64]
    height: float
    caps: EndCaps


@dataclass(frozen=True, eq=False)
class MeshSlicer:
    """A mesh made ready for many horizontal cuts."""

    mesh: Mesh

    @cached_property
    def _normals(self) -> npt.NDArray[np.float64]:
        a, b, c = (self.mesh.vertices[self.mesh.faces[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        return normal / np.where(length > 0, length, 1.0)[:, None]

    @cached_property
    def _z(self) -> npt.NDArray[np.float64]:
        return np.ascontiguousarray(self.mesh.vertices[:, 2])

    @cached_property
    def _span(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        heights = self._z[self.mesh.faces]
        return heights.min(axis=1), heights.max(axis=1)

    @cached_property
    def _upright(self) -> npt.NDArray[np.bool_]:
        upright = np.abs(self._normals[:, 2]) < STEEP
        low, high = self._span
        stray = np.flatnonzero(~upright & (high - low > 0))
        edges = np.roll(corners := self.mesh.vertices[self.mesh.faces[stray]], -1, axis=1) - corners
        stray = stray[np.linalg.norm(edges, axis=2).max(axis=1) < PARTITION_M]
        if len(stray):  # R2
            around = self._normal_sums(stray)
            upright[stray] = np.abs(around[:, 2]) < STEEP * np.linalg.norm(around, axis=1)
        return upright

    def _normal_sums(self, faces: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
        """Sums (n, 3) of the normals of all faces that share a vertex with each of these, by their area."""
        corners = self.mesh.faces
        a, b, c = (self.mesh.vertices[corners[:, k]] for k in range(3))
        area = np.repeat(np.cross(b - a, c - a), 3, axis=0)
        n = len(self.mesh.vertices)
        at = np.stack([np.bincount(corners.ravel(), area[:, k], n) for k in range(3)], axis=1)
        return np.asarray(at[corners[faces]].sum(axis=1))

    @cached_property
    def _body(self) -> npt.NDArray[np.int64]:
        return label_pieces(self.mesh.faces, len(self.mesh.vertices))

    @property
    def heights(self) -> npt.NDArray[np.float64]:
        """(n,) vertex heights, metres above the level's floor."""
        return self._z

    def is_upright_between(self, low: float, high: float) -> bool:
        """Return whether every section between two heights is the same but for rounding.

        That is so if no corner lies between them, and all faces that cross them are upright.
        """
        bottom, top = self._span
        crossing = (bottom < high) & (top > low)
        within = crossing & ((bottom >= low) | (top <= high))
        # leaning by less than ``POINT_M`` over a storey
        return not within.any() and bool((np.abs(self._normals[crossing, 2]) < SAME).all())

    def may_end_between(self, low: float, high: float) -> bool:
        """Return whether a body that stands at the lower height may end below the higher one."""
        return not self.is_upright_between(low, high)

    def cut(self, height: float, *, upright_only: bool = False) -> SectionSegments:
        """Return the section at ``height``, metres above the level's floor.

        ``upright_only`` leaves floors, ceilings and roofs out, so that what is cut above head height is wall (R3).
        """
        low, high = self._span
        faces = np.flatnonzero((low < height) & (high > height))
        if not len(faces):
            return SectionSegments(np.zeros((0, 2, 2)), np.zeros(0, np.int64), height, self.caps)
        segments = _crossings(self.mesh, faces, height)
        along = segments[:, 1] - segments[:, 0]
        normal = self._normals[faces]
        # the outward normal must lie to the right of the segment: right of (dx, dy) is (dy, -dx)
        backwards = along[:, 1] * normal[:, 0] - along[:, 0] * normal[:, 1] < 0
        segments[backwards] = segments[backwards, ::-1]
        kept = self._of_walls(segments, faces) if upright_only else slice(None)
        return SectionSegments(np.ascontiguousarray(segments[kept]), self._body[faces][kept], height, self.caps)

    def _of_walls(self, segments: npt.NDArray[np.float64], face: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Return which segments (n, 2, 2) of these faces are of walls."""
        upright, body = self._upright[face], self._body[face]
        length = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
        count = int(self._body.max()) + 1
        share = np.bincount(body, length * upright, count) / np.maximum(np.bincount(body, length, count), 1e-12)
        return np.asarray(np.where(self._is_closed[body], share[body] > LARGELY, upright), np.bool_)

    @cached_property
    def _is_closed(self) -> npt.NDArray[np.bool_]:
        """Which bodies are closed all round."""
        return are_pieces_closed(self.mesh.faces, self._body)

    @cached_property
    def caps(self) -> EndCaps:
        """The faces that are not upright."""
        lying = np.abs(self._normals[:, 2]) > SPECK  # a body's top or bottom
        return EndCaps(self.mesh.vertices[self.mesh.faces[lying]])


def _crossings(mesh: Mesh, faces: npt.NDArray[np.int64], height: float) -> npt.NDArray[np.float64]:
    """(n, 2, 2) where the plane crosses these faces, each of which reaches below it and above.

    A vertex at the very height counts as above it. Each edge is crossed from its vertex of lower index, so that faces
    beside each other share the ends of their segments to the last bit.
    """
    corners = mesh.faces[faces]
    z = mesh.vertices[:, 2]
    above = z[corners] >= height
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(faces))
    ends = np.empty((len(faces), 2, 2))
    for k in (0, 1):
        edge = np.stack([corners[rows, alone], corners[rows, (alone + 1 + k) % 3]])
        low, high = edge.min(axis=0), edge.max(axis=0)
        share = (height - z[low]) / (z[high] - z[low])
        start = mesh.vertices[low, :2]
        ends[:, k] = start + share[:, None] * (mesh.vertices[high, :2] - start)
    return ends


def segments_that_differ(cut: SectionSegments, other: SectionSegments) -> SectionSegments:
    """Return ``cut`` without the bodies of which ``other`` has the same section: upright walls without a hole."""
    bodies = int(max(cut.body.max(initial=0), other.body.max(initial=0))) + 1
    moved = np.abs(_signature(cut, bodies) - _signature(other, bodies)).max(axis=0)
    keep = moved[cut.body] > 1e-6
    return replace(cut, ends=cut.ends[keep], body=cut.body[keep])


def _signature(cut: SectionSegments, bodies: int) -> npt.NDArray[np.float64]:
    """(5, bodies): the number of segments of each body, and sums over their middles that a moved end would change."""
    x, y = cut.ends.sum(axis=1).T
    return np.stack([np.bincount(cut.body, w, bodies) for w in (np.ones(len(x)), x, y, x * x, y * y)])


# ---------------------------------------------------------------------------------------------------------------------
# How often a section's segments wind around a point.
# ---------------------------------------------------------------------------------------------------------------------


def winding_number(points: npt.NDArray[np.object_], segments: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Return how often the oriented segments wind around each point, counter-clockwise positive (ray to +x)."""
    if not len(points):
        return np.zeros(0, np.int64)
    x, y = shapely.get_x(points)[:, None], shapely.get_y(points)[:, None]
    (x1, y1), (x2, y2) = segments[:, 0].T, segments[:, 1].T
    up, down = (y1 <= y) & (y2 > y), (y2 <= y) & (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x1 + (y - y1) * (x2 - x1) / (y2 - y1)
    right = at > x
    return np.asarray((up & right).sum(axis=1) - (down & right).sum(axis=1), np.int64)


# ---------------------------------------------------------------------------------------------------------------------
# What lies over and under a point of a section: the tops and bottoms by which a body is closed.
#
# In plan, a room of sheets whose faces look outwards has the same section as a massive block. But a block has a top and
# a bottom: a line straight up leaves it through a face that looks up, a line straight down through a face that looks
# down.
# ---------------------------------------------------------------------------------------------------------------------

SLOPE = (0.3, 0.985)
"""|z| of a roof's unit normal: from 70 to 10 degrees."""
PLANE_KEY = np.array([1 << 50, 1 << 40, 1 << 30, 1])
"""Makes one number of a plane's rounded normal and distance; numbers sort ten times faster than rows."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EndCaps:
    """The end caps of bodies: triangles (n, 3, 3) that are not upright, wound as in the mesh; metres."""

    triangles: Floats

    @cached_property
    def _bounds(self) -> tuple[Floats, Floats]:
        plan = self.triangles[:, :, :2]
        return plan.min(axis=1), plan.max(axis=1)

    def close(self, points: Floats, height: float) -> npt.NDArray[np.bool_]:
        """For each plan point (n, 2) whether it lies, at this height, between a bottom and a top of a body."""
        return np.array([self._closes(point, height) for point in points], np.bool_).reshape(len(points))

    def slopes_over(self, points: Floats, reach_m: float, over_m: float = FOOT_M) -> npt.NDArray[np.bool_]:
        """Return for each plan point (n, 2) whether a roof's slope lies over it, with only a wall's own top below that.

        Faces up to the height ``over_m`` are ignored. The lowest other face lies at most ``reach_m`` under the slope. A
        slope lower than ``HEAD_M`` is a roof's if its plane has ``PATCH_M2``: bedding and cushions are smaller.
        """
        return np.array([self._slope_over(point, reach_m, over_m) for point in points], np.bool_).reshape(len(points))

    def _slope_over(self, point: Floats, reach_m: float, over_m: float) -> bool:
        low, high = self._bounds
        which = np.flatnonzero(((low <= point) & (high >= point)).all(axis=1))
        which = which[_turns(self.triangles[which][:, :, :2] - point) != 0]
        heights = _height_at(self.triangles[which], point)
        which, heights = which[heights > over_m], heights[heights > over_m]
        sloped = self._slope_m2[which] > np.where(heights < HEAD_M, PATCH_M2, 0.0)
        return bool(sloped.any() and heights[sloped].min() - heights.min() <= reach_m)

    def lowest_over(self, points: Floats, over_m: float) -> Floats:
        """Return for each plan point (n, 2) the height, m, of the lowest face over it above ``over_m``, or inf."""
        return np.array([self._lowest_over(point, over_m) for point in points], np.float64).reshape(len(points))

    def _lowest_over(self, point: Floats, over_m: float) -> float:
        low, high = self._bounds
        near = self.triangles[((low <= point) & (high >= point)).all(axis=1)]
        heights = _height_at(near[_turns(near[:, :, :2] - point) != 0], point)
        return float(heights[heights > over_m].min(initial=np.inf))

    @cached_property
    def _slope_m2(self) -> Floats:
        """Plan area of the plane that each triangle (n,) is part of, m2; 0 where it does not slope as a roof does."""
        a = self.triangles[:, 0]
        normal = np.cross(self.triangles[:, 1] - a, self.triangles[:, 2] - a)
        unit = normal / np.linalg.norm(normal, axis=1)[:, None]
        unit *= np.where(unit[:, 2] < 0, -1.0, 1.0)[:, None]
        sloped = (unit[:, 2] > SLOPE[0]) & (unit[:, 2] < SLOPE[1])
        planes = np.round(np.column_stack([unit / SPECK, (unit * a).sum(axis=1) / SHEET_M])[sloped])
        plane = np.unique(planes.astype(np.int64) @ PLANE_KEY, return_inverse=True)[1]
        area = np.bincount(plane, np.abs(normal[sloped, 2]) / 2)
        found = np.zeros(len(a))
        found[sloped] = area[plane]
        return found

    def _closes(self, point: Floats, height: float) -> bool:
        low, high = self._bounds
        near = self.triangles[((low <= point) & (high >= point)).all(axis=1)]
        turns = _turns(near[:, :, :2] - point)
        hit = near[turns != 0]
        over = _height_at(hit, point) > height
        turns = turns[turns != 0]
        return bool(turns[over].sum() > 0 and turns[~over].sum() < 0)


def _turns(triangles: Floats) -> npt.NDArray[np.int64]:
    """Return how each plan triangle (n, 3, 2) winds around the origin: 1 (it looks up), -1, or 0 if it lies elsewhere.

    Triangles are half-open: of two that share an edge, exactly one holds a point on the edge.
    """
    (x1, y1), (x2, y2) = (np.moveaxis(p, 2, 0) for p in (triangles, np.roll(triangles, -1, axis=1)))
    left = x1 * y2 - x2 * y1
    up = (y1 <= 0) & (y2 > 0) & (left > 0)
    down = (y2 <= 0) & (y1 > 0) & (left < 0)
    return np.asarray(up.sum(axis=1) - down.sum(axis=1), np.int64)


def _height_at(triangles: Floats, point: Floats) -> Floats:
    """Heights of triangles (n, 3, 3) over a plan point."""
    a = triangles[:, 0]
    normal = np.cross(triangles[:, 1] - a, triangles[:, 2] - a)
    return np.asarray(a[:, 2] - ((point - a[:, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2])


# ---------------------------------------------------------------------------------------------------------------------
# Heights to cut at: never through coplanar faces, since a cut in the plane of a cube's top gives nothing.
# ---------------------------------------------------------------------------------------------------------------------


def distinct_vertex_heights(z: npt.NDArray[np.float64], low: float, high: float) -> npt.NDArray[np.float64]:
    """Vertex heights between ``low`` and ``high`` (metres), sorted, to the millimetre."""
    inside = z[(z > low - 1e-9) & (z < high + 1e-9)]
    return np.unique(np.round(inside, 3))


def height_or_middle_of_widest_gap(wanted: float, z: npt.NDArray[np.float64]) -> float:
    """Return ``wanted``, or the middle of the largest gap between vertex heights within half of it to either side.

    Parameters
    ----------
    wanted
        Height in metres above the level's floor.
    z
        (n,) vertex heights of the mesh, metres.
    """
    if not z.size or np.abs(z - wanted).min() >= LAP_M:
        return wanted
    low, high = 0.5 * wanted, 1.5 * wanted
    edges = np.concatenate([[low], distinct_vertex_heights(z, low, high), [high]])
    widest = int(np.argmax(np.diff(edges)))
    return float(edges[widest] + edges[widest + 1]) / 2


def nearest_clear_height(wanted: float, z: npt.NDArray[np.float64]) -> float:
    """Return the height nearest to ``wanted``, in steps and within ``HAND_M``, that is clear of all vertex heights.

    If there is none, as in a scan, the result is ``wanted``.
    """
    near_by = z[np.abs(z - wanted) < HAND_M + HALF_CM_M]
    for k in range(round(HAND_M / HALF_CM_M)):
        for height in (wanted - k * HALF_CM_M, wanted + k * HALF_CM_M):
            if not near_by.size or np.abs(near_by - height).min() >= LAP_M:
                return height
    return wanted


def section_heights(
    z: npt.NDArray[np.float64], low: float, high: float, *, smallest_gap: float, most: int
) -> list[float]:
    """Return heights that show every distinct section of a mesh of upright walls between ``low`` and ``high``, metres.

    The section of an upright wall does not change between two neighbouring vertex heights. So the result is the middle
    of the highest such gap and of the widest others, ``most`` in all. Where gaps of ``smallest_gap`` metres are less
    than half of the range, as in a scan, the result is ``most`` evenly spaced heights.
    """
    if high <= low:
        return []
    edges = np.concatenate([[low], distinct_vertex_heights(z, low, high), [high]])
    gaps = np.diff(edges)
    wide = np.flatnonzero(gaps >= smallest_gap)
    if len(wide) and gaps[wide].sum() > 0.5 * (high - low):
        others = wide[:-1][np.argsort(-gaps[wide[:-1]], kind="stable")[: most - 1]]
        return [float(edges[k] + edges[k + 1]) / 2 for k in sorted([*others, wide[-1]])]
    spread = np.linspace(low, high, most + 2)[1:-1]
    return [move_off_vertex_height(float(h), edges) for h in spread]


def move_off_vertex_height(wanted: float, edges: npt.NDArray[np.float64]) -> float:
    """Move a height off a vertex height by the smallest step that keeps it clear."""
    if np.abs(edges - wanted).min() >= LAP_M / 2:
        return wanted
    k = int(np.searchsorted(edges, wanted))
    above = edges[k : k + 2]
    return float(above.mean()) if len(above) == 2 else wanted + LAP_M


def lengths_of_faces(
    mesh: Mesh, height: float, spaces: Sequence[Polygon], walls: BaseGeometry
) -> tuple[Floats, Floats]:
    """Return for each space (n,) the metres of upright faces at its edge that look into it, and that look away.

    The faces are those that a cut at ``height`` meets. A face that looks into the ``walls`` looks the other way: that
    solid is written inside out. If a source winds its sheets inconsistently, the result is noise.
    """
    cut = MeshSlicer(mesh).cut(height, upright_only=True).ends
    along = cut[:, 1] - cut[:, 0]
    length = np.hypot(*along.T)
    ahead = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(length, MM_M)[:, None]
    places, tree = cut.mean(axis=1), shapely.STRtree(spaces)
    shapely.prepare(walls)
    in_wall, before_wall = (shapely.contains_xy(walls, places + way * MM_M * ahead) for way in (1.0, -1.0))
    ahead[in_wall & ~before_wall] *= -1.0
    rings = shapely.get_exterior_ring(np.array(spaces, np.object_))

    def beside(way: float) -> Floats:
        face, space = tree.query(shapely.points(places + way * SHEET_M * ahead), predicate="within")
        near = shapely.dwithin(shapely.points(places[face]), rings[space], SHEET_M)
        return np.bincount(space[near], length[face[near]], minlength=len(spaces)).astype(np.float64)

    return beside(1.0), beside(-1.0)


def barred_shares(mesh: Mesh, height: float, strips: Sequence[Polygon], alongs: Floats) -> Floats:
    """Return the share of each strip's width (n,) that a mesh bars at a height.

    Parameters
    ----------
    height
        Metres above the level's floor.
    strips
        (n,) rectangles in the plan.
    alongs
        (n, 2) unit vectors along which the strips' widths are measured.
    """
    z = mesh.vertices[:, 2][mesh.faces]
    faces = np.flatnonzero((z.min(axis=1) < height) & (z.max(axis=1) > height))
    if not len(faces) or not len(strips):
        return np.zeros(len(strips))
    lines = shapely.linestrings(_crossings(mesh, faces, height))
    of_strip, line = shapely.STRtree(lines).query(np.array(strips, np.object_), predicate="intersects")
    inside = shapely.intersection(lines[line], np.array(strips, np.object_)[of_strip])
    meets = ~shapely.is_empty(inside)  # a face without area crosses a height in a point
    of_strip, inside = of_strip[meets], inside[meets]
    found = np.zeros(len(strips))
    for k, (strip, along) in enumerate(zip(strips, alongs, strict=True)):
        spans = [np.sort(shapely.get_coordinates(each) @ along)[[0, -1]] for each in inside[of_strip == k]]
        taken = shapely.union_all([shapely.linestrings([(low, 0.0), (high, 0.0)]) for low, high in spans])
        found[k] = shapely.length(taken) / np.ptp(shapely.get_coordinates(strip) @ along)
    return found
