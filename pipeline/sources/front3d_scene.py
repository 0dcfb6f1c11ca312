"""A scene of 3D-FRONT as checked values: metres, its own axes, y up.

Keys that plans do not need are passed over. A mesh, a piece of furniture or its place that cannot be read is left out,
and said; the scene goes on without it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.sources.json_house import check_lengths, decoded
from pipeline.sources.left_out import LeftOut
from pipeline.values import Mesh

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
    instanceid: str = ""
    children: list[msgspec.Raw] = []


class _Content(msgspec.Struct, frozen=True):
    room: list[_Room] = []


class _Scene(msgspec.Struct, frozen=True):
    mesh: list[msgspec.Raw]
    scene: _Content
    furniture: Any = None


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh of a room, and what it is: WallInner, Floor, Door, ..."""

    kind: str
    mesh: Mesh


@dataclass(frozen=True)
class Placed:
    """A piece of furniture: a box of a size (X, Y, Z) on the point ``at``, turned about the upright axis."""

    words: str
    at: tuple[float, float, float]
    size: tuple[float, float, float]
    turn_rad: float


@dataclass(frozen=True, eq=False)
class Chamber:
    """A room with the surfaces and the furniture that belong to it."""

    name: str
    surfaces: tuple[Surface, ...]
    furniture: tuple[Placed, ...]


_DECODER = msgspec.json.Decoder(_Scene)
_PARTS: dict[type[Any], msgspec.json.Decoder[Any]] = {
    kind: msgspec.json.Decoder(kind) for kind in (_Mesh, _Child, _Model)
}


def parse_scene(data: bytes, name: str, left_out: LeftOut) -> tuple[Chamber, ...]:
    """Read the rooms of a scene; raise Rejection if it is none (EMPTY, UNREADABLE), or a floor is damaged.

    Surfaces that no room refers to come in a last room without a name.
    """
    scene = decoded(_DECODER, data, name, _ADVICE)
    surfaces: dict[str, Surface] = {}
    for mesh in _parts(scene.mesh, _Mesh, f"{name}: mesh", left_out):
        with nullcontext() if mesh.type == FLOOR else left_out.part():
            if mesh.xyz:
                surfaces[mesh.uid] = Surface(mesh.type, _triangles(mesh, name))
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
                thing = _placed(models.get(child.ref), child, name)
                things += [thing] if thing else []
        rooms.append(Chamber(room.type, tuple(surfaces[ref] for ref in dict.fromkeys(refs)), tuple(things)))
    loose = tuple(surface for uid, surface in surfaces.items() if uid not in used)
    return (*rooms, Chamber("", loose, ()))


def _parts(found: Iterable[bytes | msgspec.Raw], kind: type[_Part], what: str, left_out: LeftOut) -> Iterator[_Part]:
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


def _placed(model: _Model | None, child: _Child, name: str) -> Placed | None:
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
    return Placed(words, (place[0], place[1], place[2]), (sizes[0], sizes[1], sizes[2]), turn)


def _numbers(value: Any, count: int) -> list[float] | None:
    """Return so many numbers, or None if a file has something else there, such as corners for a size."""
    if not isinstance(value, list) or len(value) != count:
        return None
    return [float(each) for each in value] if all(isinstance(each, int | float) for each in value) else None
