"""Read a SUNCG root folder (house/, room/, object/): list its houses, and yield every valid level of each.

Frame of a level: x = X and y = Z of the scene, as published (seen from above that is mirrored), z = Y less the foot of
the level's wall meshes; the floor slab's top lies above the door sills, so heights count from the walls. Only wall
files are cut; floor files serve the layout rules; objects are read where furniture is asked for.

``house.json`` is read as checked values.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.errors import ConfigError
from houseexpo.files import without_mark
from houseexpo.plan import Frame
from houseexpo.plan.room_labels import canonical
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import displayable_name, record_file
from pipeline.sources.meshes import obj
from pipeline.sources.tolerances import FAR_FROM_ORIGIN_M, LONGEST_LENGTH_M, TINY
from pipeline.tolerances import HAIR_M
from pipeline.values import Input, Level, Mesh, RejectedLevel, SourceObject, SourceRoom

_ADVICE = "copy it again from the data set"
_NULL = msgspec.Raw(b"null")
_T = TypeVar("_T")


class Bounds(msgspec.Struct, frozen=True):
    """Scene axes (X, Y, Z), scene units."""

    min: tuple[float, float, float]
    max: tuple[float, float, float]


class SceneNode(msgspec.Struct, frozen=True, rename="camel"):
    """A node of a level; keys that plans do not need are passed over. Flags are 0 or 1 in the file.

    ``bbox`` and ``transform`` stay undecoded until they are asked for: most belong to furniture, which most builds
    never look at, and a node that is not valid may hold anything there.
    """

    type: str
    valid: int = 1
    model_id: str = ""
    room_types: list[str] | None = None
    hide_walls: int = 0
    hide_floor: int = 0
    state: int = 0
    bbox: msgspec.Raw = _NULL
    transform: msgspec.Raw = _NULL

    def bounds(self) -> Bounds | None:
        """Return the node's box, or None if it has none; raise Rejection if it is malformed."""
        return _decode(_BOUNDS, bytes(self.bbox), f"bbox of {self.type} {self.model_id}")

    def matrix(self) -> list[float] | None:
        """Return the 16 numbers of ``transform``, column by column, or None if the key is missing."""
        return _decode(_MATRIX, bytes(self.transform), f"transform of {self.type} {self.model_id}")


class HouseLevel(msgspec.Struct, frozen=True):
    """One level."""

    nodes: list[SceneNode]
    valid: int = 1


class House(msgspec.Struct, frozen=True, rename="camel"):
    """One scene."""

    levels: list[HouseLevel]
    scale_to_meters: float = 1.0
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    front: tuple[float, float, float] = (0.0, 0.0, 1.0)


_HOUSE = msgspec.json.Decoder(House, strict=False)  # not strict: flags are written 1, true or "1"
_BOUNDS: msgspec.json.Decoder[Bounds | None] = msgspec.json.Decoder(Bounds | None)
_MATRIX: msgspec.json.Decoder[list[float] | None] = msgspec.json.Decoder(
    Annotated[list[float], msgspec.Meta(min_length=16, max_length=16)] | None
)


def parse_house(data: bytes, name: str) -> House:
    """Read ``house.json``; raises Rejection (stage "source") where it is empty, no JSON or not a SUNCG house."""
    if not data.strip():
        raise Rejection("source", Reason.EMPTY, f"{name} is empty", _ADVICE)
    house = _decode(_HOUSE, data, name)
    if not math.isfinite(house.scale_to_meters) or house.scale_to_meters <= 0:
        detail = f"{name}: scaleToMeters is {house.scale_to_meters}, expected a positive number"
        raise Rejection("source", Reason.BAD_UNITS, detail, _ADVICE)
    if house.up != (0.0, 1.0, 0.0) or house.front != (0.0, 0.0, 1.0):  # other axes would mean another plan
        detail = f"{name}: expected up [0, 1, 0] and front [0, 0, 1], found {list(house.up)} and {list(house.front)}"
        raise Rejection("source", Reason.UNREADABLE, detail, "turn the scene to SUNCG's axes")
    return house


def _decode(decoder: msgspec.json.Decoder[_T], data: bytes, name: str) -> _T:
    try:
        return decoder.decode(without_mark(data))
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise Rejection("source", Reason.UNREADABLE, f"{name}: {error}", _ADVICE) from None


