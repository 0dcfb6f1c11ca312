"""Read a 3D-FRONT scene from its JSON file: yield its levels with walls, rooms, doors and furniture.

Frame: y is up and right-handed in the file, so that x = X and y = -Z show the house from above as it is; z = Y.

R1  A room is the area of its Floor meshes. Its walls are sheets, one for each side; the walls' bodies are what lies
    between the floors (``around``), and the sheets only say how high they stand.
R2  A Door is a door and a Hole an opening, where it reaches from the floor to above a head; the meshes of one that
    belongs to two rooms are one. Windows are none.
R3  Floors more than STOREYS_APART_M apart in height are levels of their own.
R4  Furniture is a box where the file has its size.

**Reading**: a scene becomes checked values in metres, its own axes, y up. Keys that plans do not need are passed
over. A mesh, a piece of furniture or its place that cannot be read is left out, and said; the scene goes on without
it.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon

from houseexpo.plan import Frame
from pipeline.geometry.areas import polygons_of
from pipeline.geometry.prisms import make_prisms
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import (
    Hole,
    deepen_to_wall_faces,
    merge_parallel_holes,
    passage_openings,
    unite_rooms,
    wall_mesh,
    walls_around_floors,
)
from pipeline.sources.files import LeftOutParts, check_file, check_lengths, decode_document, input_from_file, level_id
from pipeline.sources.roles import labels_for
from pipeline.sources.tolerances import (
    DRAWN_SHEET_M,
    FILE_GRID_M,
    LARGEST_BYTES,
    STOREYS_APART_M,
    UPRIGHT_M2,
    WALL_HEIGHT_M,
)
from pipeline.tolerances import HEAD_M
from pipeline.values import Input, Level, Mesh, SourceObject, SourceRoom

FLOOR = "Floor"
"""The type of the meshes that a plan cannot do without."""

_ADVICE = "copy it again from the data set"
_Numbers = list[float]
_Part = TypeVar("_Part")


class _Mesh(msgspec.Struct, frozen=True):
    uid: str
    type: str = ""
    xyz: _Numbers = []
    faces: list[int] = []


class _Model(msgspec.Struct, frozen=True):
    uid: str
    size: Any = None
    bbox: Any = None
    category: str | None = None
    title: str | None = None


class _Child(msgspec.Struct, frozen=True):
    ref: str
    pos: Any = None
    rot: Any = None
    scale: Any = None


class _Room(msgspec.Struct, frozen=True):
    type: str = ""
    children: list[msgspec.Raw] = []


class _Content(msgspec.Struct, frozen=True):
    room: list[_Room] = []


class _Scene(msgspec.Struct, frozen=True):
    mesh: list[msgspec.Raw]
    scene: _Content
    furniture: Any = None


@dataclass(frozen=True, eq=False)
class RoomSurface:
    """A mesh of a room, and what it is: WallInner, Floor, Door, ..."""

    kind: str
    mesh: Mesh


@dataclass(frozen=True)
class PlacedFurniture:
    """A piece of furniture: a box of a size (X, Y, Z) on the point ``at``, turned about the upright axis."""

    words: str
    at: tuple[float, float, float]
    size: tuple[float, float, float]
    turn_rad: float


@dataclass(frozen=True, eq=False)
class SceneRoom:
    """A room with the surfaces and the furniture that belong to it."""

    name: str
    surfaces: tuple[RoomSurface, ...]
    furniture: tuple[PlacedFurniture, ...]


_DECODER = msgspec.json.Decoder(_Scene)
_PARTS: dict[type[Any], msgspec.json.Decoder[Any]] = {
    kind: msgspec.json.Decoder(kind) for kind in (_Mesh, _Child, _Model)
}


def parse_scene(data: bytes, name: str, left_out: LeftOutParts) -> tuple[SceneRoom, ...]:
    """Read the rooms of a scene; raise Rejection if it has none (EMPTY, UNREADABLE) or a floor is damaged.

    Surfaces that no room refers to come in a last room without a name.
    """
    scene = decode_document(_DECODER, data, name, _ADVICE)
    surfaces: dict[str, RoomSurface] = {}
    for mesh in _parts(scene.mesh, _Mesh, f"{name}: mesh", left_out):
        with nullcontext() if mesh.type == FLOOR else left_out.part():
            if mesh.xyz:
                surfaces[mesh.uid] = RoomSurface(mesh.type, _triangles(mesh, name))
    listed = scene.furniture if isinstance(scene.furniture, list) else []
    models = {model.uid: model for model in _parts(map(msgspec.json.encode, listed), _Model, "furniture", left_out)}
    rooms, used = [], set()
    for room in scene.scene.room:
        children = list(_parts(room.children, _Child, f"{name}: child of {room.type[:40]}", left_out))
        refs = [child.ref for child in children if child.ref in surfaces and child.ref not in used]
        used.update(refs)
        things = []
        for child in children:
            with left_out.part():
                thing = _place(models.get(child.ref), child, name)
                things += [thing] if thing else []
        rooms.append(SceneRoom(room.type, tuple(surfaces[ref] for ref in dict.fromkeys(refs)), tuple(things)))
    loose = tuple(surface for uid, surface in surfaces.items() if uid not in used)
    return (*rooms, SceneRoom("", loose, ()))


def _parts(
    found: Iterable[bytes | msgspec.Raw], kind: type[_Part], what: str, left_out: LeftOutParts
) -> Iterator[_Part]:
    """Yield the parts that can be read."""
    for number, part in enumerate(found):
        try:
            yield _PARTS[kind].decode(part)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            left_out.add(f"{what} {number}: {error}")


def _triangles(mesh: _Mesh, name: str) -> Mesh:
    what = f"{name}: mesh {mesh.uid[:60]}"
    if len(mesh.xyz) % 3 or len(mesh.faces) % 3:
        raise Rejection("source", Reason.UNREADABLE, f"{what}: expected triples in xyz and faces", _ADVICE)
    vertices = np.array(mesh.xyz, np.float64).reshape(-1, 3)
    check_lengths(vertices, what, _ADVICE)
    return Mesh(vertices, _faces(mesh, len(vertices), what))


def _faces(mesh: _Mesh, count: int, what: str) -> npt.NDArray[np.int64]:
    if any(not 0 <= corner < count for corner in mesh.faces):
        detail = f"{what}: a face names a vertex that is not one of its {count:,}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
    return np.array(mesh.faces, np.int64).reshape(-1, 3)


def _place(model: _Model | None, child: _Child, name: str) -> PlacedFurniture | None:
    """Return a piece of furniture where its size is known; its place is the middle of its underside."""
    if model is None:
        return None
    what = f"{name}: furniture {model.uid[:60]}"
    size, place = _numbers(model.size, 3) or _numbers(model.bbox, 3), _numbers(child.pos, 3)
    if size is None or place is None:
        return None
    scale = _numbers(child.scale, 3) or [1.0, 1.0, 1.0]
    x, y, z, w = _numbers(child.rot, 4) or (0.0, 0.0, 0.0, 1.0)
    check_lengths([*size, *place, *scale, x, y, z, w], what, _ADVICE)
    turn = math.atan2(2 * (w * y + x * z), 1 - 2 * (y * y + x * x))
    sizes = [abs(a * b) for a, b in zip(size, scale, strict=True)]
    words = model.category or model.title or ""
    return PlacedFurniture(words, (place[0], place[1], place[2]), (sizes[0], sizes[1], sizes[2]), turn)


def _numbers(value: Any, count: int) -> list[float] | None:
    """Return so many numbers, or None if a file has something else there, such as corners for a size."""
    if not isinstance(value, list) or len(value) != count:
        return None
    return [float(each) for each in value] if all(isinstance(each, int | float) for each in value) else None


NAMES = {
    "LivingDiningRoom": ("Living_Room", "Dining_Room"),
    "KidsRoom": ("Child_Room",),
    "ElderlyRoom": ("Bedroom",),
    "NannyRoom": ("Bedroom",),
    "Aisle": ("Hallway",),
    "CloakRoom": ("Wardrobe",),
    "EquipmentRoom": ("Boiler_room",),
}


def find(path: str, **options: str) -> Iterator[Input]:
    """List one scene."""
    yield input_from_file(path, "front3d", options)


def read(item: Input) -> Iterator[Level]:
    """Yield the scene's levels, lowest first; raise Rejection if it cannot be read or has no floor."""
    path = Path(item.path)
    name = dict(item.options).get("file", path.name)
    check_file(path)
    data = path.read_bytes() if path.stat().st_size < LARGEST_BYTES else b""
    left_out = LeftOutParts()
    rooms = parse_scene(data, path.name, left_out)
    floors = [found for room in rooms if (found := _floor(room)) is not None]
    if not floors:
        detail = f"{name}: expected a mesh of type Floor in a room, found none"
        detail += f"; left out: {left_out.note}" if left_out else ""
        raise Rejection("source", Reason.NO_LEVEL, detail, "leave the scene out")
    provenance = {"source": "3d-front", "file": name, "sha256": hashlib.sha256(data).hexdigest()} | left_out.provenance
    levels = _levels(floors)
    for number, level in enumerate(levels):
        above = levels[number + 1][0].height_m if number + 1 < len(levels) else np.inf
        made = _level(level, rooms, above, provenance)
        yield replace(made, id=level_id(item.id, number, len(levels)), frame=replace(made.frame, level=number))


