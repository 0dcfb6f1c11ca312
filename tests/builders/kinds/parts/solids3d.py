"""Bodies of triangles from plan polygons: prisms, flat faces, boxes, round things."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import manifold3d
import numpy as np
import shapely
import trimesh
from shapely import Polygon


def polygons(shape: shapely.Geometry) -> list[Polygon]:
    """The polygons of a shape."""
    return [g for g in shapely.get_parts(shape) if isinstance(g, Polygon) and g.area > 1e-9]


def rings(polygon: Polygon) -> list[np.ndarray]:
    """Rings without their last point: the outer one counter-clockwise, holes clockwise."""
    turned = shapely.geometry.polygon.orient(polygon)
    return [np.asarray(r.coords)[:-1, :2] for r in (turned.exterior, *turned.interiors)]


def flat(shape: shapely.Geometry, z: float, up: bool = True) -> trimesh.Trimesh:
    """A level face over a plan shape, seen from above or from below."""
    meshes = []
    for polygon in polygons(shape):
        loops = rings(polygon)
        points = np.vstack(loops)
        faces = np.asarray(manifold3d.triangulate(loops), np.int64)
        if len(faces):
            corners = points[faces]
            first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
            clockwise = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0
            faces[clockwise] = faces[clockwise][:, ::-1]
            vertices = np.column_stack([points, np.full(len(points), z)])
            meshes.append(mesh(vertices, faces if up else faces[:, ::-1]))
    return joined(meshes)


def solid(shape: shapely.Geometry, low: float, high: float) -> manifold3d.Manifold:
    """A prism over a plan shape as an exact solid."""
    loops = [ring for polygon in polygons(shape) for ring in rings(polygon)]
    if not loops:
        return manifold3d.Manifold()
    return manifold3d.CrossSection(loops).extrude(high - low).translate((0.0, 0.0, low))


def mesh_of(body: manifold3d.Manifold) -> trimesh.Trimesh:
    """The triangles of a solid."""
    found = body.to_mesh64() if hasattr(body, "to_mesh64") else body.to_mesh()
    return mesh(np.asarray(found.vert_properties, float)[:, :3], np.asarray(found.tri_verts, np.int64))


def prism(shape: shapely.Geometry, low: float, high: float) -> trimesh.Trimesh:
    """A prism over a plan shape."""
    return mesh_of(solid(shape, low, high))


def upright(a: Sequence[float], b: Sequence[float], low: float, high: float) -> trimesh.Trimesh:
    """A sheet that stands on the way from ``a`` to ``b``; it faces the right of that way."""
    corners = [(a[0], a[1], low), (b[0], b[1], low), (b[0], b[1], high), (a[0], a[1], high)]
    return mesh(corners, [[0, 1, 2], [0, 2, 3]])


def box(x1: float, y1: float, z1: float, x2: float, y2: float, z2: float) -> trimesh.Trimesh:
    """A box with its sides along the axes."""
    return trimesh.creation.box(bounds=[[x1, y1, z1], [x2, y2, z2]])


def cylinder(x: float, y: float, radius: float, low: float, high: float, sides: int = 12) -> trimesh.Trimesh:
    """An upright cylinder."""
    made = trimesh.creation.cylinder(radius=radius, height=high - low, sections=sides)
    made.apply_translation((x, y, (low + high) / 2))
    return made


def mesh(vertices: Sequence[object] | np.ndarray, faces: Sequence[object] | np.ndarray) -> trimesh.Trimesh:
    """Triangles as they are."""
    return trimesh.Trimesh(np.asarray(vertices, float), np.asarray(faces, np.int64), process=False)


def joined(meshes: Iterable[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Meshes put together, unwelded."""
    vertices, faces, start = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    for part in meshes:
        vertices.append(np.asarray(part.vertices))
        faces.append(np.asarray(part.faces) + start)
        start += len(part.vertices)
    return mesh(np.vstack(vertices), np.vstack(faces))


def moved(part: trimesh.Trimesh, x: float, y: float, z: float = 0.0, turn_rad: float = 0.0) -> trimesh.Trimesh:
    """A mesh turned about the upright axis through its origin, then moved."""
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    points = np.asarray(part.vertices) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return mesh(points + np.array([x, y, z]), part.faces)
