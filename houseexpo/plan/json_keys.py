"""The keys of a plan's file and the types of their values (docs/format.md), as msgspec reads and writes them.

Only this file and ``houseexpo.plan.json_codec``, which makes plans from these records, know the keys.
"""

from __future__ import annotations

from typing import Any, Literal

from msgspec import UNSET, Struct, UnsetType

from houseexpo.plan.parts import Box, DoorKind

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
    room_category: dict[str, list[Box]]
    room_num: int
    bbox: Bounds


class Room(Struct, forbid_unknown_fields=True):
    """A room: an area of the free space, bounded by walls and closed doors; ``area`` in m2."""

    id: int
    label: str
    source_labels: list[str]
    polygon: Points
    holes: list[Points]
    area: float


class Door(Struct, forbid_unknown_fields=True):
    """An opening: its two ends, the area between the faces of its wall, and the rooms on both sides."""

    id: int
    kind: DoorKind
    segment: tuple[Point, Point]
    width: float
    polygon: Points
    rooms: tuple[int | None, int | None]


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
    frame: Frame | UnsetType = UNSET
    navigability: dict[str, Navigability] | UnsetType = UNSET
    provenance: dict[str, Any] | UnsetType = UNSET
