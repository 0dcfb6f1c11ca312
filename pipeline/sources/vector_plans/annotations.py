"""Read annotations of panoramas as rooms and doors: Structured3D (``annotation_3d.json``), ZInD (``zind_data.json``).

Formats: bertjiazheng/Structured3D, data_organization.md (junctions, lines, planes, semantics, planeLineMatrix,
lineJunctionMatrix; millimetres, z up); ZInD as its readers describe it (scale_meters_per_coordinate and redraw, a
floor's rooms with vertices, doors, openings, windows and pins). Both draw rooms at the faces of their walls.

R1  A Structured3D room is its floor plane: the lines of that plane close its polygon. A door is the plan area of its
    planes. ``outwall`` and windows are passed over.
R2  A ZInD room is a polygon of ``redraw``; a pin in it names it. A door is a line, which may be in both of its rooms.
R3  A ZInD floor without a scale takes the one that makes its median door DOOR_WIDTH_M wide, and the plan says that it
    is a guess.
R4  A room or door that cannot be read is left out, with a note.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString, Polygon

from pipeline.geometry.areas import polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import PART_FAULTS, LeftOutParts, read_json_object
from pipeline.sources.tolerances import DOOR_WIDTH_M, FILE_GRID_M, LOOP_M2, NARROWEST_DOOR_M, STOREY_HEIGHT_M
from pipeline.sources.vector_plans.drawing import Drawing, DrawnStorey, Feature, Point, area_from_ring
from pipeline.sources.vector_plans.named_features import storey_from_features
from pipeline.tolerances import MM_M

_NO_ROOMS: Final = frozenset({"door", "window", "outwall", "outdoor"})
_ADVICE = "copy it again from the data set"


def can_read(path: Path, head: bytes) -> bool:
    """By the keys that only they have."""
    if path.suffix.lower() != ".json":
        return False
    structured = path.name.lower().startswith("annotation_3d") or (b'"junctions"' in head and b'"lineID"' not in head)
    return (
        (structured and b"{" in head)
        or path.name.lower() == "zind_data.json"
        or b'"scale_meters_per_coordinate"' in head
    )


def read_drawing(path: Path) -> Drawing:
    """Read an annotation; raise Rejection if it cannot be read or has no room."""
    found = read_json_object(path, _ADVICE)
    left_out = LeftOutParts()
    if "redraw" in found or "scale_meters_per_coordinate" in found:
        return _zind(found, path, left_out)
    return Drawing("structured3d", (_structured3d(found, path, left_out),), left_out)


def _structured3d(found: Mapping[str, Any], path: Path, left_out: LeftOutParts) -> DrawnStorey:
    """R1."""
    try:
        points = np.array([each["coordinate"] for each in found["junctions"]], np.float64).reshape(-1, 3) * MM_M
        lines = [np.flatnonzero(row) for row in found["planeLineMatrix"]]
        ends = [np.flatnonzero(row) for row in found["lineJunctionMatrix"]]
        planes, semantics = list(found["planes"]), list(found["semantics"])
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        detail = f"{path.name}: {type(error).__name__}: {str(error)[:120]}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    if not np.isfinite(points).all():
        raise Rejection("source", Reason.NOT_FINITE, f"{path.name} has a junction that is not finite", _ADVICE)

    def edges(plane: int) -> Iterator[np.ndarray]:
        yield from (points[ends[line][:2]] for line in lines[plane] if len(ends[line]) >= 2)

    def feature(said: Any) -> tuple[float, Feature] | None:
        kind, members = str(said["type"]), [int(plane) for plane in said["planeID"]]
        if kind == "door":
            area = np.concatenate([edge for plane in members for edge in edges(plane)])
            shape = shapely.convex_hull(shapely.MultiPoint(area[:, :2]))
            return math.nan, Feature("door", shape, low_m=area[:, 2].min(), top_m=area[:, 2].max())
        if kind in _NO_ROOMS:
            return None
        floor = next((plane for plane in members if planes[plane]["type"] == "floor"), None)
        if floor is None:
            raise ValueError("it has no floor")
        sides = list(edges(floor))
        room = Feature("room", _close_sides(sides), (kind,) if kind != "undefined" else ())
        return float(np.median([side[:, 2] for side in sides])), room

    drawn = list(left_out.each(semantics, "semantics", feature))
    floors = [height for height, each in drawn if each.kind == "room"]
    foot = float(np.median(floors)) if floors else 0.0
    doors = [
        replace(each, low_m=each.low_m - foot, top_m=each.top_m - foot) for _, each in drawn if each.top_m is not None
    ]
    return storey_from_features([*doors, *(each for _, each in drawn if each.kind == "room")], foot)


def _close_sides(sides: Sequence[np.ndarray]) -> Polygon:
    """Return the polygon that some edges (2, 3) close; ValueError if they close none."""
    lines = shapely.union_all([LineString(side[:, :2]) for side in sides], grid_size=FILE_GRID_M)
    areas = [part for part in shapely.get_parts(shapely.polygonize([lines])) if part.area > LOOP_M2]
    if not areas:
        raise ValueError("no area")
    return polygons_of(shapely.union_all(areas))[0]


def _zind(found: Mapping[str, Any], path: Path, left_out: LeftOutParts) -> Drawing:
    """R2, R3."""
    floors, scales = found.get("redraw"), found.get("scale_meters_per_coordinate")
    if not isinstance(floors, dict) or not floors:
        detail = f"{path.name}: expected redraw, the drawn floor plan, found none"
        raise Rejection("source", Reason.NO_LEVEL, detail, "leave the tour out")
    storeys, guessed = [], False
    for number, (name, rooms) in enumerate(sorted(floors.items())):
        if not isinstance(rooms, dict):
            left_out.add(f"floor {str(name)[:40]} cannot be read")
            continue
        doors = [
            (line, kind == "doors")
            for each in rooms.values()
            if isinstance(each, dict)
            for kind in ("doors", "openings")
            for line in _segments(each.get(kind))
        ]
        scale = scales.get(name) if isinstance(scales, dict) else None
        if not isinstance(scale, int | float) or not 0 < scale < 100:
            wide = [math.dist(*line) for line, leaf in doors if leaf]
            if not wide or not np.median(wide) > 0:
                left_out.add(f"floor {str(name)[:40]} has no scale, and no door to guess it from")
                continue
            scale, guessed = DOOR_WIDTH_M / float(np.median(wide)), True
        features = [made for key, each in rooms.items() if (made := _room(key, each, left_out)) is not None]
        for ends, leaf in doors:
            if math.dist(*ends) * scale > NARROWEST_DOOR_M:
                features.append(Feature("door" if leaf else "opening", LineString(ends)))
        storey = storey_from_features(features, STOREY_HEIGHT_M * number, float(scale))
        storeys.append(replace(storey, about={"floor_name": str(name)}))
    return Drawing("zind", tuple(storeys), left_out, ("scale",) if guessed else ())


def _room(key: str, found: Any, left_out: LeftOutParts) -> Feature | None:
    try:
        shape = area_from_ring(np.array(found["vertices"], np.float64)[:, :2])
    except PART_FAULTS:
        left_out.add(f"{key[:40]} has no polygon that can be read")
        return None
    pins = found.get("pins")
    words = [str(pin.get("label") or "") for pin in pins if isinstance(pin, dict)] if isinstance(pins, list) else []
    return Feature("room", shape, tuple(filter(None, words))[:1])


def _segments(found: Any) -> Iterator[tuple[Point, Point]]:
    """Lines from pairs of points, or, flat, from triples of two points and a pair of heights."""
    if not isinstance(found, list) or not found:
        return
    try:
        pairs = np.array(found, np.float64)
    except (TypeError, ValueError, OverflowError):
        return
    if pairs.ndim == 3 and pairs.shape[1] >= 2 and pairs.shape[2] >= 2:
        ends = pairs[:, :2, :2]
    elif pairs.ndim == 2 and len(pairs) % 3 == 0 and pairs.shape[1] == 2:
        ends = pairs.reshape(-1, 3, 2)[:, :2]
    else:
        return
    for a, b in ends[np.isfinite(ends).all(axis=(1, 2))].tolist():
        yield (a[0], a[1]), (b[0], b[1])
