"""A scene of 3D-FRONT as checked values: metres, its own axes, y up; keys that plans do not need are passed over."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.sources.json_house import check_lengths, decoded
from pipeline.values import Mesh

_ADVICE = "copy it again from the data set"
_Numbers = list[float]


class _Mesh(msgspec.Struct, frozen=True):
    uid: str
    type: str = ""
    xyz: _Numbers = []
    faces: list[int] = []


class _Model(msgspec.Struct, frozen=True):
    uid: str
    size: _Numbers | None = None
    bbox: _Numbers | None = None
    category: str | None = None
    title: str | None = None


class _Child(msgspec.Struct, frozen=True):
    ref: str
    pos: _Numbers = []
    rot: _Numbers = []
    scale: _Numbers = []


class _Room(msgspec.Struct, frozen=True):
    type: str = ""
    instanceid: str = ""
    children: list[_Child] = []


class _Content(msgspec.Struct, frozen=True):
    room: list[_Room] = []


class _Scene(msgspec.Struct, frozen=True):
    mesh: list[_Mesh]
    scene: _Content
    furniture: list[_Model] = []


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


def parse_scene(data: bytes, name: str) -> tuple[Chamber, ...]:
    """Read the rooms of a scene; raises Rejection (EMPTY, UNREADABLE, NOT_FINITE, BAD_UNITS).

    Surfaces that no room refers to come in a last room without a name.
    """
    scene = decoded(_DECODER, data, name, _ADVICE)
    surfaces = {mesh.uid: Surface(mesh.type, _triangles(mesh, name)) for mesh in scene.mesh if mesh.xyz}
    models = {model.uid: model for model in scene.furniture}
    rooms, used = [], set()
    for room in scene.scene.room:
        refs = [child.ref for child in room.children if child.ref in surfaces and child.ref not in used]
        used.update(refs)
        things = [thing for child in room.children if (thing := _placed(models.get(child.ref), child, name))]
        rooms.append(Chamber(room.type, tuple(surfaces[ref] for ref in dict.fromkeys(refs)), tuple(things)))
    loose = tuple(surface for uid, surface in surfaces.items() if uid not in used)
    return (*rooms, Chamber("", loose, ()))


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
    size = (model.size or model.bbox) if model is not None else None
    if model is None or size is None or len(size) != 3 or len(child.pos) != 3:
        return None
    scale = child.scale if len(child.scale) == 3 else [1.0, 1.0, 1.0]
    x, y, z, w = child.rot if len(child.rot) == 4 else (0.0, 0.0, 0.0, 1.0)
    numbers: list[Any] = [*size, *child.pos, *scale, x, y, z, w]
    check_lengths(numbers, f"{name}: furniture {model.uid[:60]}", _ADVICE)
    turn = math.atan2(2 * (w * y + x * z), 1 - 2 * (y * y + x * x))
    sizes = [abs(a * b) for a, b in zip(size, scale, strict=True)]
    words = model.category or model.title or ""
    return Placed(words, (child.pos[0], child.pos[1], child.pos[2]), (sizes[0], sizes[1], sizes[2]), turn)
