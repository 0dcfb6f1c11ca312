"""Read GeoJSON of walls, rooms and doors: our own export, and what else names its features so.

R1  A feature is what its ``kind``, ``type``, ``class``, ``category``, ``feature_type`` or ``layer`` says, or where it
    has none of these, its ``name``. Others are passed over, but a person can see their lines.
R2  Coordinates are metres where ``crs`` says so, or where they are no degrees; degrees become metres about the middle.
    What is neither, and larger than any site, is in centimetres or millimetres, whichever makes the areas as large as
    rooms; the plan says that this is a guess.
R3  ``level``, ``level_id``, ``floor`` or ``floor_id`` divides storeys.
R4  In a file without walls, areas that are called by the function of a room (classroom, retail) are rooms. Where these
    and rooms are half of the areas that are called anything, all are rooms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import shapely
from shapely import Polygon

from houseexpo.file_kinds import STATES_WAYS
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import LeftOutParts, decode_document, read_bytes
from pipeline.sources.roles import labels_for
from pipeline.sources.tolerances import (
    DRAWING_M,
    EARTH_M,
    HIGHEST_BUILDING_M,
    LONGEST_SITE_M,
    STOREY_HEIGHT_M,
    USUAL_ROOM_M2,
)
from pipeline.sources.vector_plans.drawing import Drawing, Feature, Floats, Line
from pipeline.sources.vector_plans.named_features import (
    ToMetres,
    function_of_room,
    kind_from_name,
    lines_of_features,
    simple_parts,
    storey_from_features,
)

_KEYS: Final = ("kind", "type", "class", "category", "feature_type", "layer", "indoor")
_LEVELS: Final = ("level", "level_id", "floor", "floor_id", "floorId", "levelId", "storey")
_UNITS: Final = (0.01, 0.001)
_OWN_MARKS: Final = frozenset({"label_box", "free_space"})
"""Kinds of our export that are neither walls nor rooms."""
_ADVICE = "export it again as GeoJSON"
_FAULTS = (
    KeyError,
    TypeError,
    ValueError,
    OverflowError,
    RecursionError,
    AttributeError,
    IndexError,
    shapely.errors.ShapelyError,
)
"""The errors that an invalid geometry raises."""


class _Collection(msgspec.Struct):
    features: list[Any]
    type: str = ""
    properties: Any = None
    crs: Any = None


_DECODER = msgspec.json.Decoder(_Collection)


def can_read(path: Path, head: bytes) -> bool:
    """By its name, or by its type."""
    return path.suffix.lower() == ".geojson" or (path.suffix.lower() == ".json" and b'"FeatureCollection"' in head)


def read_drawing(path: Path) -> Drawing:
    """Read a collection; raise Rejection if it cannot be read or no feature is called wall or room."""
    found = read_collection(path)
    left_out = LeftOutParts()
    levels: dict[str, list[Feature]] = {}
    known = _with_rooms_by_function([(number, each, _kind(each)) for number, each in enumerate(found.features)])
    named = [each for each in known if each[2] or not isinstance(each[1], dict)]
    for (number, feature, kind), shape in zip(named, _shapes_of([feature for _, feature, _ in named]), strict=True):
        if shape is None:
            left_out.add(f"feature {number} has no geometry that can be read")
        else:
            about = _properties(feature)
            levels.setdefault(_level(about), []).append(_feature(kind, shape, about))
    shapes = [each.shape for level in levels.values() for each in level]
    if not shapes:
        detail = f"{path.name}: expected features that are called wall or room, found none of {len(found.features)}"
        raise Rejection("source", Reason.NO_LEVEL, detail, f"name them by one of {', '.join(_KEYS)}")
    to_metres, guesses = _to_metres(shapes, found.crs)
    for name, other in _features_passed_over(known):
        if name in levels:
            levels[name].append(other)
    storeys = [
        storey_from_features(level, STOREY_HEIGHT_M * n, to_metres)
        for n, (_, level) in enumerate(sorted(levels.items()))
    ]
    about = found.properties if isinstance(found.properties, dict) else {}
    return Drawing("geojson", tuple(storeys), left_out, guesses, all_ways=about.get(STATES_WAYS) is True)


def drawn_lines(path: Path, key: str = "") -> list[Line]:  # noqa: ARG001
    """Return the lines of all features, metres, whatever they are called; none if the file is damaged."""
    try:
        found = read_collection(path)
    except Rejection:
        return []
    every = [feature for *_, feature in _features_passed_over([(0, each, "") for each in found.features])]
    if not every:
        return []
    return lines_of_features(every, _to_metres([each.shape for each in every], found.crs)[0])


_Known = list[tuple[int, Any, str]]
"""Number, feature and kind of each feature."""


def _with_rooms_by_function(known: _Known) -> _Known:
    """Take areas that are called by a room's function as rooms, in a file without walls."""
    if any(kind == "wall" for _, _, kind in known):
        return known
    said = [_word_of_area(feature) for _, feature, _ in known]
    by_function = [function_of_room(word) is not None if word else False for word in said]
    rooms = sum(kind == "room" or (not kind and found) for (*_, kind), found in zip(known, by_function, strict=True))
    are_all = 2 * rooms >= sum(bool(word) for word in said)
    return [
        (number, feature, "room" if not kind and word and (found or (rooms and are_all)) else kind)
        for (number, feature, kind), word, found in zip(known, said, by_function, strict=True)
    ]


