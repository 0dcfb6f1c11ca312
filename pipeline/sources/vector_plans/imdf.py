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
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import LeftOutParts, archive_members, read_member
from pipeline.sources.roles import labels_for
from pipeline.sources.tolerances import LARGEST_BYTES, STOREY_HEIGHT_M
from pipeline.sources.vector_plans.drawing import Drawing, Feature
from pipeline.sources.vector_plans.geojson import decode_collection, degrees_to_metres, read_collection, shape_of
from pipeline.sources.vector_plans.named_features import ROOM_FUNCTIONS, storey_from_features

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
_UNIT = re.compile(rb'"feature_type"\s*:\s*"unit"')
_ADVICE = "export the archive again"


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
    levels: dict[str, list[Feature]] = {}
    order: dict[str, float] = {}
    for name, features in _features(path):
        for number, feature in enumerate(features):
            if not _sort_in(feature, levels, order):
                left_out.add(f"{name}: feature {number} cannot be read")
    drawn = {name: level for name, level in levels.items() if any(each.kind == "space" for each in level)}
    if not drawn:
        raise Rejection("source", Reason.NO_LEVEL, f"{path.name}: expected units that are rooms, found none", _ADVICE)
    shapes = [each.shape for level in drawn.values() for each in level if each.kind in {"space", "wall"}]
    to_metres = degrees_to_metres(shapes)
    names = sorted(drawn, key=lambda name: (order.get(name, 0.0), name))
    storeys = [
        replace(storey_from_features(drawn[name], STOREY_HEIGHT_M * number, to_metres), all_named=False)
        for number, name in enumerate(names)
    ]
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


def _sort_in(feature: Any, levels: dict[str, list[Feature]], order: dict[str, float]) -> bool:
    """Put a feature where it belongs; return False if it cannot be read."""
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
    if kind == "opening":
        made = Feature("door" if isinstance(about.get("door"), dict) else "opening", shape)
    elif kind != "unit":
        made = Feature("object", shape, (category or kind,))
    elif category in _WALLS:
        made = Feature("wall", shape)
    else:
        word, labels = _name(about)
        walled = False if category in _WALKWAYS else None  # R6
        made = Feature("space", shape, (word,) if word else (), labels, walled=walled)
    levels.setdefault(str(about.get("level_id") or ""), []).append(made)
    return True


def _name(about: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """Return the word by which a unit goes, and its labels."""
    found = about.get("name")
    words = [str(each) for each in found.values() if each] if isinstance(found, dict) else []
    category = str(about.get("category") or "").lower()
    first = next((word for word in words if labels_for((word,))), "")
    if first:
        return first, labels_for((first,))
    known = ROOM_FUNCTIONS.get(category.split(".")[0])
    labels = (known,) if known else labels_for((category.replace(".", " "),))
    return (words[0] if words else category if category != "unspecified" else ""), labels
