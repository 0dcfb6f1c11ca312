"""Parse a RoomPlan capture (``Scan``: boxes and floors) from JSON, or from the USDZ file that contains the same data.

Meshes of any other USDZ file are loaded here, too (``load_usdz_pieces``).

R1  A surface or an object is a box of its dimensions about its transform (16 numbers, column by column).
R2  A structure holds its rooms, and each of these what was found in it; what the structure repeats is left out.
R3  A floor is the ring of its corners, which are in its own frame, else its box.
"""

from __future__ import annotations

import math
import posixpath
import re
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import shapely
from shapely import Polygon

from houseexpo.errors import MissingDependencyError, install_command
from pipeline.geometry.areas import drop_thin_parts, polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import polygon_from_ring
from pipeline.sources.files import archive_members, check_lengths, decode_document, quiet_usd, usd_fault
from pipeline.sources.meshes.scene import NamedPiece, PartNames, transform_triangles, triangulate_polygons
from pipeline.sources.tolerances import (
    DRAWN_SHEET_M,
    FILE_GRID_M,
    LARGEST_BYTES,
    MOST_FILES,
    NARROWEST_DOOR_M,
    ROOMPLAN_WALL_M,
    UPRIGHT_M2,
)

_ADVICE = "export the scan again"


class _Surface(msgspec.Struct, frozen=True, rename="camel"):
    dimensions: list[float]
    transform: list[float]
    category: dict[str, Any] | str | None = None
    polygon_corners: list[list[float]] | None = None


class _Section(msgspec.Struct, frozen=True):
    label: str
    center: list[float]


class _Room(msgspec.Struct, frozen=True):
    walls: list[_Surface] = []
    doors: list[_Surface] = []
    openings: list[_Surface] = []
    windows: list[_Surface] = []
    objects: list[_Surface] = []
    floors: list[_Surface] = []
    sections: list[_Section] = []


class _Structure(_Room, frozen=True):
    rooms: list[_Room] = []


@dataclass(frozen=True, eq=False)
class UprightBox:
    """A box that stands upright: its plan shape, wider than deep for surfaces, and its heights; ``word`` names it."""

    word: str
    shape: Polygon
    low_m: float
    high_m: float


@dataclass(frozen=True, eq=False)
class Floor:
    """A floor: its plan shape and its height."""

    shape: Polygon
    height_m: float


@dataclass(frozen=True)
class LabelledSection:
    """A part of a home that RoomPlan gave a label to, by its middle."""

    label: str
    at: tuple[float, float]
    height_m: float


@dataclass(frozen=True, eq=False)
class Scan:
    """All that was found."""

    walls: tuple[UprightBox, ...] = ()
    doors: tuple[UprightBox, ...] = ()
    openings: tuple[UprightBox, ...] = ()
    objects: tuple[UprightBox, ...] = ()
    floors: tuple[Floor, ...] = ()
    sections: tuple[LabelledSection, ...] = ()
    windows: tuple[UprightBox, ...] = ()


_DECODER = msgspec.json.Decoder(_Structure)


def parse_scan(data: bytes, name: str) -> Scan:
    """Read the exported JSON; raises Rejection (EMPTY, UNREADABLE, NOT_FINITE, BAD_UNITS)."""
    structure = decode_document(_DECODER, data, name, _ADVICE)
    rooms: list[_Room] = [*structure.rooms] or [structure]  # R2
    return Scan(
        walls=tuple(_things((each for room in rooms for each in room.walls), name)),
        doors=tuple(_things((each for room in rooms for each in room.doors), name)),
        openings=tuple(_things((each for room in rooms for each in room.openings), name)),
        objects=tuple(_things((each for room in rooms for each in room.objects), name)),
        floors=tuple(floor for room in rooms for each in room.floors if (floor := _floor(each, name)) is not None),
        sections=tuple(_section(each, name) for room in rooms for each in room.sections),
        windows=tuple(_things((each for room in rooms for each in room.windows), name)),
    )


