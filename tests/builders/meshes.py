"""Tiny and large houses of boxes and sheets, z-up and in metres, in memory and in files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import trimesh

from pipeline.sources import mesh_file
from pipeline.sources.storeys.levels import find_levels
from pipeline.values import Level, Mesh

Rectangle = tuple[float, float, float, float]

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


# Mesh files on disk and the levels that are read from them.


Y_UP = (".obj", ".glb", ".gltf")


def write(mesh: Mesh, path: Path) -> Path:
    """Write a z-up mesh in the axes that the file's format stands for."""
    turned_mesh = y_up(mesh) if path.suffix in Y_UP else mesh
    as_trimesh(turned_mesh).export(path)
    return path


def read(path: Path, **options: str) -> list[Level]:
    return [level for item in mesh_file.find(str(path), **options) for level in mesh_file.read(item)]


# Pieces of houses, and the heights at which levels are found in them.


HOUSE = (0.0, 0.0, 8.0, 6.0)
SHELL = ((0.0, 0.0, 8.0, 0.2), (7.8, 0.0, 8.0, 6.0), (0.0, 5.8, 8.0, 6.0), (0.0, 0.0, 0.2, 6.0))
INNER = (4.0, 0.0, 4.2, 6.0)
WALLS = (*SHELL, INNER)


def found(*parts: list[trimesh.Trimesh]) -> list[tuple[float, float]]:
    """(floor, ceiling) of each level."""
    levels = find_levels(joined([each for part in parts for each in part]))
    return [(round(level.floor_z, 3), round(level.ceiling_m, 2)) for level in levels]


# Meshes that are large: a city block, a storey of many rooms, a house whose walls are cut into millions of faces.


STOREY_M = 2.9
WINDOW_M = (1.1, 1.4)


def city(path: Path, faces: int, *, hollow: bool = False, seed: int = 0) -> int:
    """Write a block of buildings with windows, sills, balconies and roofs; return how many faces it has.

    The buildings are shells seen from outside, or, ``hollow``, have walls of 0.3 m with nothing between them.
    """
    rng = np.random.default_rng(seed)
    parts = [box((-30.0, -30.0, 400.0, 400.0), -0.2, 0.0)]
    for place in _places():
        if sum(len(part.faces) for part in parts) >= faces:
            break
        parts += _building(rng, place, hollow=hollow)
    mesh = trimesh.util.concatenate(parts)
    mesh.export(path)
    return len(mesh.faces)


def office(path: Path, corridors: int) -> int:
    """Write a storey of 50 rooms a corridor, their doors under lintels; return how many faces it has."""
    length, deep = 25 * 4.0, 12.0 * corridors
    parts = [box((x, 0.0, x + 0.2, deep + 0.2), 0.0, 2.8) for x in (-2.2, length)]
    parts += [box((-2.0, y, length, y + 0.2), 0.0, 2.8) for y in (0.0, deep)]
    parts += [box((-0.2, 12.0 * k, length, 12.0 * k + 0.2), 0.0, 2.8) for k in range(1, corridors)]
    for low in (12.0 * k for k in range(corridors)):
        parts += _wall_of_doors(low + 5.0, length) + _wall_of_doors(low + 7.0, length)
        sides = [(4.0 * k - 0.2, 4.0 * k) for k in range(25)]
        parts += [box((x1, y, x2, y + 4.8), 0.0, 2.8) for x1, x2 in sides for y in (low + 0.2, low + 7.2)]
    mesh = trimesh.util.concatenate(parts)
    mesh.export(path)
    return len(mesh.faces)


def _wall_of_doors(y: float, length: float) -> list[trimesh.Trimesh]:
    """A wall along x with a door of 0.9 m every four metres."""
    starts = [-0.2, *np.arange(1.9, length, 4.0)]
    ends = [*np.arange(1.0, length, 4.0), length]
    parts = [box((x1, y, x2, y + 0.2), 0.0, 2.8) for x1, x2 in zip(starts, ends, strict=True)]
    return parts + [box((x, y, x + 0.9, y + 0.2), 2.1, 2.8) for x in ends[:-1]]


def house_of_many_faces(path: Path, faces: int) -> int:
    """Write a house of six rooms whose walls are cut into small faces, as a scan's are; return how many it has."""
    boxes = [box((x, 0.0, x + 0.2, 8.2), 0.0, 2.7) for x in (0.0, 4.0, 8.0, 12.0)]
    for y in (0.0, 4.0, 8.0):
        for x in (0.2, 4.2, 8.2):
            if y != 4.0:
                boxes.append(box((x, y, x + 3.8, y + 0.2), 0.0, 2.7))
                continue
            boxes += [box((x, y, x + 2.0, y + 0.2), 0.0, 2.7), box((x + 2.9, y, x + 3.8, y + 0.2), 0.0, 2.7)]
            boxes.append(box((x + 2.0, y, x + 2.9, y + 0.2), 2.1, 2.7))
    mesh = trimesh.util.concatenate(boxes)
    while 4 * len(mesh.faces) <= faces:
        mesh = mesh.subdivide()
    mesh = mesh.subdivide(face_index=np.arange((faces - len(mesh.faces)) // 3))
    mesh.export(path)
    return len(mesh.faces)


def _places() -> Iterator[tuple[float, float]]:
    """Where buildings stand: a corner of each, row by row."""
    for row in range(40):
        for column in range(12):
            yield 28.0 * column, 26.0 * row


def _building(rng: np.random.Generator, place: tuple[float, float], *, hollow: bool) -> list[trimesh.Trimesh]:
    x1, y1 = np.add(place, rng.uniform(0.0, 4.0, 2))
    x2, y2 = x1 + rng.uniform(10.0, 20.0), y1 + rng.uniform(9.0, 16.0)
    storeys = int(rng.integers(2, 7))
    top = storeys * STOREY_M
    corners = [(x1, y1), (x2, y1), (x2, y2), (x1, y2)]
    parts = [sheet(corners[k - 1], corners[k], 0.0, top) for k in range(4)]
    if hollow:
        inner = [(x1 + 0.3, y1 + 0.3), (x2 - 0.3, y1 + 0.3), (x2 - 0.3, y2 - 0.3), (x1 + 0.3, y2 - 0.3)]
        parts += [sheet(inner[k], inner[k - 1], 0.0, top) for k in range(4)]
    parts.append(box((x1 - 0.4, y1 - 0.4, x2 + 0.4, y2 + 0.4), top, top + 0.3))
    for storey in range(storeys):
        sill = storey * STOREY_M + 0.9
        for x in np.arange(x1 + 1.0, x2 - 1.5, 2.2):
            parts += [_window(x, y, sill, along_x=True) for y in (y1, y2)]
        for y in np.arange(y1 + 1.0, y2 - 1.5, 2.2):
            parts += [_window(y, x, sill, along_x=False) for x in (x1, x2)]
    return parts


def _window(at: float, face: float, sill: float, *, along_x: bool) -> trimesh.Trimesh:
    """A frame that stands proud of the wall on both sides."""
    along, across = (at, at + WINDOW_M[0]), (face - 0.08, face + 0.08)
    (x1, x2), (y1, y2) = (along, across) if along_x else (across, along)
    return box((x1, y1, x2, y2), sill, sill + WINDOW_M[1])