@dataclass(frozen=True, eq=False)
class _Floor:
    """A room's floor in plan, and its height."""

    room: SceneRoom
    shape: Polygon
    height_m: float


def _floor(room: SceneRoom) -> _Floor | None:
    """Return the area of a room's meshes of type Floor, or None without one."""
    meshes = [surface.mesh for surface in room.surfaces if surface.kind == "Floor" and len(surface.mesh.faces)]
    if not meshes:
        return None
    parts = polygons_of(shapely.union_all([_plan_area(mesh) for mesh in meshes], grid_size=FILE_GRID_M))
    height = float(np.median(np.concatenate([mesh.vertices[:, 1] for mesh in meshes])))
    return _Floor(room, parts[0], height) if parts else None


def _plan_area(mesh: Mesh) -> shapely.Geometry:
    """Return the plan area of a mesh."""
    triangles = shapely.polygons(_in_plan(mesh.vertices)[mesh.faces])
    return shapely.union_all(triangles[shapely.area(triangles) > UPRIGHT_M2], grid_size=FILE_GRID_M)


def _in_plan(points: np.ndarray) -> np.ndarray:
    """(X, Y, Z) to the plan's (x, y)."""
    return np.column_stack([points[:, 0], -points[:, 2]])


def _levels(floors: Sequence[_Floor]) -> list[list[_Floor]]:
    """Return the floors by level, lowest first, the largest of each level first."""
    levels: list[list[_Floor]] = []
    for floor in sorted(floors, key=lambda each: each.height_m):
        if levels and floor.height_m - levels[-1][0].height_m < STOREYS_APART_M:
            levels[-1].append(floor)
        else:
            levels.append([floor])
    return [sorted(level, key=lambda each: -each.shape.area) for level in levels]


