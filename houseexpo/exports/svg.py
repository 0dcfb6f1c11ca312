"""Convert a plan to SVG at 50 pixels per metre, with a group each for free space, walls, rooms, doors, furniture."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING

import shapely

from houseexpo.drawing.draw import svg_path_data
from houseexpo.drawing.styles import FURNITURE
from houseexpo.exports.encoding import Files, format_number, valid_xml_text
from houseexpo.exports.placement import ExportFrame, Orientation, Pose, orient_plan, pose_in_export
from houseexpo.exports.plan_bodies import WALL_THICKNESS_M, wall_openings, window_openings
from houseexpo.file_kinds import STATES_WAYS
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import all_rings
from houseexpo.plan.room_labels import label_colour

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_FREE, _WALL, _DOOR, _WINDOW = "#ffffff", "#4a4a4a", "#e8e2d4", "#c3e4de"
_PIXELS_A_METRE = 50


def svg(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.svg`` with a view box in metres, x right, and y flipped to run down as in SVG.

    The house is shown as seen from above (mirrored plans are mirrored back), at 50 pixels per metre. Layers are groups:
    ``walls``, ``free-space``, ``rooms``, ``doors``, ``entrances`` and, if the plan has any, ``windows``,
    ``objects`` and ``stairwells``. Rooms and objects have their label as a title. For pictures with a scale bar and a
    legend, use ``houseexpo.svg``.
    """
    turned, pose = orient_plan(plan, orientation), pose_in_export(plan, orientation, frame)
    walls = turned.walls(wall_thickness)
    x1, y1, x2, y2 = shapely.total_bounds([pose.shape(wall) for wall in walls]).tolist()
    entrances = [each for each in wall_openings(turned, wall_thickness) if each.door.kind == "entrance"]
    box = f"{format_number(x1)} {format_number(-y2)} {format_number(x2 - x1)} {format_number(y2 - y1)}"
    wide, high = format_number((x2 - x1) * _PIXELS_A_METRE), format_number((y2 - y1) * _PIXELS_A_METRE)
    size = f'width="{wide}" height="{high}" viewBox="{box}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} data-{STATES_WAYS}="true">',
        f"<title>{escape(plan.id)}</title>",
        *_layer(pose, "walls", [(wall, _WALL, "wall") for wall in walls]),
        *_layer(pose, "free-space", [(turned.free_space, _FREE, "free space")]),
        *_layer(pose, "rooms", [(room.polygon, label_colour(room.label), room.label) for room in turned.rooms]),
        *_layer(pose, "doors", [(door.polygon, _DOOR, door.kind) for door in turned.doors if door.kind != "entrance"]),
        *_layer(pose, "entrances", [(each.shape, _DOOR, each.door.kind) for each in entrances]),
        *_layer(pose, "windows", [(each.shape, _WINDOW, "window") for each in window_openings(turned, wall_thickness)]),
        *_layer(pose, "objects", [(thing.polygon, FURNITURE, thing.label) for thing in turned.furniture]),
        *_layer(pose, "stairwells", [(thing.polygon, FURNITURE, thing.label) for thing in turned.stairwells]),
        "</svg>\n",
    ]
    return {f"{plan.id}.svg": "\n".join(lines).encode()}


def _layer(pose: Pose, name: str, parts: Iterable[tuple[BaseGeometry, str, str]]) -> list[str]:
    paths = [
        f'<path fill="{fill}" fill-rule="evenodd" d="{_path(pose.shape(shape))}">'
        f"<title>{escape(valid_xml_text(title))}</title></path>"
        for shape, fill, title in parts
    ]
    return [f'<g id="{name}">', *paths, "</g>"] if paths else []


def _path(shape: BaseGeometry) -> str:
    """Return the rings as closed subpaths, with y down."""
    return svg_path_data((ring * (1.0, -1.0) for ring in all_rings(shape)), format_number)