def upright_box(word: str, points: np.ndarray) -> UprightBox | None:
    """Return the upright box around points (n, 3) of plan x, y and height, or None if they have no extent in plan."""
    around = shapely.minimum_rotated_rectangle(shapely.MultiPoint(points[:, :2]))
    if around.length < DRAWN_SHEET_M:
        return None
    if around.area < DRAWN_SHEET_M * around.length / 2:
        line = shapely.LineString(_farthest(points[:, :2]))
        around = line.buffer(DRAWN_SHEET_M / 2, cap_style="flat")
    return UprightBox(word, around, float(points[:, 2].min()), float(points[:, 2].max()))


def _farthest(points: np.ndarray) -> np.ndarray:
    """Return the two ends of points that lie on a line."""
    first = points[int(np.argmax(np.hypot(*(points - points[0]).T)))]
    return np.stack([first, points[int(np.argmax(np.hypot(*(points - first).T)))]])


def _things(surfaces: Iterable[_Surface], name: str) -> Iterable[UprightBox]:
    """Yield each surface or object as a box of its dimensions about its transform."""
    for surface in surfaces:
        matrix, size = _place(surface, name)
        signs = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
        thing = upright_box(_word(surface), _in_plan(signs * size, matrix))
        if thing is not None:
            yield thing


def _floor(surface: _Surface, name: str) -> Floor | None:
    """Return the ring of a floor's corners, else its box."""
    matrix, size = _place(surface, name)
    corners = [corner for corner in surface.polygon_corners or [] if len(corner) == 3]
    if len(corners) < 3:
        corners = [[x * size[0], y * size[1], 0.0] for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    points = _in_plan(np.array(corners, np.float64), matrix)
    check_lengths(points, name, _ADVICE)
    shape = polygon_from_ring(points[:, :2])
    return None if shape is None else Floor(shape, float(np.median(points[:, 2])))


def _section(section: _Section, name: str) -> LabelledSection:
    if len(section.center) != 3:
        raise Rejection("source", Reason.UNREADABLE, f"{name}: a section's center has not three numbers", _ADVICE)
    x, height, z = section.center
    check_lengths([x, height, z], name, _ADVICE)
    return LabelledSection(section.label, (x, -z), height)


def _place(surface: _Surface, name: str) -> tuple[np.ndarray, np.ndarray]:
    if len(surface.dimensions) != 3 or len(surface.transform) != 16:
        detail = f"{name}: expected 3 dimensions and a transform of 16 numbers"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
    matrix = np.array(surface.transform, np.float64).reshape(4, 4).T
    size = np.array(surface.dimensions, np.float64)
    check_lengths([*surface.transform, *surface.dimensions], name, _ADVICE)
    return matrix, size


def _in_plan(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Points of a thing's own frame to plan x, y and height."""
    x, y, z = (points @ matrix[:3, :3].T + matrix[:3, 3]).T
    return np.column_stack([x, -z, y])


def _word(surface: _Surface) -> str:
    """A category is a word, or an object with the word as its only key."""
    if isinstance(surface.category, str):
        return surface.category
    return next(iter(surface.category), "") if surface.category else ""


# USDZ: RoomPlan's scans, in which the meshes' names say what each is, and other people's models, as plain meshes.
#
# R1  The names on the way to a mesh decide, the nearest first: Wall, Door, Opening, Window, Floor; what else is in the
#     scene is an object of its name. Windows are part of their wall.
# R2  All layers lie in the archive: a scene that names a file elsewhere is refused before it is put together.
# R3  Openings have no mesh: they are the holes of a wall's mesh in which no window is. With doors they are one hole.
# R4  Walls are bodies that stand outside of the surface that was seen, and floors go on under them: a room's floor is
#     what of it lies beside the walls.


# R5  RoomPlan exports a scan as meshes, or parametric: then its walls, doors, openings and objects are cubes.
# R6  What is below ``Section_grp`` are the middles of sections, and called by their labels.


_SECTIONS = "Section_grp"
_KINDS = ("wall", "door", "opening", "window", "floor")
_USDZ_ADVICE = "export the scan again"


def load_usdz(path: Path) -> Scan:
    """Read the meshes of a USDZ file.

    Raises
    ------
    Rejection
        Where it is no whole archive, names a file outside of it, or cannot be read.
    MissingDependencyError
        Where usd-core is not installed.
    """
    with _stage(path) as (stage, geometry):
        return _read(stage, geometry, path.name)


def usdz_up_and_unit(path: Path) -> tuple[str, float | None]:
    """Return the up axis of a USDZ file and metres in its unit, or None if it states none; raises as ``load_usdz``."""
    with _stage(path) as (stage, geometry):
        metres = geometry.GetStageMetersPerUnit(stage) if geometry.StageHasAuthoredMetersPerUnit(stage) else None
        return "z" if geometry.GetStageUpAxis(stage) == geometry.Tokens.z else "y", metres


def load_usdz_pieces(path: Path, max_faces: int) -> Iterator[NamedPiece]:
    """Yield the triangles of every mesh at its place, in the file's axes and unit; raises as ``load_usdz``."""
    with _stage(path) as (stage, geometry):
        cache, count = geometry.XformCache(), 0
        for prim in stage.Traverse():
            if not _is_body(geometry, prim):
                continue
            body = _body(geometry, prim)
            local, faces = body.points, triangulate_polygons(body.points, body.corners, body.counts)[0]
            count += len(faces)
            if count > max_faces:
                detail = f"{path.name} has more than {max_faces:,} faces"
                raise Rejection("source", Reason.TOO_LARGE, detail, "simplify the mesh, or leave its furniture out")
            matrix = np.array(cache.GetLocalToWorldTransform(prim), np.float64).T  # rows there, columns here
            vertices, faces = transform_triangles(local, faces, matrix)
            names = tuple(part for part in str(prim.GetPath()).split("/") if part)
            yield NamedPiece(PartNames(names[:-1], names[-1]), vertices, faces)


@dataclass(frozen=True, eq=False)
class _Body:
    """A mesh or a cube: points (n, 3), the corners of its faces one after the other, and how many each face has."""

    points: np.ndarray
    corners: np.ndarray
    counts: np.ndarray


_CUBE: Final = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_CUBE_CORNERS: Final = np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])