def _features_passed_over(known: _Known) -> Iterator[tuple[str, Feature]]:
    """Yield the level and the lines of each feature that is neither read nor a mark of our own export."""
    for _, feature, kind in known:
        if kind or not isinstance(feature, dict):
            continue
        about = _properties(feature)
        words = [str(each) for key in _keys_of(about) if (each := about.get(key))]
        shape = None if _OWN_MARKS & set(words) else shape_of(feature)
        if shape is not None:
            yield _level(about), Feature("other", shape, tuple(words) or ("feature",))


def _word_of_area(feature: Any) -> str:
    """Return what an area is called; "" for other features, and for those that have no word."""
    geometry = feature.get("geometry") if isinstance(feature, dict) else None
    if not isinstance(geometry, dict) or geometry.get("type") not in {"Polygon", "MultiPolygon"}:
        return ""
    about = _properties(feature)
    word = next((each for key in _keys_of(about) if isinstance(each := about.get(key), str)), "")
    return "" if word in _OWN_MARKS else word


def _properties(feature: Any) -> Mapping[str, Any]:
    found = feature.get("properties") if isinstance(feature, dict) else None
    return found if isinstance(found, dict) else {}


def _kind(feature: Any) -> str:
    """Return the kind of a feature, or "" for what is passed over (R1)."""
    if not isinstance(feature, dict):
        return ""
    about = _properties(feature)
    said = [str(about.get(key, "")) for key in _keys_of(about)]
    said += [str(feature.get(key, "")) for key in _KEYS if key != "type"]
    if any(word in _OWN_MARKS for word in said):
        return ""
    return next((each for word in said if (each := kind_from_name(word))), "")