# Door leaves stand open or shut in their holes: as furniture they would block what Algorithm 1 opens.
_DOORS = frozenset(
    ["73", "122", "133", "214", "246", "247", "326", "327", "331", "361"]
    + [str(i) for i in (*range(756, 765), *range(768, 774))]
    + [f"s__{i}" for i in range(1762, 1774)]
)
_EMPTY = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


def find(path: str, **options: str) -> Iterator[Input]:
    """List the houses of a SUNCG root, sorted by sceneId; ``furniture="yes"`` asks for the objects too."""
    for option, value in options.items():
        if option != "furniture" or value not in {"yes", "no"}:
            raise ConfigError(f"SUNCG: {option}={value!r} is unknown; expected furniture=yes or furniture=no")
    folder = Path(path) / "house"
    if not folder.is_dir():
        raise Rejection("source", Reason.MISSING_FILE, "expected a folder 'house' in the SUNCG root", "give the root")
    settings = tuple(sorted(options.items()))
    for scene in sorted(entry.name for entry in folder.iterdir() if entry.is_dir()):
        yield Input(id=displayable_name(scene), reader="suncg", path=path, key=scene, options=settings)


def read(item: Input) -> Iterator[Level | RejectedLevel]:
    """Yield the valid levels of one house, lowest first; raise Rejection if ``house.json`` cannot be read."""
    name = f"house/{item.key}/house.json"
    files = _Files(Path(item.path))
    house = parse_house(files.read(name), name)
    scene = _Scene(item.key, house, files, dict(item.options).get("furniture") == "yes")
    valid = [index for index, level in enumerate(house.levels) if level.valid]
    if not valid:
        raise Rejection("source", Reason.EMPTY, f"{name} has no valid level", "leave the house out")
    for index in valid:
        level_id = item.id if index == valid[0] else f"{item.id}_L{index}"
        files.forget_all_but(name)
        try:
            yield _level(scene, index, level_id)
        except Rejection as rejection:
            yield RejectedLevel(level_id, rejection)


@dataclass(frozen=True)
class _Scene:
    """A house that is being read."""

    key: str
    house: House
    files: _Files
    furnished: bool


def _level(scene: _Scene, index: int, level_id: str) -> Level:
    """Read one level; raise Rejection if a file of it cannot be read."""
    scale, files, nodes = scene.house.scale_to_meters, scene.files, scene.house.levels[index].nodes
    rooms = [node for node in nodes if node.valid and node.type == "Room"]
    objects = [node for node in nodes if node.valid and node.type == "Object"]
    where = f"level {index} of house/{scene.key}"
    if not rooms and not objects:
        raise Rejection("source", Reason.EMPTY, f"{where} has neither rooms nor objects", "leave it out")
    stem = f"room/{scene.key}/"
    walls = _join_meshes([files.mesh(f"{stem}{node.model_id}w.obj") for node in rooms if not node.hide_walls], scale)
    floors = _join_meshes([files.mesh(f"{stem}{node.model_id}f.obj") for node in rooms if not node.hide_floor], scale)
    foot, origin = _datum(walls, floors, where)
    to_level = np.array([origin[0], foot, origin[1]])
    return Level(
        id=level_id,
        walls=_in_level(walls, to_level),
        ceiling_m=float(walls.vertices[:, 1].max() - foot) if len(walls.vertices) else 0.0,
        frame=Frame(((1.0, 0.0, float(origin[0])), (0.0, 1.0, float(origin[1]))), up="y", floor=foot, level=index),
        floor=_plan_area(_in_level(floors, to_level)),
        furniture=_furniture(objects, files, scale, to_level) if scene.furnished else (),
        sills=True,
        rooms=tuple(_room(node, scale, origin) for node in rooms),
        room_count=len(rooms),
        n_objects=len(objects),
        provenance=_provenance(scene),
    )


def _provenance(scene: _Scene) -> dict[str, str | int]:
    """Say what the level just read was made of; the hash covers every file of it that was opened."""
    nodes = [node for level in scene.house.levels if level.valid for node in level.nodes]
    return {
        "source": "suncg",
        "file": f"house/{scene.key}/house.json",
        "sha256": scene.files.digest(),
        "rooms_of_scene": sum(node.type == "Room" and node.valid != 0 for node in nodes),
    }


