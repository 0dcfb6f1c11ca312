"""A house of ProcTHOR as checked values: what plans need of it; all other keys are passed over."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from pipeline.sources.json_house import check_lengths, decoded

_ADVICE = "copy it again from the data set"


class Corner(msgspec.Struct, frozen=True):
    """A point of the scene in Unity's axes, metres; a hole's x runs along its wall, y is height."""

    x: float
    y: float
    z: float = 0.0


class Plane(msgspec.Struct, frozen=True):
    """A wall: an upright rectangle, its first two corners on the floor."""

    id: str
    polygon: list[Corner]
    empty: bool = False


class Slot(msgspec.Struct, frozen=True):
    """A door or a window."""

    id: str
    wall0: str
    wall1: str = ""
    hole: list[Corner] = msgspec.field(name="holePolygon", default_factory=list)
    asset: str = msgspec.field(name="assetId", default="")


class Chamber(msgspec.Struct, frozen=True, rename="camel"):
    """A room."""

    floor_polygon: list[Corner]
    room_type: str = ""


class Box(msgspec.Struct, frozen=True):
    """A box along the scene's axes."""

    center: Corner
    size: Corner


class Thing(msgspec.Struct, frozen=True):
    """An object; what stands on it is beside it in no plan."""

    id: str = ""
    box: Box | None = msgspec.field(name="axisAlignedBoundingBox", default=None)


class House(msgspec.Struct, frozen=True):
    """One house."""

    walls: list[Plane]
    rooms: list[Chamber]
    doors: list[Slot] = []
    windows: list[Slot] = []
    objects: list[Thing] = []


_HOUSE = msgspec.json.Decoder(House)


def parse_house(data: bytes, name: str) -> House:
    """Read one house; raises Rejection (EMPTY, UNREADABLE, NOT_FINITE, BAD_UNITS)."""
    house = decoded(_HOUSE, data, name, _ADVICE)
    corners = (corner for shape in _shapes(house) for corner in shape)
    check_lengths([(corner.x, corner.y, corner.z) for corner in corners], name, _ADVICE)
    return house


def _shapes(house: House) -> Iterable[list[Corner]]:
    yield from (wall.polygon for wall in house.walls)
    yield from (slot.hole for slot in [*house.doors, *house.windows])
    yield from (room.floor_polygon for room in house.rooms)
    yield from ([thing.box.center, thing.box.size] for thing in house.objects if thing.box is not None)
