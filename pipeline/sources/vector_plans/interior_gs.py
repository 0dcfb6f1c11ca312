"""Read an InteriorGS floor plan (``structure.json``): rooms, walls as thick lines, doors in them, boxes of furniture.

Format: manycore-research/InteriorGS, README, "Floorplan data": metres, z up. ``rooms`` have a ``profile``, a polygon of
the plan, and a ``room_type``; ``walls`` a ``location``, a line of the plan, with ``thickness`` and ``height``;
``holes`` a ``profile``, an upright polygon in space, with ``thickness`` and a ``type``, WINDOW or DOOR; ``ins`` a
``label``, and the ``position`` and ``size`` of a box along the axes.

R1  A wall reaches half of its thickness to both sides of its line, and goes on by as much, so that corners close.
R2  A hole of type DOOR is a door through the wall, as wide as its profile. A window is none.
R3  A room is a "virtual partition", as the README says: it names the space in it, and walls bound it.
R4  An instance is furniture, unless it fills a hole, hangs above a person, or covers more than LARGEST_THING_M2.
R5  A part that cannot be read is left out, with a note.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from pipeline.geometry.prisms import extrude_polygon
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import Hole, Wall, merge_parallel_holes, polygon_from_ring, unite_rooms
from pipeline.sources.files import LeftOutParts, read_json_object
from pipeline.sources.tolerances import LARGEST_THING_M2, LINE_WALL_M, LONGEST_SITE_M, LOWEST_HEAD_M, THICKEST_LINE_M
from pipeline.sources.vector_plans.drawing import (
    Drawing,
    DrawnStorey,
    door_hole,
    named_room,
    wall_along_line,
    walls_between_faces,
)
from pipeline.values import SourceObject, SourceRoom

Floats = npt.NDArray[np.float64]
Part = TypeVar("Part")

_FILLINGS: Final = ("door", "window", "curtain", "blind")
_ADVICE: Final = "copy it again from the data set"
_FAULTS: Final = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def can_read(path: Path, head: bytes) -> bool:
    """By its name and some of its keys, or by more of them."""
    if path.suffix.lower() != ".json":
        return False
    keys = [key for key in (b'"rooms"', b'"walls"', b'"holes"', b'"ins"') if key in head]
    drawn = b'"profile"' in head or (b'"location"' in head and b'"thickness"' in head)
    least = 1 if path.name.lower() == "structure.json" else 3
    return drawn and len(keys) >= least


def read_drawing(path: Path) -> Drawing:
    """Read a floor plan; raise Rejection if it cannot be read, or has neither walls nor rooms."""
    found = read_json_object(path, _ADVICE)
    left_out = LeftOutParts()
    walls = list(_each(found, "walls", _wall, left_out))
    rooms = tuple(_each(found, "rooms", _room, left_out))
    if not walls and not rooms:
        detail = f"{path.name}: expected walls with a location, found none"
        raise Rejection("source", Reason.NO_LEVEL, detail, "leave the scene out")
    body = walls_between_faces([shape for shape, _ in walls]) if walls else []
    top = float(np.median([height for _, height in walls])) if walls else 0.0
    holes = [hole for hole in _each(found, "holes", lambda each: _hole(each, body), left_out) if hole is not None]
    things = (thing for thing in _each(found, "ins", _thing, left_out) if thing is not None)
    storey = DrawnStorey(
        walls=tuple(Wall(part, 0.0, top) for part in body),
        holes=tuple(merge_parallel_holes(holes)),
        rooms=rooms,
        floor=unite_rooms([each.polygon for each in rooms if each.polygon is not None]),
        furniture=tuple(things),
        all_named=bool(holes),
    )
    return Drawing("interiorgs", (storey,), left_out)


def _each(found: Mapping[str, Any], key: str, made: Callable[[Any], Part], left_out: LeftOutParts) -> Iterator[Part]:
    """R5: yield what is made of each part under a key."""
    parts = found.get(key)
    for number, part in enumerate(parts if isinstance(parts, list) else ()):
        try:
            yield made(part)
        except _FAULTS as error:
            left_out.add(f"{key}[{number}]: {type(error).__name__}: {str(error)[:60]}")


def _points(said: Any, least: int) -> Floats:
    """Points (n, 2 or 3), metres."""
    found = np.array(said, np.float64)
    if found.ndim != 2 or found.shape[1] not in {2, 3} or len(found) < least:
        raise ValueError(f"expected {least} points or more")
    return _in_reach(found)


def _in_reach(found: Floats) -> Floats:
    if not np.isfinite(found).all() or np.abs(found).max(initial=0.0) > 10 * LONGEST_SITE_M:
        raise ValueError("it lies beyond any building")
    return found


def _wall(said: Any) -> tuple[Polygon, float]:
    """R1: return a wall's area and height."""
    a, b = _points(said["location"], 2)[[0, -1], :2]
    thick, height = float(said["thickness"]), float(said["height"])
    if not (math.isfinite(thick) and 0 < height < LONGEST_SITE_M):
        raise ValueError(f"a wall {thick:g} m thick and {height:g} m high")
    thick = thick if 0 < thick < THICKEST_LINE_M else LINE_WALL_M
    more = (b - a) / max(float(np.hypot(*(b - a))), 1e-9) * thick / 2
    shape = wall_along_line((a - more).tolist(), (b + more).tolist(), thick)
    if shape is None:
        raise ValueError("a wall without a length")
    return shape, height


def _room(said: Any) -> SourceRoom:
    """R3."""
    shape = polygon_from_ring(_points(said["profile"], 3)[:, :2])
    if shape is None:
        raise ValueError("a room without an area")
    word = said.get("room_type")
    return named_room(word if isinstance(word, str) else "", shape)


def _hole(said: Any, walls: list[Polygon]) -> Hole | None:
    """R2."""
    profile = _points(said["profile"], 3)
    if str(said["type"]).upper() != "DOOR":
        return None
    flat, heights = profile[:, :2], profile[:, 2]
    far = np.hypot(*(flat[:, None] - flat[None]).transpose(2, 0, 1))
    a, b = flat[list(np.unravel_index(int(far.argmax()), far.shape))]
    thick = float(said["thickness"])
    thick = thick if 0 < thick < THICKEST_LINE_M else LINE_WALL_M
    low, top = float(heights.min()), float(heights.max())
    return door_hole(a.tolist(), b.tolist(), walls, has_door=True, bottom_m=low, top_m=top, thick_m=thick)


def _thing(said: Any) -> SourceObject | None:
    """R4."""
    word = str(said["label"])
    at, size = (_in_reach(np.array(said[key], np.float64).reshape(3)) for key in ("position", "size"))
    if (size <= 0).any():
        raise ValueError("a box without a size")
    (x1, y1, low), (x2, y2, high) = (at - size / 2).tolist(), (at + size / 2).tolist()
    hangs = low >= LOWEST_HEAD_M or (x2 - x1) * (y2 - y1) > LARGEST_THING_M2
    if hangs or any(filling in word.lower() for filling in _FILLINGS):
        return None
    return SourceObject((word,), extrude_polygon(shapely.box(x1, y1, x2, y2), low, high))
