"""Convert a plan to DXF for CAD programs: walls, rooms, names, doors and furniture on separate layers, in metres."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, Final

import shapely

from houseexpo.errors import MissingDependencyError, install_command
from houseexpo.exports.encoding import Files
from houseexpo.exports.placement import ExportFrame, Orientation, Pose, orient_plan, pose_in_export
from houseexpo.exports.plan_bodies import WALL_THICKNESS_M, wall_openings, window_openings
from houseexpo.file_kinds import STATES_WAYS
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import all_rings

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

LAYERS: Final = {"WALLS": 7, "ROOMS": 3, "ROOM_NAMES": 2, "DOORS": 5, "OPENINGS": 4, "ENTRANCES": 30, "FURNITURE": 8}
"""The layers, and AutoCAD's numbers of their colours."""
_LAYER_OF: Final = {"door": "DOORS", "opening": "OPENINGS", "cut": "OPENINGS", "entrance": "ENTRANCES"}
_WINDOW_COLOUR: Final = 4
_METRES: Final = 6
_TEXT_M: Final = 0.25


def dxf(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.dxf`` (R2010, units metres) with closed polylines.

    Layers: WALLS (the faces of each wall), ROOMS (one a room, holes too), ROOM_NAMES (a text in each room: its label,
    and below it the source's own words), DOORS, OPENINGS (also those that the connectivity stage cut), ENTRANCES,
    FURNITURE and, if the plan has any, WINDOWS and STAIRWELLS (the openings in the floor over stairs).

    Raises
    ------
    MissingDependencyError
        Where ezdxf is not installed.
    """
    try:
        from ezdxf._options import options
        from ezdxf.filemanagement import new
    except ImportError:
        raise MissingDependencyError(f"DXF needs ezdxf, which is not installed: {install_command('cad')}") from None
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True  # not the time at which it is written
    try:
        document = new("R2010", units=_METRES)
        document.header.custom_vars.append(STATES_WAYS, "true")
        _draw(document, orient_plan(plan, orientation), pose_in_export(plan, orientation, frame), wall_thickness)
        stream = io.StringIO()
        document.write(stream)
    finally:
        options.write_fixed_meta_data_for_testing = before
    return {f"{plan.id}.dxf": stream.getvalue().encode("utf-8", "dxfreplace")}


def _draw(document: Any, turned: FloorPlan, pose: Pose, wall_thickness: float) -> None:
    document.header["$MEASUREMENT"] = 1
    for name, colour in LAYERS.items():
        document.layers.add(name, color=colour)
    space = document.modelspace()
    doors = wall_openings(turned, wall_thickness)
    gaps = shapely.union_all([each.shape for each in doors if each.door.kind == "entrance"])
    for wall in turned.walls(wall_thickness):
        _outline(space, pose.shape(shapely.difference(wall, gaps)), "WALLS")
    for room in turned.rooms:
        _outline(space, pose.shape(room.polygon), "ROOMS")
        at = pose.shape(shapely.point_on_surface(room.polygon))
        words = [room.label, *(word for word in room.source_labels if word != room.label)]
        for line, word in enumerate(words):
            text = space.add_text(word, height=_TEXT_M, dxfattribs={"layer": "ROOM_NAMES"})
            text.set_placement((at.x, at.y - 1.6 * line * _TEXT_M))
    for each in doors:
        _outline(space, pose.shape(each.shape), _LAYER_OF[each.door.kind])
    windows = window_openings(turned, wall_thickness)
    if windows:
        document.layers.add("WINDOWS", color=_WINDOW_COLOUR)
    for each in windows:
        _outline(space, pose.shape(each.shape), "WINDOWS")
    for thing in turned.furniture:
        _outline(space, pose.shape(thing.polygon), "FURNITURE")
    if turned.stairwells:
        document.layers.add("STAIRWELLS", color=LAYERS["FURNITURE"])
    for thing in turned.stairwells:
        _outline(space, pose.shape(thing.polygon), "STAIRWELLS")


def _outline(space: Any, shape: BaseGeometry, layer: str) -> None:
    for part in shapely.get_parts(shape):
        if part.geom_type == "Polygon":
            for ring in all_rings(part):
                space.add_lwpolyline(ring.round(4).tolist(), close=True, dxfattribs={"layer": layer})