def _is_body(geometry: Any, prim: Any) -> bool:
    return bool(prim.IsA(geometry.Mesh) or prim.IsA(geometry.Cube))


def _body(geometry: Any, prim: Any) -> _Body:
    """Return a mesh or a cube in its own frame and unit; raise ValueError where its faces are damaged."""
    if prim.IsA(geometry.Cube):
        size = float(geometry.Cube(prim).GetSizeAttr().Get() or 2.0)
        return _Body(_CUBE * size, _CUBE_CORNERS, np.full(6, 4))
    mesh = geometry.Mesh(prim)
    points = np.array(mesh.GetPointsAttr().Get() or [], np.float64).reshape(-1, 3)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
    if counts.sum() != len(corners) or (len(corners) and not 0 <= corners.min() <= corners.max() < len(points)):
        raise ValueError(f"the faces of {prim.GetName()} name vertices that it does not have")
    return _Body(points, corners, counts)


@contextmanager
def _stage(path: Path) -> Iterator[tuple[Any, Any]]:
    """Open a file whose layers all lie in it, with the module that knows geometry; raises as ``load_usdz``."""
    quiet_usd()
    try:
        from pxr import Sdf, Tf, Usd, UsdGeom
    except ImportError:
        said = f"{path.name} needs usd-core, which is not installed: {install_command('scans')}"
        raise MissingDependencyError(said) from None
    _check_whole(path)
    try:
        _check_layers(Sdf, path, archive_members(path))
        stage = Usd.Stage.Open(str(path))
        stage.Reload()  # the library keeps what it has read under the same name
        yield stage, UsdGeom
    except (Tf.ErrorException, RuntimeError, ValueError, TypeError) as error:
        detail = f"{path.name} cannot be read as USD{usd_fault(error)}"
        raise Rejection("source", Reason.UNREADABLE, detail, _USDZ_ADVICE) from None


