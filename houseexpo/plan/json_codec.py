"""Read and write plans as JSON. Only this file and ``houseexpo.plan.json_keys`` know the keys (docs/format.md).

A file without ``format`` is a published one: its five keys are checked and others are ignored. A file with
``"format": "houseexpo/2"`` holds the keys of section 2 and no others. Numbers are written in their shortest exact form,
so that a plan that is written and read again is equal, and a published file keeps every value.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any, TypeVar

import msgspec
import numpy as np
from msgspec import UNSET, Struct

from houseexpo.errors import PlanError
from houseexpo.plan import json_keys as keys
from houseexpo.plan.json_errors import explained
from houseexpo.plan.model import PlanData
from houseexpo.plan.parts import Door, Frame, Navigability, PlanObject, Ring, Room
from houseexpo.plan.quality import Quality

FORMAT = "houseexpo/2"

RECORDS: tuple[type[Struct], type[Struct]] = (keys.Published, keys.Plan)
"""The keys of a published file and of one of ours; ``houseexpo.plan.schema`` makes the JSON Schema from them."""

_Record = TypeVar("_Record", bound=Struct)
_Part = TypeVar("_Part")
_Plan = TypeVar("_Plan", bound=PlanData)


class _Head(Struct):
    """The keys that are read first: the format decides how to read the rest, error messages name the id."""

    id: Any = None
    format: Any = None


_HEAD = msgspec.json.Decoder(_Head)
_PUBLISHED = msgspec.json.Decoder(keys.Published)
_PLAN = msgspec.json.Decoder(keys.Plan)
_ENCODER = msgspec.json.Encoder()


def decode_as(kind: type[_Plan], data: bytes | str) -> _Plan:
    """Read one plan into ``PlanData`` or a subclass of it.

    Raises
    ------
    PlanError
        The text is not valid JSON, a key is missing or of the wrong type, or the plan violates a rule of
        ``PlanData``. The error names the key, and the plan if its id can be read.
    """
    try:
        raw = data.encode() if isinstance(data, str) else data
        extended = b'"format"' in raw and _is_extended(raw)
        record: keys.Published = (_PLAN if extended else _PUBLISHED).decode(raw)
        return _plan(kind, record)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise explained(error, data) from None


def encode(plan: PlanData) -> bytes:
    """Return a plan as compact JSON without a final newline; equal plans give equal bytes.

    A plan with nothing but the published keys is written in the published format, any other as ``houseexpo/2``.
    """
    x1, y1, x2, y2 = plan.bbox
    published = {
        "verts": plan.verts.tolist(),
        "id": plan.id,
        "room_category": {label: list(boxes) for label, boxes in plan.room_category.items()},
        "room_num": plan.room_num,
        "bbox": keys.Bounds(max=(x2, y2), min=(x1, y1)),
    }
    if not _has_more(plan):
        return _ENCODER.encode(keys.Published(**published))
    return _ENCODER.encode(
        keys.Plan(
            **published,
            format=FORMAT,
            holes=[hole.tolist() for hole in plan.holes],
            rooms=[_room_record(room) for room in plan.rooms],
            doors=[_door_record(door) for door in plan.doors],
            quality=UNSET if plan.quality is None else keys.Quality(plan.quality.score, dict(plan.quality.grounds)),
            objects=[_object_record(thing) for thing in plan.objects] if plan.objects else UNSET,
            frame=UNSET if plan.frame is None else _frame_record(plan.frame),
            navigability=_navigability_records(plan) if plan.navigability else UNSET,
            provenance=UNSET if plan.provenance is None else dict(plan.provenance),
        )
    )


def _has_more(plan: PlanData) -> bool:
    """Return whether the plan has anything that a published file has no key for."""
    lists = plan.holes or plan.rooms or plan.doors or plan.objects or plan.navigability
    values = (plan.quality, plan.frame, plan.provenance)
    return bool(lists) or any(value is not None for value in values)


def _is_extended(raw: bytes) -> bool:
    head = _HEAD.decode(raw)
    if head.format not in (None, FORMAT):
        raise PlanError(f"expected {FORMAT!r} or no such key, found {head.format!r}", "format", str(head.id or ""))
    return head.format is not None


def _plan(kind: type[_Plan], record: keys.Published) -> _Plan:
    extension: dict[str, Any] = {}
    try:
        if isinstance(record, keys.Plan):
            extension = _extension(record)
    except PlanError as error:
        raise error.within(plan=record.id) from None
    plan = kind(record.id, _ring(record.verts), record.room_num, record.room_category, **extension)  # type: ignore[arg-type]
    x1, y1, x2, y2 = plan.bbox
    found = record.bbox.min + record.bbox.max
    if found != (x1, y1, x2, y2):
        raise PlanError(f"expected the bounds of verts, {(x1, y1, x2, y2)}, found {found}", "bbox", plan.id)
    return plan


def _extension(record: keys.Plan) -> dict[str, Any]:
    quality, frame, reach, provenance = record.quality, record.frame, record.navigability, record.provenance
    return {
        "holes": tuple(map(_ring, record.holes)),
        "rooms": _all("rooms", _room, record.rooms),
        "doors": _all("doors", _door, record.doors),
        "quality": None if quality is UNSET else _named("quality", _quality, quality),
        "objects": () if record.objects is UNSET else _all("objects", _object, record.objects),
        "frame": None if frame is UNSET else _named("frame", _frame, frame),
        "navigability": None
        if reach is UNSET
        else {radius: _named(f"navigability.{radius}", _navigability, found) for radius, found in reach.items()},
        "provenance": None if provenance is UNSET else provenance,
    }


def _all(key: str, make: Callable[[_Record], _Part], records: Sequence[_Record]) -> tuple[_Part, ...]:
    return tuple(_named(f"{key}[{i}]", make, record) for i, record in enumerate(records))


def _named(key: str, make: Callable[[_Record], _Part], record: _Record) -> _Part:
    """Make a part of the plan; add its key to any PlanError."""
    try:
        return make(record)
    except PlanError as error:
        raise error.within(key) from None


def _ring(points: keys.Points) -> Ring:
    # fromiter is three times as fast as array() on a list of pairs; an empty list gives (0, 2), which PlanData refuses
    return np.fromiter(chain.from_iterable(points), np.float64, 2 * len(points)).reshape(-1, 2)


def _room(record: keys.Room) -> Room:
    holes = tuple(map(_ring, record.holes))
    return Room(record.id, record.label, _ring(record.polygon), holes, tuple(record.source_labels))


def _door(record: keys.Door) -> Door:
    return Door(record.id, record.kind, record.segment, record.width, _ring(record.polygon), record.rooms)


def _quality(record: keys.Quality) -> Quality:
    return Quality(record.score, record.grounds)


def _object(record: keys.Object) -> PlanObject:
    return PlanObject(record.id, record.label, record.room, _ring(record.polygon), record.height)


def _frame(record: keys.Frame) -> Frame:
    return Frame(record.matrix, record.up, record.floor, record.level)


def _navigability(record: keys.Navigability) -> Navigability:
    return Navigability(record.components, record.largest_share, record.narrowest)


def _room_record(room: Room) -> keys.Room:
    return keys.Room(
        id=room.id,
        label=room.label,
        source_labels=list(room.source_labels),
        polygon=room.ring.tolist(),
        holes=[hole.tolist() for hole in room.holes],
        area=round(room.area, 4),  # exact for vertices on the 1 cm grid: areas are multiples of half a cm2
    )


def _door_record(door: Door) -> keys.Door:
    return keys.Door(
        id=door.id,
        kind=door.kind,
        segment=door.segment,
        width=door.width,
        polygon=door.ring.tolist(),
        rooms=door.rooms,
    )


def _object_record(thing: PlanObject) -> keys.Object:
    return keys.Object(
        id=thing.id, label=thing.label, room=thing.room, polygon=thing.ring.tolist(), height=thing.height
    )


def _frame_record(frame: Frame) -> keys.Frame:
    return keys.Frame(matrix=frame.matrix, up=frame.up, floor=frame.floor, level=frame.level)


def _navigability_records(plan: PlanData) -> dict[str, keys.Navigability]:
    return {
        radius: keys.Navigability(n.components, n.largest_share, n.narrowest)
        for radius, n in sorted(plan.navigability.items())
    }
