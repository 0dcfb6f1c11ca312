"""Hold triangle meshes and point clouds, split meshes into connected bodies, and find a body's box and footprint."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import EMPTY, Shapes, drop_lines_and_points
from pipeline.tolerances import MANY_FACES, MM_M, POINT_M, SPECK

# ---------------------------------------------------------------------------------------------------------------------
# Triangles in space.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: ``vertices`` (n, 3) float64 metres, ``faces`` (m, 3) int64. No promise that it is welded or closed.

    A point cloud has vertices and no faces.
    """

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int64]

    @property
    def is_empty(self) -> bool:
        """Whether it has neither triangles nor points."""
        return not (len(self.faces) or len(self.vertices))

    @property
    def heights(self) -> npt.NDArray[np.float64]:
        """(n,) at which its corners lie, metres."""
        return self.vertices[:, 2]

    @property
    def highest_m(self) -> float:
        """The height of its highest corner, metres; 0 without corners."""
        return float(self.heights.max(initial=0.0))

    @property
    def is_cloud(self) -> bool:
        """Whether it has points only."""
        return len(self.vertices) > 0 and not len(self.faces)


NO_MESH: Final = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))


def merge_meshes(meshes: Iterable[Mesh | None]) -> Mesh:
    """Return one mesh of several; those that are None, or have no faces, are left out."""
    parts = [mesh for mesh in meshes if mesh is not None and len(mesh.faces)]
    if not parts:
        return NO_MESH
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in parts[:-1])])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(parts, starts, strict=True)])
    return Mesh(np.concatenate([mesh.vertices for mesh in parts]), faces)


# ---------------------------------------------------------------------------------------------------------------------
# Pieces of a mesh: what is connected by its corners, and whether it is closed.
# ---------------------------------------------------------------------------------------------------------------------


def label_pieces(faces: npt.NDArray[np.int64], n_vertices: int) -> npt.NDArray[np.int64]:
    """Return for each face (m, 3) the number of its piece: faces connected through shared corners."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    i, j = np.concatenate([faces[:, :2], faces[:, 1:]]).T
    links = coo_matrix((np.ones(len(i), np.int8), (i, j)), shape=(n_vertices, n_vertices))
    return np.asarray(connected_components(links, directed=False)[1][faces[:, 0]], np.int64)


def are_pieces_closed(faces: npt.NDArray[np.int64], label: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """For each piece whether all of its edges have a face on both sides."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    key = edges[:, 0] * (int(faces.max()) + 1) + edges[:, 1]
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    closed = np.ones(int(label.max()) + 1, np.bool_)
    closed[np.tile(label, 3)[first[count < 2]]] = False
    return closed


# ---------------------------------------------------------------------------------------------------------------------
# The bodies of a mesh: what hangs together by its corners, with the upright box that each of them fills.
#
# R1  Faces that share corners are one body. A closed body is never joined to another, even if they touch: a leaf and
#     its frame, a frame and its wall.
# R2  Many exporters write a corner once for each face that meets there (normals, textures), which leaves open pieces.
#     Open pieces with corners at one place are joined.
# ---------------------------------------------------------------------------------------------------------------------

SCAN_FACES = 500_000
"""A mesh of more faces is taken as a scan: one body, not split."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Box:
    """An upright box: ``centre`` (2,), unit ``along`` its longer side in plan, sizes and heights in metres."""

    centre: Floats
    along: Floats
    width: float
    thickness: float
    low: float
    high: float

    @property
    def across(self) -> Floats:
        """Unit vector of the shorter side."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def height(self) -> float:
        """Metres from its lowest to its highest point."""
        return self.high - self.low


