"""Read and write a plan as JSON, in the published format or ``houseexpo/2``; each class is one JSON object.

Only this file knows the keys (docs/format.md).

A file without ``format`` is a published file: its five keys are checked and others are ignored. A file with
``"format": "houseexpo/2"`` holds the keys of section 2 and no others. Numbers are written in their shortest exact form,
so that a plan that is written and read again is equal, and a published file keeps every value.

The records below have the keys and types of the file, as msgspec reads and writes them; plans are made from them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import UNSET, Struct, UnsetType

from houseexpo.errors import PlanError
from houseexpo.files import without_mark
from houseexpo.plan import parts
from houseexpo.plan.model import PlanData

FORMAT = "houseexpo/2"

_Record = TypeVar("_Record", bound=Struct)
_Part = TypeVar("_Part")
_Plan = TypeVar("_Plan", bound=PlanData)

Point = tuple[float, float]
Points = list[Point]


class Bounds(Struct, gc=False):
    """The bounds of ``verts``, metres."""

    max: Point
    min: Point


class Published(Struct):
    """The published keys in the published order."""

    verts: Points
    id: str
    room_category: dict[str, list[parts.Box]]
    room_num: int
    bbox: Bounds


class Room(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """A room: an area bounded by walls and closed doors, in m2; ``confidence`` is the probability that it is right."""

    id: int
    label: str
    source_labels: list[str]
    polygon: Points
    holes: list[Points]
    area: float
    confidence: float | UnsetType = UNSET


class Door(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """An opening: its ends, its area in the wall, the rooms beside it; ``confidence``: how probable a passage is."""

    id: int
    kind: Literal["door", "opening", "entrance", "cut"]
    segment: tuple[Point, Point]
    width: float
    polygon: Points
    rooms: tuple[int | None, int | None]
    confidence: float | UnsetType = UNSET


class Quality(Struct, forbid_unknown_fields=True):
    """The pipeline's confidence in the plan, and the named numbers that it is based on."""

    score: float
    grounds: dict[str, float]


class Object(Struct, forbid_unknown_fields=True):
    """A piece of furniture: its footprint, the id of its room, its height in metres."""

    id: int
    label: str
    room: int | None
    polygon: Points
    height: float