class _Files:
    """Reads files under a root and remembers their hashes, so that a level can say what it was made of."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._hashes: dict[str, bytes] = {}

    def read(self, name: str) -> bytes:
        try:
            data = (self._root / name).read_bytes()
        except FileNotFoundError:
            advice = "copy it again from the data set"
            raise Rejection("source", Reason.MISSING_FILE, f"expected {name}, found no such file", advice) from None
        except OSError as error:
            raise Rejection("source", Reason.UNREADABLE, f"{name}: {error.strerror}", "check its permissions") from None
        self._hashes[name] = hashlib.sha256(data).digest()
        return data

    def mesh(self, name: str) -> Mesh:
        data = self.read(name)
        material = obj.read_mtllib_name(data)
        if material is not None:
            record_file((self._root / name).with_name(material))
        if material is not None and not (self._root / name).with_name(material).exists():
            advice = "copy it again, or take the mtllib line out of the OBJ file"
            raise Rejection("source", Reason.MISSING_FILE, f"{name} names {material}, found no such file", advice)
        return obj.parse_plain_obj(data, name)

    def forget_all_but(self, name: str) -> None:
        self._hashes = {name: self._hashes[name]}

    def digest(self) -> str:
        """SHA-256 over names and contents, sorted by name."""
        return hashlib.sha256(b"".join(k.encode() + b"\0" + v for k, v in sorted(self._hashes.items()))).hexdigest()


def _join_meshes(meshes: list[Mesh], scale: float) -> Mesh:
    """Return one mesh, scaled to metres."""
    if not meshes:
        return _EMPTY
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]) * scale,
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
    )


def _datum(walls: Mesh, floors: Mesh, name: str) -> tuple[float, npt.NDArray[np.float64]]:
    """Return the level's foot (metres of Y) and the plan origin (X, Z): the scene's own, unless that is far away."""
    vertices = np.concatenate([walls.vertices, floors.vertices])
    if not len(vertices):
        return 0.0, np.zeros(2)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if (high - low).max() > LONGEST_LENGTH_M:
        detail = f"{name} is {(high - low).max():.0f} m long, expected {LONGEST_LENGTH_M:.0f} m at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, "check scaleToMeters in house.json")
    foot = float((walls.vertices if len(walls.vertices) else floors.vertices)[:, 1].min())
    centre = ((low + high) / 2)[[0, 2]]
    return foot, np.round(centre) if np.abs(centre).max() > FAR_FROM_ORIGIN_M else np.zeros(2)


def _in_level(mesh: Mesh, origin: npt.NDArray[np.float64]) -> Mesh:
    """Take scene metres (X, Y, Z) to the level frame; exchanging two axes mirrors, so faces are turned round."""
    return Mesh((mesh.vertices - origin)[:, [0, 2, 1]], mesh.faces[:, ::-1])


def _plan_area(mesh: Mesh) -> shapely.Polygon | shapely.MultiPolygon | None:
    """Return the plan area of floor slabs: the union of their faces seen from above."""
    corners = mesh.vertices[mesh.faces][:, :, :2]
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    upward = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0] > TINY  # a closed slab's top alone covers it
    if not upward.any():
        return None
    area = shapely.union_all(shapely.polygons(corners[upward]), grid_size=HAIR_M)
    return area if isinstance(area, shapely.Polygon | shapely.MultiPolygon) else None


def _room(node: SceneNode, scale: float, origin: npt.NDArray[np.float64]) -> SourceRoom:
    words = tuple(node.room_types or ())
    labels = (canonical(word) for word in words)
    box = None
    bounds = node.bounds()
    if bounds is not None:
        (x1, _, z1), (x2, _, z2) = bounds.min, bounds.max
        box = (x1 * scale - origin[0], z1 * scale - origin[1], x2 * scale - origin[0], z2 * scale - origin[1])
    return SourceRoom(words, tuple(label for label in labels if label is not None), box=box)


def _furniture(
    nodes: list[SceneNode], files: _Files, scale: float, origin: npt.NDArray[np.float64]
) -> tuple[SourceObject, ...]:
    """Return the objects but the door leaves; ``transform`` is column-major and mirrors by itself."""
    found = []
    for node in nodes:
        numbers = node.matrix()
        if node.model_id in _DOORS or numbers is None:
            continue
        mesh = files.mesh(f"object/{node.model_id}/{node.model_id}{'_0' if node.state else ''}.obj")
        matrix = np.array(numbers).reshape(4, 4).T
        faces = mesh.faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else mesh.faces
        placed = Mesh((mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]) * scale, faces)
        found.append(SourceObject((node.model_id,), _in_level(placed, origin)))
    return tuple(found)
