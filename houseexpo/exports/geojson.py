"""Convert a plan to GeoJSON in metres: free space, walls, rooms, doors, furniture and label boxes as features."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import shapely

from houseexpo.exports.encoding import Files, compact_json
from houseexpo.exports.placement import (
    ExportFrame,
    Orientation,
    default_frame,
    orient_plan,
    pose_in_export,
    world_from_plan,
)
from houseexpo.exports.plan_bodies import WALL_THICKNESS_M, wall_openings, window_openings
from houseexpo.file_kinds import STATES_WAYS
from houseexpo.floorplan import FloorPlan

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_METRES: Final = 'LOCAL_CS["floor plan",UNIT["metre",1],AXIS["x",EAST],AXIS["y",NORTH]]'
"""A coordinate system that is not on Earth, in a form that GDAL 2 and later read."""


def geojson(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.geojson``: one FeatureCollection, in which ``properties.kind`` is the kind of a feature.

    Kinds are ``free_space`` (one), ``wall``, ``room`` (``room``: its id, ``label``, ``source_labels``, ``area``),
    ``door`` (``door``: its id, ``door_kind``, ``width``, ``rooms``), ``window`` (``window``: its id, ``width``,
    ``rooms``, and ``sill`` and ``head``, metres or null), ``object`` and ``stairwell`` (``object``: its id, ``label``,
    ``room``, ``height``), and ``label_box`` (as published; these boxes extend into walls). An entrance and a window are
    as deep as the wall is drawn.

    Coordinates are x and y in metres (mirrored plans are mirrored back), not degrees. ``crs`` declares this
    to GDAL, GeoPandas and QGIS, which otherwise interpret coordinates as longitudes and latitudes. The collection's
    ``properties`` are the plan's id, its ``quality`` (the score and its ``grounds``, or null), the ``frame``
    of the coordinates, "source" or "plan", the matrix ``world_from_plan``, and ``states_ways``: true, since
    the doors are all ways between rooms. Rings follow the right-hand rule.
    """
    turned, pose = orient_plan(plan, orientation), pose_in_export(plan, orientation, frame)
    collection = {
        "type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": _METRES}},
        "properties": {
            "id": plan.id,
            "units": "m",
            "rooms": len(plan.rooms),
            "source_rooms": plan.room_num,
            "quality": None
            if plan.quality is None
            else {"score": plan.quality.score, "grounds": dict(plan.quality.grounds)},
            "world_from_plan": world_from_plan(plan, orientation, frame),
            "frame": frame or default_frame(plan),
            STATES_WAYS: True,
        },
        "features": [_feature(pose.shape(shape), kind, about) for shape, kind, about in _parts(turned, wall_thickness)],
    }
    return {f"{plan.id}.geojson": compact_json(collection)}


def _parts(plan: FloorPlan, wall_thickness: float) -> Iterator[tuple[BaseGeometry, str, dict[str, Any]]]:
    """Yield the shape, the kind and the other properties of each feature."""
    yield plan.free_space, "free_space", {"area": round(plan.area, 4)}
    for wall in plan.walls(wall_thickness):
        yield wall, "wall", {}
    for room in plan.rooms:
        about = {"room": room.id, "label": room.label, "source_labels": list(room.source_labels)}
        yield room.polygon, "room", {**about, "area": round(room.area, 4)}
    for each in wall_openings(plan, wall_thickness):
        door = each.door
        about = {"door": door.id, "door_kind": door.kind, "width": door.width, "rooms": list(door.rooms)}
        yield each.shape, "door", about
    for each in window_openings(plan, wall_thickness):
        window = each.door
        about = {"window": window.id, "width": window.width, "rooms": list(window.rooms)}
        yield each.shape, "window", {**about, "sill": window.sill, "head": window.head}
    for thing in plan.objects:
        about = {"object": thing.id, "label": thing.label, "room": thing.room, "height": thing.height}
        yield thing.polygon, "stairwell" if thing.is_stairwell else "object", about
    for label, boxes in plan.room_category.items():
        for box in boxes:
            yield shapely.box(*box), "label_box", {"label": label}


def _feature(shape: BaseGeometry, kind: str, properties: dict[str, Any]) -> dict[str, Any]:
    rounded = shapely.transform(shapely.orient_polygons(shape), lambda points: points.round(4))
    return {
        "type": "Feature",
        "properties": {"kind": kind, **properties},
        "geometry": shapely.geometry.mapping(rounded),
    }