class Window(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """A window: its ends, its area in the wall, the rooms beside it, the heights of its sill and head in metres."""

    id: int
    segment: tuple[Point, Point]
    width: float
    polygon: Points
    rooms: tuple[int, int | None]
    sill: float | UnsetType = UNSET
    head: float | UnsetType = UNSET


class Frame(Struct, forbid_unknown_fields=True):
    """The plan's position in its source."""

    matrix: tuple[tuple[float, float, float], tuple[float, float, float]]
    up: Literal["y", "z"]
    floor: float
    level: int


class Navigability(Struct, forbid_unknown_fields=True):
    """The places that a disc robot of one radius can reach, in figures."""

    components: int
    largest_share: float
    narrowest: float


class Plan(Published, forbid_unknown_fields=True, omit_defaults=True):
    """The keys of ``houseexpo/2``; all but the first four may be missing."""

    format: str
    holes: list[Points]
    rooms: list[Room]
    doors: list[Door]
    quality: Quality | UnsetType = UNSET
    objects: list[Object] | UnsetType = UNSET
    windows: list[Window] | UnsetType = UNSET
    frame: Frame | UnsetType = UNSET
    navigability: dict[str, Navigability] | UnsetType = UNSET
    provenance: dict[str, Any] | UnsetType = UNSET


RECORDS: tuple[type[Struct], type[Struct]] = (Published, Plan)
"""The keys of a published file and of our files; ``houseexpo.plan.schema`` makes the JSON Schema from them."""


class _Head(Struct):
    """The keys that are read first: the format decides how to read the rest, error messages name the id."""

    id: Any = None
    format: Any = None


_HEAD = msgspec.json.Decoder(_Head)
_PUBLISHED = msgspec.json.Decoder(Published)
_PLAN = msgspec.json.Decoder(Plan)
_ENCODER = msgspec.json.Encoder()

_KEY_IN_MESSAGE = re.compile(r"^(?P<problem>.*?)(?: - at `\$\.?(?P<key>.*?)`)?$", re.DOTALL)
_ID = re.compile(r'"id"\s*:\s*"([^"\\]{1,200})"')


def decode_plan_as(kind: type[_Plan], data: bytes | str) -> _Plan:
    """Read one plan into ``PlanData`` or a subclass of it.

    Raises
    ------
    PlanError
        The text is not valid JSON, a key is missing or of the wrong type, or the plan violates a rule of
        ``PlanData``. The error names the key, and the plan if its id can be read.
    """
    try:
        raw = without_mark(data.encode() if isinstance(data, str) else data)
        extended = b'"format"' in raw and _is_extended(raw)
        record: Published = (_PLAN if extended else _PUBLISHED).decode(raw)
        return _plan(kind, record)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise _plan_error(error, data) from None


def encode(plan: PlanData) -> bytes:
    """Return a plan as compact JSON without a final newline; equal plans give equal bytes.

    A plan with only the published keys is written in the published format, any other plan as ``houseexpo/2``.

    Parameters
    ----------
    plan
        The plan; coordinates are written in metres.
    """
    x1, y1, x2, y2 = plan.bbox
    published = {
        "verts": plan.verts.tolist(),
        "id": plan.id,
        "room_category": {label: list(boxes) for label, boxes in plan.room_category.items()},
        "room_num": plan.room_num,
        "bbox": Bounds(max=(x2, y2), min=(x1, y1)),
    }
    if not _has_more(plan):
        return _ENCODER.encode(Published(**published))
    return _ENCODER.encode(
        Plan(
            **published,
            format=FORMAT,
            holes=[hole.tolist() for hole in plan.holes],
            rooms=[_room_record(room) for room in plan.rooms],
            doors=[_door_record(door) for door in plan.doors],
            quality=UNSET if plan.quality is None else Quality(plan.quality.score, dict(plan.quality.grounds)),
            objects=[_object_record(thing) for thing in plan.objects] if plan.objects else UNSET,
            windows=[_window_record(window) for window in plan.windows] if plan.windows else UNSET,
            frame=UNSET if plan.frame is None else _frame_record(plan.frame),
            navigability=_navigability_records(plan) if plan.navigability else UNSET,
            provenance=UNSET if plan.provenance is None else dict(plan.provenance),
        )
    )


def _has_more(plan: PlanData) -> bool:
    """Return whether the plan has values for which the published format has no key."""
    lists = plan.holes or plan.rooms or plan.doors or plan.objects or plan.navigability
    values = (plan.quality, plan.frame, plan.provenance)
    return bool(lists) or any(value is not None for value in values)


def _is_extended(raw: bytes) -> bool:
    head = _HEAD.decode(raw)
    if head.format not in (None, FORMAT):
        raise PlanError(f"expected {FORMAT!r} or no such key, found {head.format!r}", "format", str(head.id or ""))
    return head.format is not None


def _plan(kind: type[_Plan], record: Published) -> _Plan:
    extension: dict[str, Any] = {}
    try:
        if isinstance(record, Plan):
            extension = _extension(record)
    except PlanError as error:
        raise error.within(plan=record.id) from None
    plan = kind(record.id, _ring(record.verts), record.room_num, record.room_category, **extension)  # type: ignore[arg-type]
    x1, y1, x2, y2 = plan.bbox
    found = record.bbox.min + record.bbox.max
    if found != (x1, y1, x2, y2):
        raise PlanError(f"expected the bounds of verts, {(x1, y1, x2, y2)}, found {found}", "bbox", plan.id)
    return plan


def _extension(record: Plan) -> dict[str, Any]:
    quality, frame, reach, provenance = record.quality, record.frame, record.navigability, record.provenance
    return {
        "holes": tuple(map(_ring, record.holes)),
        "rooms": _all("rooms", _room, record.rooms),
        "doors": _all("doors", _door, record.doors),
        "quality": None if quality is UNSET else _with_key("quality", _quality, quality),
        "objects": () if record.objects is UNSET else _all("objects", _object, record.objects),
        "windows": () if record.windows is UNSET else _all("windows", _window, record.windows),
        "frame": None if frame is UNSET else _with_key("frame", _frame, frame),
        "navigability": None
        if reach is UNSET
        else {radius: _with_key(f"navigability.{radius}", _navigability, found) for radius, found in reach.items()},
        "provenance": None if provenance is UNSET else provenance,
    }


def _all(key: str, make: Callable[[_Record], _Part], records: Sequence[_Record]) -> tuple[_Part, ...]:
    return tuple(_with_key(f"{key}[{i}]", make, record) for i, record in enumerate(records))


def _with_key(key: str, make: Callable[[_Record], _Part], record: _Record) -> _Part:
    """Make a part of the plan; add its key to any PlanError."""
    try:
        return make(record)
    except PlanError as error:
        raise error.within(key) from None


def _ring(points: Points) -> parts.Ring:
    # fromiter is three times as fast as array() on a list of pairs; an empty list gives (0, 2), which PlanData refuses
    return np.fromiter(chain.from_iterable(points), np.float64, 2 * len(points)).reshape(-1, 2)


def _room(record: Room) -> parts.Room:
    holes = tuple(map(_ring, record.holes))
    words = tuple(record.source_labels)
    return parts.Room(record.id, record.label, _ring(record.polygon), holes, words, _optional(record.confidence))


def _door(record: Door) -> parts.Door:
    sure = _optional(record.confidence)
    return parts.Door(record.id, record.kind, record.segment, record.width, _ring(record.polygon), record.rooms, sure)


def _window(record: Window) -> parts.Door:
    return parts.Door(
        id=record.id,
        kind="window",
        segment=record.segment,
        width=record.width,
        ring=_ring(record.polygon),
        rooms=record.rooms,
        sill=_optional(record.sill),
        head=_optional(record.head),
    )


def _optional(value: float | UnsetType) -> float | None:
    return None if value is UNSET else value


def _quality(record: Quality) -> parts.Quality:
    return parts.Quality(record.score, record.grounds)


def _object(record: Object) -> parts.PlanObject:
    return parts.PlanObject(record.id, record.label, record.room, _ring(record.polygon), record.height)


def _frame(record: Frame) -> parts.Frame:
    return parts.Frame(record.matrix, record.up, record.floor, record.level)


def _navigability(record: Navigability) -> parts.Navigability:
    return parts.Navigability(record.components, record.largest_share, record.narrowest)


def _room_record(room: parts.Room) -> Room:
    return Room(
        id=room.id,
        label=room.label,
        source_labels=list(room.source_labels),
        polygon=room.ring.tolist(),
        holes=[hole.tolist() for hole in room.holes],
        area=round(room.area, 4),  # exact for vertices on the 1 cm grid: areas are multiples of half a cm2
        confidence=UNSET if room.confidence is None else room.confidence,
    )


def _door_record(door: parts.Door) -> Door:
    return Door(
        id=door.id,
        kind=door.kind,  # type: ignore[arg-type]  # PlanData has no window among the doors
        segment=door.segment,
        width=door.width,
        polygon=door.ring.tolist(),
        rooms=door.rooms,
        confidence=UNSET if door.confidence is None else door.confidence,
    )


def _window_record(window: parts.Door) -> Window:
    room, other = window.rooms
    assert room is not None  # noqa: S101  # Door has checked it
    return Window(
        id=window.id,
        segment=window.segment,
        width=window.width,
        polygon=window.ring.tolist(),
        rooms=(room, other),
        sill=UNSET if window.sill is None else window.sill,
        head=UNSET if window.head is None else window.head,
    )


def _object_record(thing: parts.PlanObject) -> Object:
    return Object(id=thing.id, label=thing.label, room=thing.room, polygon=thing.ring.tolist(), height=thing.height)


def _frame_record(frame: parts.Frame) -> Frame:
    return Frame(matrix=frame.matrix, up=frame.up, floor=frame.floor, level=frame.level)


def _navigability_records(plan: PlanData) -> dict[str, Navigability]:
    return {
        radius: Navigability(n.components, n.largest_share, n.narrowest)
        for radius, n in sorted(plan.navigability.items())
    }


def _plan_error(error: Exception, data: bytes | str) -> PlanError:
    """Return the error as a PlanError with the key, and with the plan's id if it can be read."""
    text = data if isinstance(data, str) else data.decode(errors="replace")
    name = _ID.search(text)
    plan = name.group(1) if name else ""
    if isinstance(error, msgspec.ValidationError):
        match = _KEY_IN_MESSAGE.match(str(error))
        problem, key = (match["problem"], match["key"] or "") if match else (str(error), "")
        missing = re.search(r"missing required field `(\w+)`", problem)
        if missing:
            key = f"{key}.{missing[1]}".lstrip(".")
            problem = "expected this key, found none; the file is not a whole plan"
        return PlanError(problem[:1].lower() + problem[1:], key, plan)
    if isinstance(error, RecursionError):
        return PlanError("expected a plan, found lists nested too deeply", "", plan)
    found = f"{len(text):,} characters that are not JSON ({error})" if text.strip() else "an empty file"
    return PlanError(f"expected one JSON object in UTF-8, found {found}", "", plan)
