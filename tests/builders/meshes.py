"""Tiny houses of boxes and sheets, z-up and in metres, whose levels, walls and rooms are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from pipeline.values import Mesh

Rectangle = tuple[float, float, float, float]
THICKNESS = 0.2

# A chiral house: an L of 8 x 6 m without its upper right corner, one inner wall with a door gap, one window.
L_WALLS: tuple[Rectangle, ...] = (
    (0.0, 0.0, 8.0, 0.2),
    (7.8, 0.2, 8.0, 3.0),
    (5.0, 2.8, 7.8, 3.0),
    (4.8, 2.8, 5.0, 6.0),
    (0.0, 5.8, 4.8, 6.0),
    (0.0, 0.2, 0.2, 5.8),
    (0.2, 3.0, 3.0, 3.2),
)
L_FLOOR: tuple[Rectangle, ...] = ((0.0, 0.0, 8.0, 3.0), (0.0, 3.0, 5.0, 6.0))


def box(rectangle: Rectangle, low: float, high: float) -> trimesh.Trimesh:
    """Return a box over a plan rectangle (x1, y1, x2, y2) from one height to another."""
    x1, y1, x2, y2 = rectangle
    return trimesh.creation.box(bounds=[[x1, y1, low], [x2, y2, high]])


def sheet(start: tuple[float, float], end: tuple[float, float], low: float, high: float) -> trimesh.Trimesh:
    """Return a wall without thickness between two plan points."""
    corners = [(*start, low), (*end, low), (*end, high), (*start, high)]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


def joined(parts: Sequence[trimesh.Trimesh]) -> Mesh:
    """Put parts together as they are, unwelded."""
    whole = trimesh.util.concatenate(list(parts))
    return Mesh(np.asarray(whole.vertices, np.float64), np.asarray(whole.faces, np.int64))


def storey(low: float, high: float, walls: Sequence[Rectangle] = L_WALLS) -> list[trimesh.Trimesh]:
    """Return the walls of one storey."""
    return [box(wall, low, high) for wall in walls]


def slab(low: float, high: float, areas: Sequence[Rectangle] = L_FLOOR) -> list[trimesh.Trimesh]:
    """Return a slab under (or over) the storey."""
    return [box(area, low, high) for area in areas]


def table(x: float, y: float, floor: float) -> trimesh.Trimesh:
    """Return a table top of 1 x 2 m, 0.75 m above the floor."""
    return box((x, y, x + 2.0, y + 1.0), floor + 0.72, floor + 0.75)


def one_level() -> Mesh:
    """Walls of 2.5 m on a slab whose top is z = 0, with a table."""
    return joined([*storey(0.0, 2.5), *slab(-0.2, 0.0), table(1.0, 1.0, 0.0)])


def walls_alone() -> Mesh:
    """Walls of 2.5 m without floor or ceiling."""
    return joined(storey(0.0, 2.5))


def two_levels() -> Mesh:
    """Floors at 0.0 and 2.8 m, slabs of 0.3 m, walls of 2.5 m, a roof slab."""
    return joined([*slab(-0.3, 0.0), *storey(0.0, 2.5), *slab(2.5, 2.8), *storey(2.8, 5.3), *slab(5.3, 5.6)])


def turned(mesh: Mesh, degrees: float, shift: Sequence[float] = (0.0, 0.0, 0.0)) -> Mesh:
    """Rotate a mesh about the upright axis, then move it."""
    angle = np.radians(degrees)
    rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return Mesh(mesh.vertices @ rotation.T + np.asarray(shift, float), mesh.faces)


def y_up(mesh: Mesh) -> Mesh:
    """Write a z-up mesh in y-up axes, as an exporter to OBJ or glTF does: (x, y, z) becomes (x, z, -y)."""
    x, y, z = mesh.vertices.T
    return Mesh(np.column_stack([x, z, -y]), mesh.faces)


def as_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    """Return the mesh for trimesh's exporters."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
