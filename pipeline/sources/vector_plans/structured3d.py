"""Read an annotation of Structured3D (``annotation_3d.json``): rooms by their floor planes, and the doors between them.

Format: bertjiazheng/Structured3D, data_organization.md (junctions, lines, planes, semantics, planeLineMatrix,
lineJunctionMatrix; millimetres, z up). Rooms are drawn at the faces of their walls.

R1  A room is its floor plane: the lines of that plane close its polygon. A door is the plan area of its planes.
    ``outwall`` and windows are passed over.
R2  A room or door that cannot be read is left out, with a note.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString, Polygon

from pipeline.geometry.areas import polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import LeftOutParts, read_json_object
from pipeline.sources.tolerances import FILE_GRID_M, LOOP_M2
from pipeline.sources.vector_plans.drawing import Drawing, Feature
from pipeline.sources.vector_plans.named_features import storey_from_features
from pipeline.tolerances import MM_M

_NO_ROOMS: Final = frozenset({"door", "window", "outwall", "outdoor"})
_ADVICE = "copy it again from the data set"


def can_read(path: Path, head: bytes) -> bool:
    """By its name, or by the key that only it has."""
    if path.suffix.lower() != ".json":
        return False
    named = path.name.lower().startswith("annotation_3d") or (b'"junctions"' in head and b'"lineID"' not in head)
    return named and b"{" in head


def read_drawing(path: Path) -> Drawing:
    """Read an annotation (R1); raise Rejection if it cannot be read or has no room."""
    found = read_json_object(path, _ADVICE)
    left_out = LeftOutParts()
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
    storey = storey_from_features([*doors, *(each for _, each in drawn if each.kind == "room")], foot)
    return Drawing("structured3d", (storey,), left_out)


def _close_sides(sides: Sequence[np.ndarray]) -> Polygon:
    """Return the polygon that some edges (2, 3) close; ValueError if they close none."""
    lines = shapely.union_all([LineString(side[:, :2]) for side in sides], grid_size=FILE_GRID_M)
    areas = [part for part in shapely.get_parts(shapely.polygonize([lines])) if part.area > LOOP_M2]
    if not areas:
        raise ValueError("no area")
    return polygons_of(shapely.union_all(areas))[0]
