"""``Home.xml`` of Sweet Home 3D as values in metres; x right, y DOWN as in the file, heights above the ground.

R1  What carries no ``level`` belongs to the one level of a home without levels. Heights count from the level.
R2  A wall without a height has the home's; ``heightAtEnd`` slopes it; ``arcExtent`` (radians) bends it.
R3  A piece that is not visible is not there. A level that is not shown is one all the same. Groups hold pieces, which
    have places of their own.
R4  A piece without a sash is a mere opening where the catalogue calls it a frame: sliding windows have no sash either.
R5  A piece or a room that cannot be read is left out; a wall that cannot be read ends the reading.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pipeline.rejection import Reason, Rejection
from pipeline.sources.left_out import LeftOut
from pipeline.sources.xml_tree import Element

CM = 0.01
LARGEST_CM = 100_000.0
PIECES = frozenset({"pieceOfFurniture", "light", "shelfUnit"})
_ADVICE = "save it again in Sweet Home 3D"


@dataclass(frozen=True)
class Storey:
    """A level: ``key`` is the file's own id of it, "" for a home without levels."""

    key: str
    name: str
    elevation_m: float
    height_m: float
    shown: bool = True


@dataclass(frozen=True)
class DrawnWall:
    """A wall along its middle from ``start`` to ``end``; ``key`` and its neighbours' at both ends."""

    key: str
    level: str
    start: tuple[float, float]
    end: tuple[float, float]
    thickness_m: float
    height_m: float
    end_height_m: float
    arc_rad: float
    joined: tuple[str, str]


@dataclass(frozen=True)
class Piece:
    """A piece of furniture, a door or a window: a box about (x, y), turned by an angle (clockwise as drawn)."""

    level: str
    name: str
    at: tuple[float, float]
    angle_rad: float
    width_m: float
    depth_m: float
    height_m: float
    elevation_m: float


@dataclass(frozen=True)
class DoorOrWindow(Piece):
    """The part that stands in the wall, as shares of width and depth; ``has_leaf`` tells it from a mere frame."""

    wall_left: float
    wall_width: float
    wall_distance: float
    wall_thickness: float
    mirrored: bool
    has_leaf: bool


@dataclass(frozen=True)
class DrawnRoom:
    """A room: its ring and its name, or "" if it has none."""

    level: str
    name: str
    ring: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Home:
    """A home; levels from the lowest to the highest."""

    levels: tuple[Storey, ...]
    walls: tuple[DrawnWall, ...]
    doors: tuple[DoorOrWindow, ...]
    rooms: tuple[DrawnRoom, ...]
    furniture: tuple[Piece, ...]


def home_of(root: Element, name: str, left_out: LeftOut) -> Home:
    """Read a home; raises Rejection (UNREADABLE, NOT_FINITE, BAD_UNITS) where its levels or walls are damaged."""
    if root.tag != "home":
        detail = f"{name}: expected <home>, found <{root.tag[:40]}>"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
    usual = _length(root, "wallHeight", 250.0)
    storeys = [
        Storey(
            each.get("id", ""),
            each.get("name", ""),
            _length(each, "elevation"),
            _length(each, "height", 250.0),
            _flag(each, "visible", True),
        )
        for each in root.findall("level")
    ]
    levels = sorted(storeys, key=lambda each: each.elevation_m) or [Storey("", "", 0.0, usual)]
    here = {each.key for each in levels}
    doors: list[DoorOrWindow] = []
    furniture: list[Piece] = []
    rooms: list[DrawnRoom] = []
    for each in (*_visible(root), *root.iter("room")):
        if each.get("level", "") in here:
            with left_out.part():  # R5
                if each.tag == "room":
                    rooms.append(_room(each))
                elif each.tag == "doorOrWindow":
                    doors.append(_door(each, _values(each)))
                else:
                    furniture.append(Piece(**_values(each)))
    return Home(
        levels=tuple(levels),
        walls=tuple(_wall(each, usual) for each in root.iter("wall") if each.get("level", "") in here),
        doors=tuple(doors),
        rooms=tuple(rooms),
        furniture=tuple(furniture),
    )


def _visible(element: Element) -> Iterator[Element]:
    """R3."""
    for child in element:
        if not _flag(child, "visible", True):
            continue
        if child.tag == "furnitureGroup":
            yield from _visible(child)
        elif child.tag in PIECES or child.tag == "doorOrWindow":
            yield child


def _wall(element: Element, usual: float) -> DrawnWall:
    """R2."""
    height = _length(element, "height", usual / CM)
    return DrawnWall(
        key=element.get("id", ""),
        level=element.get("level", ""),
        start=(_length(element, "xStart"), _length(element, "yStart")),
        end=(_length(element, "xEnd"), _length(element, "yEnd")),
        thickness_m=abs(_length(element, "thickness", 7.5)),
        height_m=height,
        end_height_m=_length(element, "heightAtEnd", height / CM),
        arc_rad=_number(element, "arcExtent", 0.0),
        joined=(element.get("wallAtStart", ""), element.get("wallAtEnd", "")),
    )


def _values(element: Element) -> dict[str, Any]:
    return {
        "level": element.get("level", ""),
        "name": element.get("name", ""),
        "at": (_length(element, "x"), _length(element, "y")),
        "angle_rad": _number(element, "angle", 0.0),
        "width_m": abs(_length(element, "width")),
        "depth_m": abs(_length(element, "depth")),
        "height_m": abs(_length(element, "height")),
        "elevation_m": _length(element, "elevation"),
    }


def _door(element: Element, values: dict[str, Any]) -> DoorOrWindow:
    return DoorOrWindow(
        **values,
        wall_left=_number(element, "wallLeft", 0.0),
        wall_width=_number(element, "wallWidth", 1.0),
        wall_distance=_number(element, "wallDistance", 0.0),
        wall_thickness=_number(element, "wallThickness", 1.0),
        mirrored=_flag(element, "modelMirrored", False),
        has_leaf=element.find("sash") is not None or not _is_frame(element),
    )


def _is_frame(element: Element) -> bool:
    """R4."""
    kind = (element.get("catalogId") or element.get("name") or "").lower()
    return "frame" in kind or "opening" in kind


def _room(element: Element) -> DrawnRoom:
    ring = tuple((_length(point, "x"), _length(point, "y")) for point in element.findall("point"))
    return DrawnRoom(element.get("level", ""), " ".join(element.get("name", "").split()), ring)


def _length(element: Element, key: str, usual: float = 0.0) -> float:
    """Return metres."""
    return _number(element, key, usual, LARGEST_CM) * CM


def _number(element: Element, key: str, usual: float, most: float = 1000.0) -> float:
    text = element.get(key)
    if text is None:
        return usual
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        detail = f"{key} of {element.tag} {element.get('id', '')!r} is {text[:40]!r}, expected a finite number"
        raise Rejection("source", Reason.NOT_FINITE, detail, _ADVICE)
    if abs(value) > most:
        detail = f"{key} of {element.tag} {element.get('id', '')!r} is {value:.4g}, expected {most:.0f} at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, _ADVICE)
    return value


def _flag(element: Element, key: str, usual: bool) -> bool:
    return element.get(key, str(usual)).strip().lower() == "true"
