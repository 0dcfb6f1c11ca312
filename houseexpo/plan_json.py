"""JSON <-> FloorPlan; the only file that knows the keys (FORMAT.md).

A file without ``format`` is a published one: its five keys are checked, others are passed over. A file that says
``"format": "houseexpo/2"`` holds the keys of section 2 and no other. Numbers are written in their shortest exact form,
so that decode(encode(plan)) == plan, and a published file keeps every value.
"""

from __future__ import annotations

from itertools import chain
from typing import Any, Literal

import msgspec
import numpy as np
from msgspec import UNSET, Struct, UnsetType

from houseexpo.errors import PlanError
from houseexpo.json_errors import explained
from houseexpo.plan import Box, Door, DoorKind, FloorPlan, Frame, Navigability, Ring, Room

FORMAT = "houseexpo/2"

_Point = tuple[float, float]
_Points = list[_Point]


class _Bounds(Struct, gc=False):
    max: _Point
    min: _Point


class _Published(Struct):
    """The published keys in the published order."""

    verts: _Points
    id: str
    room_category: dict[str, list[Box]]
    room_num: int
    bbox: _Bounds


class _Room(Struct, forbid_unknown_fields=True):
    id: int
    label: str
    source_labels: list[str]
    polygon: _Points
    holes: list[_Points]
    area: float


class _Door(Struct, forbid_unknown_fields=True):
    id: int
    kind: DoorKind
    segment: tuple[_Point, _Point]
    width: float
    polygon: _Points
    rooms: tuple[int | None, int | None]


class _Frame(Struct, forbid_unknown_fields=True):
    matrix: tuple[tuple[float, float, float], tuple[float, float, float]]
    up: Literal["y", "z"]
    floor: float
    level: int


class _Navigability(Struct, forbid_unknown_fields=True):
    components: int
    largest_share: float
    narrowest: float


class _Plan(_Published, forbid_unknown_fields=True, omit_defaults=True):
    """The keys of ``houseexpo/2``; what a plan does not have is left out, apart from the lists."""

    format: str
    holes: list[_Points]
    rooms: list[_Room]
    doors: list[_Door]
    frame: _Frame | UnsetType = UNSET
    navigability: dict[str, _Navigability] | UnsetType = UNSET
    provenance: dict[str, Any] | UnsetType = UNSET


class _Head(Struct):
    """What must be known before the rest is read, and what an error message names."""

    id: Any = None
    format: Any = None


RECORDS: tuple[type[Struct], type[Struct]] = (_Published, _Plan)
"""What a published file holds and what one of ours does; ``houseexpo.schema`` makes the JSON Schema of them."""

_HEAD = msgspec.json.Decoder(_Head)
_PUBLISHED = msgspec.json.Decoder(_Published)
_PLAN = msgspec.json.Decoder(_Plan)
_ENCODER = msgspec.json.Encoder()


def decode(data: bytes | str) -> FloorPlan:
    """Read one plan.

    Raises
    ------
    PlanError
        The text is no JSON, is cut off, a key is missing or of the wrong type, or the plan breaks a rule of
        ``FloorPlan``; the error names the plan where its id can be read, and the key.
    """
    try:
        raw = data.encode() if isinstance(data, str) else data
        extended = b'"format"' in raw and _is_extended(raw)
        record: _Published = (_PLAN if extended else _PUBLISHED).decode(raw)
        return _plan(record)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise explained(error, data) from None


def encode(plan: FloorPlan) -> bytes:
    """Write one plan as compact JSON, without a line end; equal plans give equal bytes.

    A plan without holes, rooms, doors, frame, navigability and provenance is written as a published one.
    """
    x1, y1, x2, y2 = plan.bbox
    published = {
        "verts": plan.verts.tolist(),
        "id": plan.id,
        "room_category": {label: list(boxes) for label, boxes in plan.room_category.items()},
        "room_num": plan.room_num,
        "bbox": _Bounds(max=(x2, y2), min=(x1, y1)),
    }
    extended = plan.holes or plan.rooms or plan.doors or plan.navigability
    if not extended and plan.frame is None and plan.provenance is None:
        return _ENCODER.encode(_Published(**published))
    return _ENCODER.encode(
        _Plan(
            **published,
            format=FORMAT,
            holes=[hole.tolist() for hole in plan.holes],
            rooms=[_room_record(room) for room in plan.rooms],
            doors=[_door_record(door) for door in plan.doors],
            frame=UNSET if plan.frame is None else _frame_record(plan.frame),
            navigability=_navigability_records(plan) if plan.navigability else UNSET,
            provenance=UNSET if plan.provenance is None else dict(plan.provenance),
        )
    )