def _check_whole(path: Path) -> None:
    """The library reads a damaged archive as it comes; this one is compared with its own checksums first."""
    try:
        with zipfile.ZipFile(path) as archive:
            total = sum(info.file_size for info in archive.infolist())
            stored = all(info.compress_type == zipfile.ZIP_STORED for info in archive.infolist())
            broken = archive.testzip() if stored and total <= LARGEST_BYTES else None
    except (OSError, zipfile.BadZipFile, EOFError, RuntimeError, ValueError) as error:
        detail = f"{path.name} is damaged: {str(error)[:120]}"
        raise Rejection("source", Reason.UNREADABLE, detail, _USDZ_ADVICE) from None
    if total > LARGEST_BYTES:  # the largest text of a plan or a scene that is read: 256 MB
        raise Rejection("source", Reason.TOO_LARGE, f"{path.name} holds {total >> 20} MB", "leave its textures out")
    if not stored or broken is not None:
        what = f"{broken} is damaged" if broken else "its members are packed, USDZ has them stored"
        raise Rejection("source", Reason.UNREADABLE, f"{path.name}: {what}", _USDZ_ADVICE)


def _check_layers(sdf: Any, path: Path, names: tuple[str, ...]) -> None:
    """Raise Rejection if a layer refers to one that is not in the archive."""
    layers = [name for name in names if name.lower().endswith((".usd", ".usda", ".usdc"))]
    for name in layers:
        layer = sdf.Layer.OpenAsAnonymous(f"{path}[{name}]")
        for asset in layer.GetCompositionAssetDependencies():
            inner = posixpath.normpath(posixpath.join(posixpath.dirname(name), asset))
            if inner not in layers:
                told = f"refers to {posixpath.basename(asset)[:80]!r}, which is not in the archive"
                detail = f"{path.name}: {name} {told}"
                raise Rejection("source", Reason.UNREADABLE, detail, "pack all layers into the USDZ")


def _read(stage: Any, geometry: Any, name: str) -> Scan:
    metres = float(geometry.GetStageMetersPerUnit(stage))
    z_up = geometry.GetStageUpAxis(stage) == geometry.Tokens.z
    found: dict[str, list[UprightBox]] = {kind: [] for kind in (*_KINDS, "object")}
    floors: list[Floor] = []
    holes: list[UprightBox] = []
    cache = geometry.XformCache()
    for count, prim in enumerate(prim for prim in stage.Traverse() if _is_body(geometry, prim)):
        if count >= MOST_FILES:
            raise Rejection("source", Reason.TOO_LARGE, f"{name} has more than {MOST_FILES:,} meshes", _USDZ_ADVICE)
        body = _body(geometry, prim)
        matrix = np.array(cache.GetLocalToWorldTransform(prim), np.float64)
        x, y, z = ((body.points @ matrix[:3, :3] + matrix[3, :3]) * metres).T
        points = np.column_stack([x, y, z] if z_up else [x, -z, y])
        if len(points) < 3:
            continue
        check_lengths(points, f"{name}: {prim.GetName()}", _USDZ_ADVICE)
        kind, word = _kind(str(prim.GetPath()))
        if kind == "floor":
            floors += _floors(replace(body, points=points))
        elif (thing := upright_box(word, points)) is not None:
            found[kind].append(thing)
            if kind == "wall":
                holes += _holes(thing, points, triangulate_polygons(points, body.corners, body.counts)[0])
    walls, doors, gaps, windows = (tuple(found[kind]) for kind in ("wall", "door", "opening", "window"))
    glazed = shapely.union_all([window.shape for window in windows])
    gaps += tuple(hole for hole in holes if shapely.intersection(hole.shape, glazed).length < hole.shape.length / 2)
    sections = _sections(stage, cache, metres, z_up)
    things, floors = tuple(found["object"]), list(_beside_walls(floors, walls))
    return Scan(walls, doors, gaps, things, tuple(floors), tuple(sections), windows)


