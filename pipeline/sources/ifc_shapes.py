"""Plan shapes of an IFC building's bodies."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.sources.ifc_file import Part
from pipeline.values import Mesh

SLIVER_M2 = 1e-9
CRACK_M = 5e-4  # pieces of one body closer than twice this are one piece
FLAT = 0.9  # vertical share of a floor face's normal
STEP_M = 0.3  # a room's floor may have a step this high
FLOOR_SHARE = 0.3  # flat faces at the bottom that are less of the shadow are no floor


def united(parts: Iterable[Part]) -> Mesh:
    """Put the parts' triangles into one mesh."""
    meshes = [part.mesh for part in parts]
    if not meshes:
        return Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64))
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)])
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), faces)


def block(rectangle: Polygon, low: float, high: float) -> Mesh:
    """A plan rectangle from one height to another as a closed body."""
    ring = shapely.get_coordinates(shapely.orient_polygons(rectangle))[:4]
    points = np.concatenate([np.column_stack([ring, np.full(4, z)]) for z in (low, high)])
    sides = [face for k in range(4) for face in ((k, (k + 1) % 4, k + 4), ((k + 1) % 4, (k + 1) % 4 + 4, k + 4))]
    return Mesh(points, np.array([(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), *sides], np.int64))


def shadow(mesh: Mesh) -> BaseGeometry:
    """Plan shadow of a body, all pieces."""
    return _union(mesh.vertices[mesh.faces])


def footprint(mesh: Mesh) -> Polygon:
    """Plan shadow of a body, its largest piece; empty where it has none."""
    return _largest(shadow(mesh))


def floor_of(mesh: Mesh) -> Polygon:
    """Where a body stands on its floor: its flat lowest faces, its shadow where it has none; the largest piece.

    A room whose walls lean outwards is smaller on its floor than its shadow.
    """
    triangles = mesh.vertices[mesh.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    low = triangles[:, :, 2].max(axis=1) < mesh.vertices[:, 2].min() + STEP_M
    flat = low & (np.abs(normals[:, 2]) > FLAT * np.maximum(lengths, 1e-12))
    whole, floor = footprint(mesh), _largest(_union(triangles[flat]))
    return floor if floor.area >= FLOOR_SHARE * whole.area else whole


def _union(triangles: npt.NDArray[np.float64]) -> BaseGeometry:
    """Unite plan shadows of triangles (k, 3, 3); rounding before, not after, since slivers that vanish leave cracks."""
    shapes = shapely.polygons(np.round(triangles[:, :, :2], 6))
    whole = shapely.union_all(shapes[shapely.area(shapes) > SLIVER_M2])
    if isinstance(whole, Polygon):
        return whole
    return whole.buffer(CRACK_M, join_style="mitre").buffer(-CRACK_M, join_style="mitre")


def _largest(shape: BaseGeometry) -> Polygon:
    pieces = [piece for piece in shapely.get_parts(shape) if isinstance(piece, Polygon)]
    return max(pieces, key=lambda piece: piece.area, default=Polygon())


def are_one(one: Polygon, other: Polygon, iou: float) -> bool:
    """Whether the intersection of two areas over their union is more than ``iou``."""
    shared = one.intersection(other).area
    return bool(shared > iou * (one.area + other.area - shared))
