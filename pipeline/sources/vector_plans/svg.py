"""Read an SVG plan of CubiCasa5k (``model.svg``) or our own export: walls, rooms and doors by its groups' classes.

Format: CubiCasa/CubiCasa5k; groups with ``class`` "Wall External", "Door Swing Beside", "Window Regular", "Space
Bedroom" and their like, each with a polygon; pixels, y down; storeys beside each other in groups "Floorplan".

R1  A group is what the first word of its class, or its id, says. Doors and windows stand in their walls; a door of
    the class "None" has no leaf. Fixed furniture is passed over.
R2  CubiCasa names no scale: its median door is DOOR_WIDTH_M wide, and the plan says that this is a guess. Our export is
    in metres.
R3  Entities, scripts and references to other files are not looked at; a document that declares an entity is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from shapely import Polygon

from houseexpo.file_kinds import STATES_WAYS, format_suffix
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import polygon_from_ring
from pipeline.sources.files import Element, LeftOutParts, parse_xml
from pipeline.sources.tolerances import DOOR_WIDTH_M, STOREY_HEIGHT_M
from pipeline.sources.vector_plans.drawing import Drawing, Feature
from pipeline.sources.vector_plans.named_features import kind_from_name, storey_from_features

_OWN: Final = b'<g id="free-space">'
_KINDS: Final = {
    "wall": "wall",
    "column": "wall",
    "railing": "wall",
    "door": "door",
    "space": "room",
    "window": "window",
}
_NAMES: Final = {
    "Undefined": "",
    "UserDefined": "",
    "Outdoor": "Terrace",
    "Outdoor Balcony": "Balcony",
    "DraughtLobby": "Entryway",
    "Entry Lobby": "Entryway",
    "Bath Shower": "Bathroom",
    "Closet WalkIn": "Wardrobe",
}


def can_read(path: Path, head: bytes) -> bool:
    """By its name, and by the groups of either."""
    if format_suffix(path, head) != ".svg":
        return False
    return (
        _OWN in head
        or path.name.lower() == "model.svg"
        or b'class="Wall' in head
        or b'id="Wall"' in head
        or b"<!ENTITY" in head
    )


TAKES: Final = ("unit_m",)


def read_drawing(path: Path, *, unit_m: float | None = None) -> Drawing:
    """Read a plan, in a unit that is given or the one that a door gives.

    Raises
    ------
    Rejection
        It cannot be read, has no walls or rooms, or nothing that gives its scale.
    """
    data = path.read_bytes()
    root = parse_xml(data, path.name)
    own = _OWN in data
    left_out = LeftOutParts()
    floors: dict[int, list[Feature]] = {}
    doors = []
    for floor, kind, word, points in _shapes(root, own):
        area = polygon_from_ring(points * (1.0, -1.0))
        if kind == "door":
            doors.append(float(np.ptp(points, axis=0).max()))
        if area is not None:
            floors.setdefault(floor, []).append(_feature(kind, word, area))
    scale = unit_m or 1.0
    if not own and unit_m is None:
        if not doors or not np.median(doors) > 0:
            detail = f"{path.name}: expected a door, which gives the scale, found none"
            raise Rejection("source", Reason.BAD_UNITS, detail, "leave the plan out")
        scale = DOOR_WIDTH_M / float(np.median(doors))
    storeys = [
        storey_from_features(_cut_holes(found), STOREY_HEIGHT_M * n, scale)
        for n, (_, found) in enumerate(sorted(floors.items()))
    ]
    guesses = () if own or unit_m else ("scale",)
    source = "svg" if own else "cubicasa5k"
    all_ways = own and root.get(f"data-{STATES_WAYS}") == "true"
    found = tuple(storeys)
    return Drawing(source, found, left_out, guesses, unit_m=scale, all_ways=all_ways, wanted="groups of walls")


def _feature(kind: str, word: str, area: Polygon) -> Feature:
    if kind == "room":
        label = _NAMES.get(word, word)
        return Feature("room", area, (label,) if label else (), (label,))
    return Feature("opening" if kind == "door" and word in {"None", "opening", "cut"} else kind, area)


def _cut_holes(found: list[Feature]) -> list[Feature]:
    """Rooms of our export have their holes as further rings: a ring inside a room of the same name is one of these."""
    rooms: list[Feature] = []
    for each in sorted((each for each in found if each.kind == "room"), key=lambda each: -each.shape.area):
        outer = next(
            (i for i, other in enumerate(rooms) if other.words == each.words and other.shape.contains(each.shape)), None
        )
        if outer is None:
            rooms.append(each)
            continue
        rest = rooms[outer].shape.difference(each.shape)
        if isinstance(rest, Polygon):
            rooms[outer] = replace(rooms[outer], shape=rest)
    return [each for each in found if each.kind != "room"] + rooms


def _shapes(root: Element, own: bool) -> Iterator[tuple[int, str, str, npt.NDArray[np.float64]]]:
    """Yield (number of the storey, kind, word, points (n, 2) in the file's units)."""
    count = 0
    waiting: list[tuple[Element, npt.NDArray[np.float64], int, str, str]] = [(root, np.eye(3), 0, "", "")]
    while waiting:
        element, at, floor, kind, word = waiting.pop()
        name = element.tag.rsplit("}", 1)[-1]
        at = at @ _transform(element.get("transform", ""))
        words = element.get("class", "").split()
        if "Floorplan" in words:
            count += 1
            floor = count
        if "FixedFurniture" in words or name in {"defs", "text", "style", "script"}:
            continue
        if own:
            mark = element.get("id", "")
            kind = "skipped" if mark == "free-space" else kind_from_name(mark) or kind
            title = element.findtext("title", "")
            word = title or word
        elif words or element.get("id"):
            first = (words or [element.get("id", "")])[0].lower()
            if first in _KINDS:
                kind, word = (
                    _KINDS[first],
                    " ".join(words[1:]) if first == "space" else (words[1] if len(words) > 1 else ""),
                )
        if name in {"polygon", "path"} and kind in {"wall", "door", "room", "window", "stairwell"}:
            rings = _points(element.get("points", "")) if name == "polygon" else _path(element.get("d", ""))
            yield from ((floor, kind, word, r @ at[:2, :2].T + at[:2, 2]) for r in rings)
            if not own:  # a door's other shapes show its leaf
                kind = "" if kind in {"door", "window"} else kind
            continue
        children = list(element)
        if not own and kind in {"door", "window"}:  # of these, the first polygon is the hole
            polygons = [child for child in children if child.tag.endswith("polygon")]
            children = polygons[:1]
        waiting += [(child, at, floor, kind, word) for child in reversed(children)]


def _numbers(text: str) -> list[float]:
    return [float(each) for each in re.findall(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", text)]


def _points(text: str) -> list[npt.NDArray[np.float64]]:
    numbers = _numbers(text)
    points = np.array(numbers[: len(numbers) // 2 * 2]).reshape(-1, 2)
    return [points] if len(points) >= 3 and np.isfinite(points).all() else []


def _path(text: str) -> list[npt.NDArray[np.float64]]:
    """Return the rings of a path of absolute lines (M, L, H, V, Z), as our export writes it."""
    rings: list[list[tuple[float, float]]] = []
    for command, rest in re.findall(r"([MLHVZmlhvz])([^MLHVZmlhvz]*)", text):
        numbers = _numbers(rest)
        here = rings[-1][-1] if rings and rings[-1] else (0.0, 0.0)
        if command == "M" or not rings:
            rings.append([])
        if command in "ML":
            rings[-1] += list(zip(numbers[::2], numbers[1::2], strict=False))
        elif command == "H":
            rings[-1] += [(x, here[1]) for x in numbers]
        elif command == "V":
            rings[-1] += [(here[0], y) for y in numbers]
    return [np.array(ring_) for ring_ in rings if len(ring_) >= 3]


def _transform(text: str) -> npt.NDArray[np.float64]:
    """Return the matrix of matrix(...), translate(...), scale(...) and rotate(...)."""
    found = np.eye(3)
    for name, rest in re.findall(r"(matrix|translate|scale|rotate)\(([^)]*)\)", text):
        v = _numbers(rest)
        step = np.eye(3)
        if name == "matrix" and len(v) == 6:
            step[:2] = [[v[0], v[2], v[4]], [v[1], v[3], v[5]]]
        elif name == "translate" and v:
            step[:2, 2] = (v[0], v[1] if len(v) > 1 else 0.0)
        elif name == "scale" and v:
            step[0, 0], step[1, 1] = v[0], v[1] if len(v) > 1 else v[0]
        elif name == "rotate" and len(v) == 1:
            cos, sin = math.cos(math.radians(v[0])), math.sin(math.radians(v[0]))
            step[:2, :2] = [[cos, -sin], [sin, cos]]
        found = found @ step
    return found
