"""Read an indoor map of the Indoor Mapping Data Format (IMDF): units, openings and levels, as a folder or as a zip.

Format: Apple's IMDF 1.0.0, an OGC community standard. An archive has one GeoJSON collection for each type of feature
(``unit.geojson``, ``opening.geojson``, ``level.geojson``, ``fixture.geojson``); each feature names its type in
``feature_type``. Coordinates are degrees.

R1  A unit is a room, unless its category says what it is made of (``structure``, ``glass``, ``column``, ...), which is
    wall, or that nobody goes there (``nonpublic``, ``opentobelow``), which is neither.
R2  A room is named by its name where that is the name of a room, else by its category.
R3  Units may lie in one another: a room ends where a smaller unit or a wall begins. What lies between and around the
    rooms, up to the thickness of a wall, is wall.
R4  An opening is a door if its ``door`` says so, and an opening without a leaf else. Fixtures and kiosks are furniture.
R5  Levels are sorted by their ordinal; without ``level.geojson``, by their ids. Units of no level are one level.
R6  A unit with an opening in its edge has a wall where it touches others. A walkway has none of its own: from there one
    goes on into what has no openings.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString, Polygon

from houseexpo.plan.room_labels import canonical
from pipeline.geometry.areas import polygons_of
from pipeline.geometry.prisms import extrude_polygon
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import Wall, unite_rooms, walls_around
from pipeline.sources.files import LARGEST_BYTES, LeftOutParts, archive_members, read_member
from pipeline.sources.roles import labels_for
from pipeline.sources.tolerances import LEFTOVER_M2, STOREY_HEIGHT_M, WALL_HEIGHT_M
from pipeline.sources.vector_plans.drawing import (
    Drawing,
    DrawnStorey,
    Point,
    door_hole,
    named_room,
    walls_between_rooms,
)
from pipeline.sources.vector_plans.geojson import (
    decode_collection,
    degrees_to_metres,
    read_collection,
    shape_of,
    simple_parts,
)
from pipeline.sources.vector_plans.named_features import ROOM_FUNCTIONS
from pipeline.tolerances import BESIDE_M
from pipeline.values import SourceObject, SourceRoom

UNITS: Final = "unit.geojson"
PARTS: Final = frozenset(
    {
        "address.geojson",
        "amenity.geojson",
        "anchor.geojson",
        "building.geojson",
        "detail.geojson",
        "facility.geojson",
        "fixture.geojson",
        "footprint.geojson",
        "geofence.geojson",
        "kiosk.geojson",
        "level.geojson",
        "occupant.geojson",
        "opening.geojson",
        "relationship.geojson",
        "section.geojson",
        "venue.geojson",
    }
)
"""The other files of an archive, which hold no rooms."""
_READ: Final = ("opening.geojson", "level.geojson", "fixture.geojson", "kiosk.geojson")
_WALLS: Final = frozenset({"brick", "column", "concrete", "drywall", "glass", "structure", "wood"})
_WALKWAYS: Final = frozenset({"walkway", "footbridge", "movingwalkway", "walkway.island"})
_NO_ROOMS: Final = frozenset({"nonpublic", "opentobelow", "vegetation"})
_FIXTURE_M: Final = 1.0
_UNIT = re.compile(rb'"feature_type"\s*:\s*"unit"')
_ADVICE = "export the archive again"


@dataclass
class _Level:
    """What is drawn on a level, in the file's units."""

    rooms: list[tuple[Any, Mapping[str, Any]]] = field(default_factory=list)
    walls: list[Any] = field(default_factory=list)
    openings: list[tuple[Any, bool]] = field(default_factory=list)
    fixtures: list[tuple[Any, str]] = field(default_factory=list)

    @property
    def shapes(self) -> list[Any]:
        return [*(shape for shape, _ in self.rooms), *self.walls]


def can_read(path: Path, head: bytes) -> bool:
    """By the type of its features; a zip by the file of its units."""
    if path.suffix.lower() in {".geojson", ".json"}:
        return _UNIT.search(head) is not None
    if not head.startswith(b"PK\x03\x04") or path.suffix.lower() not in {".zip", ".imdf"}:
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return any(_file_name(name) == UNITS for name in archive.namelist())
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        return False


def is_part_of_archive(path: Path) -> bool:
    """Return whether a file is one of an archive's that lie beside the file of its units and hold no rooms."""
    return path.name.lower() in PARTS and path.with_name(UNITS).is_file()


def read_drawing(path: Path) -> Drawing:
    """Read an archive, or the file of its units with those beside it.

    Raises
    ------
    Rejection
        UNREADABLE or TOO_LARGE where a file is no GeoJSON, NO_LEVEL where no unit is a room.
    """
    left_out = LeftOutParts()
    levels: dict[str, _Level] = {}
    order: dict[str, float] = {}
    for name, features in _features(path):
        for number, feature in enumerate(features):
            if not _sort_in(feature, levels, order):
                left_out.add(f"{name}: feature {number} cannot be read")
    drawn = {name: level for name, level in levels.items() if level.rooms}
    if not drawn:
        raise Rejection("source", Reason.NO_LEVEL, f"{path.name}: expected units that are rooms, found none", _ADVICE)
    to_metres = degrees_to_metres([shape for level in drawn.values() for shape in level.shapes])
    names = sorted(drawn, key=lambda name: (order.get(name, 0.0), name))
    storeys = [_storey(drawn[name], to_metres, STOREY_HEIGHT_M * number) for number, name in enumerate(names)]
    return Drawing("imdf", tuple(storeys), left_out)


