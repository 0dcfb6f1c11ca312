"""A plan as plain values for the page that draws it: rings in metres, colours, words and where they stand."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from houseexpo.analysis.geodesic import shortest_way
from houseexpo.analysis.navigability import navigability, standing_pieces, straightened
from houseexpo.analysis.walls import walls_around
from houseexpo.drawing.scene import DOOR_COLOURS
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import rings_of
from houseexpo.plan import Room
from houseexpo.plan.categories import colour

WIDEST_M: Final = 2.0
"""The largest robot, its radius in metres."""

_WALL_M: Final = 0.12
_FIELD_PX: Final = 480
_SNAP_M: Final = 1.5  # a click in a wall means the place beside it
_DIGITS: Final = 3


def drawn(plan: FloorPlan) -> dict[str, Any]:
    """Return what a plan records, as rings; and its walls."""
    x1, y1, x2, y2 = plan.free_space.bounds
    return {
        "id": plan.id,
        "bounds": [x1, y1, x2, y2],
        "space": _rings(plan.free_space),
        "walls": [ring for wall in walls_around(straightened(plan.floor), _WALL_M) for ring in _rings(wall)],
        "boxes": [
            {"label": label, "colour": colour(label), "box": list(box)}
            for label, found in plan.room_category.items()
            for box in found
        ],
        "objects": [
            {"label": thing.label, "height": thing.height, "rings": _points([thing.ring])} for thing in plan.objects
        ],
        "frame": None if plan.frame is None else {"matrix": plan.frame.matrix, "up": plan.frame.up},
        **divided(plan),
    }


def divided(plan: FloorPlan) -> dict[str, Any]:
    """Return the rooms and doors of a plan, as rings."""
    rooms = [
        {
            "id": room.id,
            "label": room.label.replace("_", " "),
            "area": room.area,
            "colour": colour(room.label),
            "rings": _points([room.ring, *room.holes]),
            "at": _middle(room.polygon),
            **_unfurnished(room, plan),
        }
        for room in plan.rooms
    ]
    doors = [
        {
            "id": door.id,
            "kind": door.kind,
            "width": door.width,
            "rooms": list(door.rooms),
            "colour": DOOR_COLOURS[door.kind],
            "segment": [list(end) for end in door.segment],
            "rings": _points([door.ring]),
        }
        for door in plan.doors
    ]
    return {"rooms": rooms, "doors": doors}


def reached(plan: FloorPlan, radius_m: float) -> dict[str, Any]:
    """Return where a disc's centre can stand, piece by piece, the biggest first, and what the disc covers there."""
    import shapely

    pieces = standing_pieces(plan.free_space, radius_m)
    found = navigability(plan, (radius_m,))[f"{radius_m:.2f}"]
    covered = (shapely.intersection(piece.buffer(radius_m), plan.free_space) for piece in pieces)
    return {
        "radius": radius_m,
        "components": found.components,
        "largest_share": found.largest_share,
        "narrowest": found.narrowest,
        "pieces": [
            {"area": round(piece.area, 2), "stands": _rings(piece), "covers": _rings(cover)}
            for piece, cover in zip(pieces, covered, strict=True)
        ],
    }


def way(plan: FloorPlan, start: tuple[float, float], goal: tuple[float, float], radius_m: float) -> dict[str, Any]:
    """Return the shortest way of a disc between two places; a place too near to a wall moves to the nearest it fits."""
    import shapely

    pieces = standing_pieces(plan.free_space, radius_m)
    ends = [shapely.Point(start), shapely.Point(goal)]
    if not pieces:
        return {"found": False, "why": "The robot fits nowhere."}
    homes = [int(np.argmin(shapely.distance(pieces, end))) for end in ends]
    if any(pieces[home].distance(end) > _SNAP_M for home, end in zip(homes, ends, strict=True)):
        return {"found": False, "why": "One of the two places is outside of the plan."}
    moved = [_nearest(pieces[home], end) for home, end in zip(homes, ends, strict=True)]
    if homes[0] != homes[1]:
        return {"found": False, "why": "No way: the robot is too wide for a passage between the two.", "ends": moved}
    found = shortest_way(pieces[homes[0]], *moved)
    if found is None:
        return {"found": False, "why": "No way between the two.", "ends": moved}
    points = found.points.round(_DIGITS).tolist()
    return {"found": True, "length": round(found.length, 2), "points": points, "ends": moved}


def clearance(plan: FloorPlan) -> dict[str, Any]:
    """Return the distance to the nearest wall as a picture (a PNG in base 64) with its bounds and its greatest value.

    Free cells run from transparent blue to opaque yellow; walls are transparent.
    """
    import cv2

    x1, y1, x2, y2 = plan.free_space.bounds
    scale = min(_FIELD_PX / max(x2 - x1, y2 - y1, 0.1), 25.0)
    metres = plan.distance_field(scale)
    frame = plan.grid_frame(scale)
    most = float(metres.max())
    share = (metres / most if most else metres)[::-1]  # a picture's first row is the highest y
    colours = cv2.applyColorMap((share * 255).astype(np.uint8), cv2.COLORMAP_VIRIDIS)
    alpha = np.where(share > 0, 200, 0).astype(np.uint8)
    _, png = cv2.imencode(".png", np.dstack([colours, alpha]))
    (left, low), (rows, cols) = frame.origin_m, frame.shape
    bounds = [left, low, left + cols / scale, low + rows / scale]
    return {"bounds": bounds, "most": round(most, 2), "png": base64.b64encode(png.tobytes()).decode()}


def _nearest(piece: Any, point: Any) -> list[float]:
    import shapely

    line = shapely.shortest_line(piece, point)
    x, y = shapely.get_coordinates(line)[0].round(_DIGITS).tolist() if line is not None else (point.x, point.y)
    return [x, y]


def _middle(shape: Any) -> list[float]:
    import shapely

    centre = shape.centroid
    if not shape.contains(centre):
        x, y = shapely.maximum_inscribed_circle(shape, tolerance=0.05).coords[0]
        return [round(x, 2), round(y, 2)]
    return [round(centre.x, 2), round(centre.y, 2)]


def _unfurnished(room: Room, plan: FloorPlan) -> dict[str, Any]:
    """Return a furnished room's rings and middle as if it were empty: its name may stand on its furniture."""
    import shapely

    things = [thing.polygon for thing in plan.objects if thing.room == room.id]
    if not things:
        return {}
    whole = shapely.union_all([room.polygon, *things])
    return {"empty": {"rings": _rings(whole), "at": _middle(whole)}}


def _rings(shape: Any) -> list[list[list[float]]]:
    return _points(rings_of(shape))


def _points(rings: Iterable[Any]) -> list[list[list[float]]]:
    return [np.asarray(ring).round(_DIGITS).tolist() for ring in rings]
