"""What RoomPlan found, as values: metres, seen from above with y = -Z, heights as in the file.

R1  A surface or an object is a box of its dimensions about its transform (16 numbers, column by column).
R2  A structure holds its rooms, and each of these what was found in it; what the structure repeats is left out.
R3  A floor is the ring of its corners, which are in its own frame, else its box.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import shapely
from shapely import Polygon

from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import clean
from pipeline.sources.json_house import check_lengths, decoded

THIN_M = 0.02
_ADVICE = "export the scan again"


class _Surface(msgspec.Struct, frozen=True, rename="camel"):
    dimensions: list[float]
    transform: list[float]
    category: dict[str, Any] | str | None = None
    polygon_corners: list[list[float]] | None = None


class _Section(msgspec.Struct, frozen=True):
    label: str
    center: list[float]


class _Room(msgspec.Struct, frozen=True):
    walls: list[_Surface] = []
    doors: list[_Surface] = []
    openings: list[_Surface] = []
    windows: list[_Surface] = []
    objects: list[_Surface] = []
    floors: list[_Surface] = []
    sections: list[_Section] = []


class _Structure(_Room, frozen=True):
    rooms: list[_Room] = []


@dataclass(frozen=True, eq=False)
class Thing:
    """A box that stands upright: its plan shape, wider than deep for surfaces, and its heights; ``word`` names it."""

    word: str
    shape: Polygon
    low_m: float
    high_m: float


@dataclass(frozen=True, eq=False)
class Floor:
    """A floor: its plan shape and its height."""

    shape: Polygon
    height_m: float


@dataclass(frozen=True)
class Section:
    """A part of a home that RoomPlan gave a label to, by its middle."""

    label: str
    at: tuple[float, float]
    height_m: float


@dataclass(frozen=True, eq=False)
class Scan:
    """All that was found."""

    walls: tuple[Thing, ...] = ()
    doors: tuple[Thing, ...] = ()
    openings: tuple[Thing, ...] = ()
    objects: tuple[Thing, ...] = ()
    floors: tuple[Floor, ...] = ()
    sections: tuple[Section, ...] = ()


_DECODER = msgspec.json.Decoder(_Structure)


def parse_scan(data: bytes, name: str) -> Scan:
    """Read the exported JSON; raises Rejection (EMPTY, UNREADABLE, NOT_FINITE, BAD_UNITS)."""
    structure = decoded(_DECODER, data, name, _ADVICE)
    rooms: list[_Room] = [*structure.rooms] or [structure]  # R2
    return Scan(
        walls=tuple(_things((each for room in rooms for each in room.walls), name)),
        doors=tuple(_things((each for room in rooms for each in room.doors), name)),
        openings=tuple(_things((each for room in rooms for each in room.openings), name)),
        objects=tuple(_things((each for room in rooms for each in room.objects), name)),
        floors=tuple(floor for room in rooms for each in room.floors if (floor := _floor(each, name)) is not None),
        sections=tuple(_section(each, name) for room in rooms for each in room.sections),
    )


def box_thing(word: str, points: np.ndarray) -> Thing | None:
    """Return the upright box around points (n, 3) of plan x, y and height, or None if they have no extent in plan."""
    around = shapely.minimum_rotated_rectangle(shapely.MultiPoint(points[:, :2]))
    if around.length < THIN_M:
        return None
    if around.area < THIN_M * around.length / 2:
        line = shapely.LineString(_farthest(points[:, :2]))
        around = line.buffer(THIN_M / 2, cap_style="flat")
    return Thing(word, around, float(points[:, 2].min()), float(points[:, 2].max()))


def _farthest(points: np.ndarray) -> np.ndarray:
    """The two ends of points that lie on a line."""
    first = points[int(np.argmax(np.hypot(*(points - points[0]).T)))]
    return np.stack([first, points[int(np.argmax(np.hypot(*(points - first).T)))]])


def _things(surfaces: Iterable[_Surface], name: str) -> Iterable[Thing]:
    """R1."""
    for surface in surfaces:
        matrix, size = _placed(surface, name)
        signs = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
        thing = box_thing(_word(surface), _in_plan(signs * size, matrix))
        if thing is not None:
            yield thing


def _floor(surface: _Surface, name: str) -> Floor | None:
    """R3."""
    matrix, size = _placed(surface, name)
    corners = [corner for corner in surface.polygon_corners or [] if len(corner) == 3]
    if len(corners) < 3:
        corners = [[x * size[0], y * size[1], 0.0] for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    points = _in_plan(np.array(corners, np.float64), matrix)
    check_lengths(points, name, _ADVICE)
    shape = clean(points[:, :2])
    return None if shape is None else Floor(shape, float(np.median(points[:, 2])))


def _section(section: _Section, name: str) -> Section:
    if len(section.center) != 3:
        raise Rejection("source", Reason.UNREADABLE, f"{name}: a section's center has not three numbers", _ADVICE)
    x, height, z = section.center
    check_lengths([x, height, z], name, _ADVICE)
    return Section(section.label, (x, -z), height)


def _placed(surface: _Surface, name: str) -> tuple[np.ndarray, np.ndarray]:
    if len(surface.dimensions) != 3 or len(surface.transform) != 16:
        detail = f"{name}: expected 3 dimensions and a transform of 16 numbers"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
    matrix = np.array(surface.transform, np.float64).reshape(4, 4).T
    size = np.array(surface.dimensions, np.float64)
    check_lengths([*surface.transform, *surface.dimensions], name, _ADVICE)
    return matrix, size


def _in_plan(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Points of a thing's own frame to plan x, y and height."""
    x, y, z = (points @ matrix[:3, :3].T + matrix[:3, 3]).T
    return np.column_stack([x, -z, y])


def _word(surface: _Surface) -> str:
    """A category is a word, or an object with the word as its only key."""
    if isinstance(surface.category, str):
        return surface.category
    return next(iter(surface.category), "") if surface.category else ""