def _is_extended(raw: bytes) -> bool:
    head = _HEAD.decode(raw)
    if head.format not in (None, FORMAT):
        raise PlanError(f"expected {FORMAT!r} or no such key, found {head.format!r}", "format", str(head.id or ""))
    return head.format is not None


def _plan(record: _Published) -> FloorPlan:
    extension: dict[str, Any] = {}
    try:
        if isinstance(record, _Plan):
            extension = _extension(record)
    except PlanError as error:
        raise error.within(plan=record.id) from None
    plan = FloorPlan(record.id, _ring(record.verts), record.room_num, record.room_category, **extension)  # type: ignore[arg-type]
    x1, y1, x2, y2 = plan.bbox
    found = record.bbox.min + record.bbox.max
    if found != (x1, y1, x2, y2):
        raise PlanError(f"expected the bounds of verts, {(x1, y1, x2, y2)}, found {found}", "bbox", plan.id)
    return plan


def _extension(record: _Plan) -> dict[str, Any]:
    frame, navigability, provenance = record.frame, record.navigability, record.provenance
    return {
        "holes": tuple(map(_ring, record.holes)),
        "rooms": tuple(_named(f"rooms[{i}]", _room, room) for i, room in enumerate(record.rooms)),
        "doors": tuple(_named(f"doors[{i}]", _door, door) for i, door in enumerate(record.doors)),
        "frame": None if frame is UNSET else _named("frame", _frame, frame),
        "navigability": None
        if navigability is UNSET
        else {radius: _named(f"navigability.{radius}", _navigability, found) for radius, found in navigability.items()},
        "provenance": None if provenance is UNSET else provenance,
    }


def _named(key: str, make: Any, record: Struct) -> Any:
    """Make a part of the plan; its errors name the part."""
    try:
        return make(record)
    except PlanError as error:
        raise error.within(key) from None


def _ring(points: _Points) -> Ring:
    # fromiter is three times as fast as array() on a list of pairs; an empty list gives (0, 2), which FloorPlan refuses
    return np.fromiter(chain.from_iterable(points), np.float64, 2 * len(points)).reshape(-1, 2)


def _room(record: _Room) -> Room:
    holes = tuple(map(_ring, record.holes))
    return Room(record.id, record.label, _ring(record.polygon), holes, tuple(record.source_labels))


def _door(record: _Door) -> Door:
    return Door(record.id, record.kind, record.segment, record.width, _ring(record.polygon), record.rooms)


def _frame(record: _Frame) -> Frame:
    return Frame(record.matrix, record.up, record.floor, record.level)


def _navigability(record: _Navigability) -> Navigability:
    return Navigability(record.components, record.largest_share, record.narrowest)


def _room_record(room: Room) -> _Room:
    return _Room(
        id=room.id,
        label=room.label,
        source_labels=list(room.source_labels),
        polygon=room.polygon.tolist(),
        holes=[hole.tolist() for hole in room.holes],
        area=round(room.area, 4),  # exact for vertices on the 1 cm grid: areas are multiples of half a cm2
    )


def _door_record(door: Door) -> _Door:
    return _Door(
        id=door.id,
        kind=door.kind,
        segment=door.segment,
        width=door.width,
        polygon=door.polygon.tolist(),
        rooms=door.rooms,
    )


def _frame_record(frame: Frame) -> _Frame:
    return _Frame(matrix=frame.matrix, up=frame.up, floor=frame.floor, level=frame.level)


def _navigability_records(plan: FloorPlan) -> dict[str, _Navigability]:
    return {
        radius: _Navigability(n.components, n.largest_share, n.narrowest)
        for radius, n in sorted(plan.navigability.items())
    }