def _sections(stage: Any, cache: Any, metres: float, z_up: bool) -> Iterator[LabelledSection]:
    """Yield the sections, which are empty places below a prim of their own."""
    for prim in stage.Traverse():
        if prim.GetParent().GetName() == _SECTIONS:
            x, y, z = (float(each) * metres for each in cache.GetLocalToWorldTransform(prim).ExtractTranslation())
            if all(map(math.isfinite, (x, y, z))):
                word = re.sub(r"\d+$", "", prim.GetName())
                yield LabelledSection(word, (x, y) if z_up else (x, -z), z if z_up else y)


def _holes(wall: UprightBox, points: np.ndarray, faces: np.ndarray) -> list[UprightBox]:
    """The holes of a wall's mesh, points (n, 3) and triangles (m, 3), each through all of the wall."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(wall.shape))[:4]
    sides = np.roll(corners, -1, axis=0) - corners
    k = int(np.argmax(np.hypot(*sides.T)))
    first, along, across = corners[k], sides[k] / np.hypot(*sides[k]), sides[(k + 1) % 4]
    seen = np.column_stack([(points[:, :2] - first) @ along, points[:, 2]])[faces]
    legs = seen[:, 1:] - seen[:, :1]
    broad = np.abs(legs[:, 0, 0] * legs[:, 1, 1] - legs[:, 0, 1] * legs[:, 1, 0]) > UPRIGHT_M2
    solid = shapely.union_all(shapely.polygons(seen[broad]), grid_size=FILE_GRID_M)
    length = float(np.hypot(*sides[k]))
    found = []
    free = shapely.difference(shapely.box(0.0, wall.low_m, length, wall.high_m), solid)
    for part in polygons_of(drop_thin_parts(free, DRAWN_SHEET_M)):
        start, low, end, high = part.bounds
        if end - start >= NARROWEST_DOOR_M:
            a, b = first + start * along, first + end * along
            found.append(UprightBox("opening", Polygon([a, b, b + across, a + across]), low, high))
    return found


def _beside_walls(floors: list[Floor], walls: tuple[UprightBox, ...]) -> Iterator[Floor]:
    """Yield what of each floor lies beside the bodies of walls; walls that are sheets have nothing under them."""
    bodies = [wall.shape for wall in walls if _depth(wall.shape) > ROOMPLAN_WALL_M]
    if not bodies:
        yield from floors
        return
    depth, covered = max(_depth(shape) for shape in bodies), shapely.union_all(bodies)
    for floor in floors:
        for part in polygons_of(drop_thin_parts(shapely.difference(floor.shape, covered), depth + DRAWN_SHEET_M)):
            yield Floor(part, floor.height_m)


def _depth(shape: Polygon) -> float:
    """Return the short side of the rectangle about a wall."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shape))
    return float(np.hypot(*np.diff(corners[:3], axis=0).T).min())


def _kind(path: str) -> tuple[str, str]:
    """Return what a prim is by its path: the kind of surface or object, and its name."""
    parts = [re.sub(r"[\d_]+(grp)?$", "", part) for part in reversed(path.split("/")) if part]
    for part in parts:
        for kind in _KINDS:
            if part.lower().startswith(kind):
                return kind, part
    return "object", parts[0]


def _floors(body: _Body) -> list[Floor]:
    """Return the plan area of a floor's faces."""
    rings = np.split(body.points[body.corners][:, :2], np.cumsum(body.counts)[:-1])
    faces = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings if len(ring) > 2]
    area = shapely.union_all([face for face in faces if face.area > UPRIGHT_M2], grid_size=FILE_GRID_M)
    return [Floor(part, float(np.median(body.points[:, 2]))) for part in polygons_of(area)]