def _level(floors: list[_Floor], rooms: Sequence[SceneRoom], above: float, provenance: dict[str, str]) -> Level:
    """Return a level, still without its own id and number; ``above`` is the height of the next one."""
    height = floors[0].height_m
    top = _top(rooms, height, above)
    walls = walls_around_floors([floor.shape for floor in floors], top)
    holes = [hole for each in _holes(rooms, height, top) if (hole := deepen_to_wall_faces(each, walls)) is not None]
    named = tuple(_room(floor) for floor in floors)
    things = [thing for floor in floors for thing in floor.room.furniture]
    return Level(
        id="",
        walls=wall_mesh(walls, holes),
        ceiling_m=top,
        frame=Frame(((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)), "y", height, 0),
        floor=unite_rooms(floor.shape for floor in floors),
        furniture=tuple(_object(thing, height) for thing in things),
        named_openings=True,
        only_walls=True,
        rooms=named,
        room_count=len(named),
        openings=passage_openings(holes),
        n_objects=len(things),
        provenance=provenance,
    )


def _top(rooms: Sequence[SceneRoom], height: float, above: float) -> float:
    """Return how high the walls stand: the median over the sheets that stand on this floor."""
    sheets = [surface.mesh for room in rooms for surface in room.surfaces if surface.kind.startswith("WallInner")]
    tops = [float(mesh.vertices[:, 1].max()) - height for mesh in sheets if abs(mesh.vertices[:, 1].min() - height) < 1]
    top = float(np.median([each for each in tops if each > HEAD_M] or [WALL_HEIGHT_M]))
    return min(top, above - height)


def _holes(rooms: Sequence[SceneRoom], height: float, top: float) -> list[Hole]:
    """Return the doors and holes that reach from the floor to above a person's head, and the windows."""
    found: list[Hole] = []
    for surface in (surface for room in rooms for surface in room.surfaces if surface.kind in {"Door", "Hole"}):
        low, high = (float(end(surface.mesh.vertices[:, 1])) - height for end in (np.min, np.max))
        shape = shapely.convex_hull(shapely.MultiPoint(_in_plan(surface.mesh.vertices)))
        if isinstance(shape, LineString):
            shape = shape.buffer(DRAWN_SHEET_M / 2, cap_style="flat")
        if isinstance(shape, Polygon) and low < top and high > 0:
            found.append(Hole(shape, low, high, surface.kind == "Door"))
    return merge_parallel_holes(found)


def _room(floor: _Floor) -> SourceRoom:
    word = floor.room.name
    words = (word,) if word and word.lower() != "none" else ()
    return SourceRoom(words, NAMES.get(word) or labels_for(words), floor.shape)


def _object(thing: PlacedFurniture, height: float) -> SourceObject:
    """Return furniture as a box; a turn about the upright axis is the same turn in the plan, counter-clockwise."""
    across, deep = thing.size[0] / 2, thing.size[2] / 2
    cos, sin = np.cos(thing.turn_rad), np.sin(thing.turn_rad)
    at = np.array([thing.at[0], -thing.at[2]])
    corners = np.array([(-across, -deep), (across, -deep), (across, deep), (-across, deep)])
    shape = Polygon(at + corners @ np.array([[cos, sin], [-sin, cos]]))
    bottom = thing.at[1] - height
    return SourceObject((thing.words,), make_prisms(shape, bottom, bottom + thing.size[1]))