def _keys_of(about: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the keys that say what a feature is (R1)."""
    return _KEYS if any(key in about for key in _KEYS) else ("name",)


def _shapes_of(features: list[Any]) -> list[Any]:
    """Return ``shape_of`` each feature; polygons are made all together, which takes a fifth of the time."""
    geometries: list[Any] = [each.get("geometry") if isinstance(each, dict) else None for each in features]
    polygons = [k for k, each in enumerate(geometries) if isinstance(each, dict) and each.get("type") == "Polygon"]
    try:
        made = dict(zip(polygons, _polygons([geometries[k]["coordinates"] for k in polygons]), strict=True))
    except _FAULTS:  # one of them is not a valid geometry, or has heights
        made = {}
    return [made[k] if k in made else shape_of(feature) for k, feature in enumerate(features)]


def _polygons(given: list[list[list[Any]]]) -> list[Polygon]:
    """Return polygons of their rings, lists of points in two dimensions; raise one of ``_FAULTS`` if there is other."""
    rings = [ring for polygon in given for ring in polygon]
    points = np.array([point for ring in rings for point in ring], np.float64).reshape(-1, 2)
    if len(points) != sum(map(len, rings)) or not all(given) or not np.isfinite(points).all():
        raise ValueError
    of_ring, of_polygon = (np.repeat(np.arange(len(each)), [len(part) for part in each]) for each in (rings, given))
    return list(shapely.polygons(shapely.linearrings(points, indices=of_ring), indices=of_polygon))


def shape_of(feature: Mapping[str, Any]) -> Any:
    """Return the geometry of a feature in two dimensions, or None if it cannot be read."""
    try:
        shape = shapely.geometry.shape(feature["geometry"])
    except _FAULTS:
        return None
    coordinates = shapely.get_coordinates(shape)
    if not len(coordinates) or not np.isfinite(coordinates).all():
        return None
    return shapely.force_2d(shape) if shape.has_z else shape


def read_collection(path: Path) -> _Collection:
    """Return the collection of a file; raise Rejection if it is too large or not a collection."""
    return decode_collection(read_bytes(path, "expected a plan"), path.name)


def decode_collection(data: bytes, name: str) -> _Collection:
    """Return the collection in the bytes of a file; raise Rejection if it is not a collection."""
    return decode_document(_DECODER, data, name, _ADVICE)


def _level(about: Mapping[str, Any]) -> str:
    """Return the storey that a feature's properties name, "" for none."""
    return next((str(about[key]) for key in _LEVELS if about.get(key) is not None), "")


def _to_metres(shapes: list[Any], crs: Any) -> tuple[float | ToMetres, tuple[str, ...]]:
    """Return the unit, or the function that turns points into metres, and what was guessed."""
    x1, y1, x2, y2 = shapely.total_bounds(shapes).tolist()
    said = str(crs)
    in_metres = "metre" in said or "LOCAL_CS" in said
    long = max(x2 - x1, y2 - y1)
    if in_metres or long <= 0:
        return 1.0, ()
    if max(abs(x1), abs(x2)) <= 180 and max(abs(y1), abs(y2)) <= 90 and long < 0.5:
        return degrees_to_metres(shapes), ()
    areas = [part.area for shape in shapes for part in simple_parts(shape) if part.area > 0]
    fits = [unit for unit in _UNITS if long * unit <= DRAWING_M[1]]
    if long > LONGEST_SITE_M and areas and fits:
        usual = math.sqrt(float(np.median(areas)) / USUAL_ROOM_M2)  # a room is about as large
        unit = min(fits, key=lambda each: abs(math.log(each * usual)))
        return unit, ("units",)
    return 1.0, ()


def degrees_to_metres(shapes: list[Any]) -> ToMetres:
    """Return the function that turns points in degrees into metres about the middle of some shapes."""
    x1, y1, x2, y2 = shapely.total_bounds(shapes).tolist()
    at = np.radians([(x1 + x2) / 2, (y1 + y2) / 2])
    factor = np.array([EARTH_M * math.cos(float(at[1])), EARTH_M])

    def to_metres(points: Floats) -> Floats:
        return np.asarray((np.radians(points) - at) * factor)

    return to_metres


def _feature(kind: str, shape: Any, about: Mapping[str, Any]) -> Feature:
    if kind == "room":
        label = str(about.get("label") or "")
        said = about.get("source_labels") or [about.get("name") or about.get("room_type") or label]
        words = tuple(_word(each) for each in (said if isinstance(said, list) else [said]) if each)
        function = next((function_of_room(each) or "" for key in _keys_of(about) if (each := about.get(key))), "")
        exact = next(iter(labels_for(words)), "") if function == "Room" else ""
        return Feature("room", shape, words, (label or exact or function,))
    if kind == "object":
        high = about.get("height")
        top = float(high) if isinstance(high, int | float) and 0 < high < HIGHEST_BUILDING_M else None
        return Feature("object", shape, (str(about.get("label") or "object"),), top_m=top)
    if kind == "door" and about.get("door_kind") in {"opening", "cut"}:
        return Feature("opening", shape)
    if kind == "window":
        low, high = about.get("sill"), about.get("head")
        if isinstance(low, int | float) and isinstance(high, int | float) and low < high < HIGHEST_BUILDING_M:
            return Feature(kind, shape, low_m=float(low), top_m=float(high))
    return Feature(kind, shape)


def _word(value: Any) -> str:
    """IMDF's names are mappings of languages."""
    return str(next(iter(value.values()), "")) if isinstance(value, dict) else str(value)