def _features(path: Path) -> Iterator[tuple[str, list[Any]]]:
    """Yield the name and the features of each file that is read; raise Rejection if one is too large or damaged."""
    if path.suffix.lower() in {".geojson", ".json"}:
        beside = [path.with_name(name) for name in _READ] if path.name.lower() == UNITS else []
        for file in [path, *(each for each in beside if each.is_file() and not each.is_symlink())]:
            yield file.name, read_collection(file).features
        return
    for name in archive_members(path):
        if _file_name(name) in {UNITS, *_READ} and (data := read_member(path, (name,), LARGEST_BYTES)) is not None:
            yield name, decode_collection(data, name).features


def _file_name(member: str) -> str:
    """Return the lower-case name of a file of a zip; "" for what a Mac adds."""
    parts = member.split("/")
    return "" if "__MACOSX" in parts or parts[-1].startswith(".") else parts[-1].lower()


def _sort_in(feature: Any, levels: dict[str, _Level], order: dict[str, float]) -> bool:
    """R1, R4: put a feature where it belongs; return False if it cannot be read."""
    if not isinstance(feature, dict):
        return False
    found = feature.get("properties")
    about: Mapping[str, Any] = found if isinstance(found, dict) else {}
    kind, category = str(feature.get("feature_type", "")), str(about.get("category") or "").lower()
    if kind == "level":
        ordinal = about.get("ordinal")
        order[str(feature.get("id", ""))] = float(ordinal) if isinstance(ordinal, int | float) else 0.0
        return True
    if kind not in {"unit", "opening", "fixture", "kiosk"} or (kind == "unit" and category in _NO_ROOMS):
        return True
    shape = shape_of(feature)
    if shape is None:
        return False
    level = levels.setdefault(str(about.get("level_id") or ""), _Level())
    if kind == "opening":
        level.openings.append((shape, isinstance(about.get("door"), dict)))
    elif kind != "unit":
        level.fixtures.append((shape, category or kind))
    elif category in _WALLS:
        level.walls.append(shape)
    else:
        level.rooms.append((shape, about))
    return True


def _storey(level: _Level, to_metres: Any, height_m: float) -> DrawnStorey:
    def areas(shape: Any) -> list[Polygon]:
        flat = [shapely.make_valid(part) for part in simple_parts(shapely.transform(shape, to_metres))]
        return [area for part in flat for area in polygons_of(part) if area.area > LEFTOVER_M2]

    drawn = [wall for shape in level.walls for wall in areas(shape)]
    ways = [(ends, leaf) for shape, leaf in level.openings for ends in _lines(shapely.transform(shape, to_metres))]
    units = [(area, about) for shape, about in level.rooms for area in areas(shape)]
    drawn += _walls_between(units, [ends for ends, _ in ways])
    rooms = list(_rooms(units, drawn))
    shapes = [room.polygon for room in rooms if room.polygon is not None]
    walls = [wall.shape for wall in walls_around(shapes, WALL_HEIGHT_M)] + drawn
    holes = [hole for (a, b), leaf in ways if (hole := door_hole(a, b, walls, has_door=leaf)) is not None]
    furniture = [(area, word) for shape, word in level.fixtures for area in areas(shape)]
    return DrawnStorey(
        walls=tuple(Wall(wall, 0.0, WALL_HEIGHT_M) for wall in walls),
        holes=tuple(holes),
        rooms=tuple(rooms),
        floor=unite_rooms([*shapes, *(hole.shape for hole in holes)]),
        furniture=tuple(SourceObject((word,), extrude_polygon(area, 0.0, _FIXTURE_M)) for area, word in furniture),
        height_m=height_m,
        all_named=False,
    )


def _walls_between(units: list[tuple[Polygon, Mapping[str, Any]]], ways: list[tuple[Point, Point]]) -> list[Polygon]:
    """R6."""
    if not ways:
        return []
    middles = shapely.STRtree([LineString(ends).centroid for ends in ways])
    walled = [
        str(about.get("category") or "").lower() not in _WALKWAYS
        # a wall or room so near is beside it
        and len(middles.query(shapely.boundary(area), "dwithin", distance=BESIDE_M)) > 0
        for area, about in units
    ]
    return walls_between_rooms([area for area, _ in units], walled)


def _rooms(units: list[tuple[Polygon, Mapping[str, Any]]], walls: list[Polygon]) -> Iterator[SourceRoom]:
    """R2, R3."""
    taken = shapely.union_all(walls)
    for area, about in sorted(units, key=lambda each: each[0].area):
        word, labels = _name(about)
        for part in polygons_of(shapely.difference(area, taken)):
            if part.area > LEFTOVER_M2:
                yield named_room(word, part, labels=labels)
        taken = shapely.union(taken, area)


def _name(about: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """Return the word by which a unit goes, and its labels."""
    found = about.get("name")
    words = [str(each) for each in found.values() if each] if isinstance(found, dict) else []
    category = str(about.get("category") or "").lower()
    first = next((word for word in words if labels_for((word,))), "")
    if first:
        return first, labels_for((first,))
    known = ROOM_FUNCTIONS.get(category.split(".")[0])
    label = canonical(category)
    labels = (known,) if known else (label,) if label else labels_for((category.replace(".", " "),))
    return (words[0] if words else category if category != "unspecified" else ""), labels


def _lines(shape: Any) -> Iterator[tuple[Point, Point]]:
    """Yield the ends of each line of an opening."""
    for part in simple_parts(shape):
        ends = shapely.get_coordinates(part)
        if part.geom_type == "LineString" and len(ends) > 1 and np.isfinite(ends).all():
            yield (float(ends[0][0]), float(ends[0][1])), (float(ends[-1][0]), float(ends[-1][1]))