@dataclass(frozen=True, eq=False)
class Bodies:
    """The bodies of ``mesh``: ``of_face`` (m,) numbers them; ``low`` and ``high`` (n, 3) are their bounds."""

    mesh: Mesh
    of_face: npt.NDArray[np.int64]
    low: Floats
    high: Floats

    @classmethod
    def of(cls, mesh: Mesh) -> Bodies:
        """Take a mesh apart."""
        faces = mesh.faces
        if not len(faces) or len(faces) > SCAN_FACES:
            low = mesh.vertices.min(axis=0, initial=np.inf)[None]
            return cls(mesh, np.zeros(len(faces), np.int64), low, mesh.vertices.max(axis=0, initial=-np.inf)[None])
        label = label_pieces(faces, len(mesh.vertices))
        loose = ~are_pieces_closed(faces, label)[label]
        if loose.any():  # R2
            place = number_places(mesh.vertices)
            joined = label_pieces(place[faces[loose]], len(mesh.vertices))
            label = label.copy()
            label[loose] = len(faces) + joined
        of_face = np.unique(label, return_inverse=True)[1].astype(np.int64)
        order = np.argsort(of_face, kind="stable")
        points = mesh.vertices[faces[order]]
        first = np.flatnonzero(np.diff(of_face[order], prepend=-1))
        low, high = points.min(axis=1), points.max(axis=1)
        return cls(mesh, of_face, np.minimum.reduceat(low, first), np.maximum.reduceat(high, first))

    @cached_property
    def _order(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        order = np.argsort(self.of_face, kind="stable")
        return order, np.searchsorted(self.of_face[order], np.arange(len(self.low) + 1))

    def faces(self, body: int) -> npt.NDArray[np.int64]:
        """Indices of a body's faces."""
        order, start = self._order
        return order[start[body] : start[body + 1]]

    def box(self, body: int) -> Box:
        """Return the smallest upright box around a body."""
        points = self.mesh.vertices[np.unique(self.mesh.faces[self.faces(body)])]
        return box_around(points)

    def without(self, bodies: list[int]) -> Mesh:
        """Return the mesh without these bodies."""
        return self._mesh_of(~np.isin(self.of_face, bodies)) if bodies else self.mesh

    def only(self, bodies: list[int]) -> Mesh:
        """Return the mesh of these bodies alone."""
        return self._mesh_of(np.isin(self.of_face, bodies))

    def _mesh_of(self, faces: npt.NDArray[np.bool_]) -> Mesh:
        return Mesh(self.mesh.vertices, self.mesh.faces[faces])


def box_around(points: Floats) -> Box:
    """Return the smallest upright box around points (n, 3)."""
    import cv2

    middle = points[:, :2].mean(axis=0)
    (x, y), (w, h), degrees = cv2.minAreaRect((points[:, :2] - middle).astype(np.float32))
    angle = np.deg2rad(degrees + (0.0 if w >= h else 90.0))
    along = np.array([np.cos(angle), np.sin(angle)])
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    return Box(middle + np.array([x, y]), along, float(max(w, h)), float(min(w, h)), low, high)


def number_places(vertices: Floats) -> npt.NDArray[np.int64]:
    """Return for each corner (n, 3) the number of its place; corners at one place have the same number."""
    cells = np.column_stack([cells_along(vertices[:, axis], POINT_M) for axis in range(3)])
    order = np.lexsort(cells.T[::-1])  # np.unique sorts rows six times as slowly
    new = np.any(np.diff(cells[order], axis=0, prepend=cells[order[:1]] - 1), axis=1)
    found = np.empty(len(cells), np.int64)
    found[order] = np.cumsum(new) - 1
    return found


def cells_along(values: Floats, cell_m: float, first: float = -0.5) -> npt.NDArray[np.int64]:
    """For each coordinate (n,), in metres, the number of its cell; number 0 begins at ``first`` cells.

    Coordinates that differ only by rounding get one cell, even on both sides of a cell's edge: in a turned house,
    corners at one place differ in the last digits.
    """
    order = np.argsort(values, kind="stable")
    rising = values[order]
    starts = np.flatnonzero(np.diff(rising, prepend=-np.inf) > SPECK * cell_m)
    cells = np.floor(rising[starts] / cell_m - first).astype(np.int64)
    found = np.empty(len(values), np.int64)
    found[order] = np.repeat(cells, np.diff(starts, append=len(values)))
    return found


# ---------------------------------------------------------------------------------------------------------------------
# The shadow of a body in plan.
# ---------------------------------------------------------------------------------------------------------------------


def footprint(mesh: Mesh) -> BaseGeometry:
    """Return the plan area that a body covers; its convex hull if it has very many faces."""
    if not len(mesh.faces):
        return EMPTY
    corners = mesh.vertices[mesh.faces][:, :, :2]
    if len(mesh.faces) > MANY_FACES:
        return drop_lines_and_points(
            shapely.convex_hull(shapely.multipoints(np.unique(corners.reshape(-1, 2), axis=0)))
        )
    triangles = shapely.polygons(corners)
    return drop_lines_and_points(shapely.union_all(triangles[shapely.area(triangles) > 1e-9], grid_size=MM_M))


def box_polygon(box: Box, *, width: float | None = None, depth: float | None = None) -> Polygon:
    """Return the plan rectangle of a box; ``width`` and ``depth`` (m) replace its own."""
    a = box.along * (box.width if width is None else width) / 2
    d = box.across * (box.thickness if depth is None else depth) / 2
    c = box.centre
    return shapely.polygons(np.array([c - a - d, c + a - d, c + a + d, c - a + d]))


def strips_beside(boxes: Sequence[Box], widths_m: Sequence[float], *, off_m: float, depth_m: float) -> Shapes:
    """Return two strips (n, 2) of these widths (n,) beside each of some boxes, on its right and on its left.

    Each strip is centred on a long side, begins ``off_m`` away from it and is ``depth_m`` deep.
    """
    if not boxes:
        return np.zeros((0, 2), np.object_)
    centre, along = (np.array([getattr(box, name) for box in boxes])[:, None] for name in ("centre", "along"))
    thickness, width = np.array([box.thickness for box in boxes]), np.array(widths_m)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) * np.array([[-1.0], [1.0]])
    middle = centre + across * (thickness[:, None, None] / 2 + off_m + depth_m / 2)
    long, deep = along * width[:, None, None] / 2, across * depth_m / 2
    corners = [middle - long - deep, middle + long - deep, middle + long + deep, middle - long + deep]
    return np.asarray(shapely.polygons(np.stack(corners, axis=2)))


def box_around_polygon(polygon: Polygon) -> Box:
    """Return the smallest rectangle around a plan polygon, as a box without height."""
    return boxes_around_polygons([polygon])[0]


def boxes_around_polygons(polygons: Sequence[Polygon]) -> list[Box]:
    """Return ``box_around_polygon`` of each."""
    around = shapely.minimum_rotated_rectangle(np.array(polygons, np.object_))
    corners = shapely.get_coordinates(around).reshape(-1, 5, 2)[:, :4]
    edges = corners[:, 1:3] - corners[:, :2]
    lengths = np.hypot(edges[..., 0], edges[..., 1])
    longer = (lengths[:, 1] > lengths[:, 0]).astype(np.int64)
    rows = np.arange(len(corners))
    wide, thick = lengths[rows, longer], lengths[rows, 1 - longer]
    along = edges[rows, longer] / np.maximum(wide, 1e-9)[:, None]
    found = zip(corners.mean(axis=1), along, wide.tolist(), thick.tolist(), strict=True)
    return [Box(centre, axis, width, thickness, 0.0, 0.0) for centre, axis, width, thickness in found]
