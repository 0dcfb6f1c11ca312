"""``house.json`` of SUNCG as checked values: what is in a scene, and nothing of where it is kept."""

from __future__ import annotations

import math
from typing import Annotated, TypeVar

import msgspec

from pipeline.rejection import Reason, Rejection

_ADVICE = "copy it again from the data set"
_NULL = msgspec.Raw(b"null")
_T = TypeVar("_T")


class Bounds(msgspec.Struct, frozen=True):
    """Scene axes (X, Y, Z), scene units."""

    min: tuple[float, float, float]
    max: tuple[float, float, float]


class Node(msgspec.Struct, frozen=True, rename="camel"):
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
        """Return the 16 numbers of ``transform``, column by column, or None if there are none."""
        return _decode(_MATRIX, bytes(self.transform), f"transform of {self.type} {self.model_id}")


class HouseLevel(msgspec.Struct, frozen=True):
    """One level."""

    nodes: list[Node]
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
        return decoder.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise Rejection("source", Reason.UNREADABLE, f"{name}: {error}", _ADVICE) from None
