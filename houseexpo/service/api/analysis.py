"""Serve analyses of a plan below ``/api``: shapes to draw, rooms, reach, shortest ways, clearance, similar plans.

Similar plans are found in four steps:

R1  The plans nearest in area, sides and rooms are the candidates.
R2  Fingerprints (``analysis.similarity``) give a lower bound of the difference; the smallest bounds are tried first.
R3  The difference is measured on a grid of 0.1 m, under the symmetries of the square. Plans that differ by more than
    half are not similar.
R4  A candidate that was deleted or damaged while it is shown is left out.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.analysis.graph import shortest_path
from houseexpo.analysis.navigability import disc_centre_areas, navigability
from houseexpo.analysis.similarity import (
    SHIFT_PX,
    SYMMETRIES,
    comparison_cells,
    difference_lower_bound,
    fingerprint_from_profiles,
)
from houseexpo.drawing.door_leaves import door_leaves
from houseexpo.drawing.room_names import TextLines, text_length
from houseexpo.drawing.scene import closed_walls, drawn_windows, open_places, place_words
from houseexpo.drawing.stairs import stair_lines
from houseexpo.drawing.styles import DOOR_COLOURS
from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import FEWEST_CELLS
from houseexpo.grids.raster import all_rings
from houseexpo.plan.room_labels import UNLABELLED, label_colour
from houseexpo.service.collection import OpenedDataset
from houseexpo.service.computations import compute_in_turn
from houseexpo.service.responses import json_response
from houseexpo.service.service import Service

_FARTHEST_M: Final = 1e6


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    async def respond(request: Request, measure: Callable[[FloorPlan], Any]) -> Response:
        now = service.collection(request).now
        name = now.check_id(request.path_params["plan"])
        return json_response(request, await compute_in_turn(request, lambda: measure(now.plan(name))))

    async def shape(request: Request) -> Response:
        return await respond(request, shape_values)

    async def rooms(request: Request) -> Response:
        return await respond(request, lambda plan: rooms_and_doors(plan.divided))

    async def reach(request: Request) -> Response:
        radius = round(_metres(request.query_params, "radius", 0.2, LARGEST_ROBOT_M), 2)
        return await respond(request, lambda plan: reach_values(plan, radius))

    async def way(request: Request) -> Response:
        given = request.query_params
        radius = _metres(given, "radius", 0.2, LARGEST_ROBOT_M)
        ends = _point(given, "from"), _point(given, "to")
        return await respond(request, lambda plan: way_values(plan, *ends, radius))

    async def clearance(request: Request) -> Response:
        return await respond(request, clearance_picture)

    async def similar_plans(request: Request) -> Response:
        now = service.collection(request).now
        name = now.check_id(request.path_params["plan"])
        return json_response(request, {"similar": await compute_in_turn(request, most_similar_plans, now, name)})

    of_plan = "/api/{data}/plans/{plan}/"
    areas = {
        "shape": shape,
        "rooms": rooms,
        "reach": reach,
        "way": way,
        "clearance": clearance,
        "similar": similar_plans,
    }
    return [Route(of_plan + name, function) for name, function in areas.items()]


def _metres(given: Mapping[str, str], name: str, usual: float, most: float) -> float:
    """Return a positive length from the address; raise ConfigError if it is not one."""
    word = given.get(name, "") or str(usual)
    try:
        found = float(word[:20])
    except ValueError:
        found = math.nan
    if not 0.01 <= found <= most:
        raise ConfigError(f"{name}: expected metres, 0.01 to {most:g}, found {word[:40]!r}")
    return found


def _point(given: Mapping[str, str], name: str) -> tuple[float, float]:
    """Return a point ``x,y`` from the address, metres; raise ConfigError if it is not one."""
    words = given.get(name, "")[:60].split(",")
    try:
        x, y = map(float, words)
    except ValueError:
        x = y = math.nan
    if not (abs(x) <= _FARTHEST_M and abs(y) <= _FARTHEST_M):
        raise ConfigError(f"{name}: expected a point such as 2.5,1.0 (metres), found {given.get(name, '')[:40]!r}")
    return x, y


LARGEST_ROBOT_M: Final = 2.0
"""The largest robot, its radius in metres."""

_FIELD_PX: Final = 480
"""Longer side of the picture of clearance."""
_SNAP_M: Final = 1.5
"""A click in a wall stands for a point up to this far from it."""
_WORD_SCALES: Final = tuple(round(6 * 2 ** (k / 2), 2) for k in range(10))
"""Scales for which words are placed, pixels per metre: from a hall of 100 m on a screen to a room that fills it."""
_DIGITS: Final = 3
"""Decimals of coordinates: a millimetre is invisible."""


def shape_values(plan: FloorPlan) -> dict[str, Any]:
    """Return everything that a plan records, and its walls, as rings in metres with labels and colours."""
    x1, y1, x2, y2 = plan.free_space.bounds
    house = closed_walls(plan)
    return {
        "id": plan.id,
        "bounds": [x1, y1, x2, y2],
        "space": _rings(plan.free_space),
        "walls": _rings(house.difference(plan.floor)),
        "open": [ring for place, _ in open_places(plan, house) for ring in _rings(place)],
        "boxes": [
            {"label": label, "colour": label_colour(label), "box": list(box)}
            for label, found in plan.room_category.items()
            for box in found
        ],
        "objects": [
            {"label": thing.label, "height": thing.height, "rings": _points([thing.ring])} for thing in plan.objects
        ],
        "stairs": _points(stair_lines(plan)),
        "frame": None if plan.frame is None else {"matrix": plan.frame.matrix, "up": plan.frame.up},
        **rooms_and_doors(plan),
    }


def rooms_and_doors(plan: FloorPlan) -> dict[str, Any]:
    """Return the rooms of a plan, as rings, its doors, with the lines of their leaves, and the words of its picture."""
    rooms = [
        {
            "id": room.id,
            "label": room.name or UNLABELLED,
            "area": room.area,
            "confidence": room.confidence,
            "unsure": room.is_unsure,
            "colour": label_colour(room.label),
            "rings": _points([room.ring, *room.holes]),
        }
        for room in plan.rooms
    ]
    leaves = door_leaves(plan)
    doors = [
        {
            "id": door.id,
            "kind": door.kind,
            "width": door.width,
            "confidence": door.confidence,
            "unsure": door.is_unsure,
            "rooms": list(door.rooms),
            "colour": DOOR_COLOURS[door.kind],
            "segment": [list(end) for end in door.segment],
            "rings": _points([door.ring]),
            "leaves": [
                {"leaf": _points([[leaf.hinge, leaf.end]])[0], "arc": _points([leaf.arc])[0]}
                for leaf in leaves.get(door.id, ())
            ],
        }
        for door in plan.doors
    ]
    words = [
        {"scale": scale, "texts": [_text(text) for text in texts]}
        for scale, texts in zip(_WORD_SCALES, place_words(plan, leaves, _WORD_SCALES), strict=True)
    ]
    windows = [
        {"id": window.id, "width": window.width, "rings": _rings(gap)}
        for window, gap in drawn_windows(plan, closed_walls(plan))
    ]
    return {"rooms": rooms, "doors": doors, "windows": windows, "words": words}


def _text(text: TextLines) -> dict[str, Any]:
    """Return lines of text: their middle, metres, the size of their letters and the width of the longest, pixels."""
    wide = round(max(text_length(line, text.size) for line in text.lines), 1)
    at = [round(text.x, _DIGITS), round(text.y, _DIGITS)]
    return {"at": at, "lines": text.lines, "size": round(text.size, 1), "wide": wide, "turned": text.turned}


def reach_values(plan: FloorPlan, radius_m: float) -> dict[str, Any]:
    """Return the pieces in which a disc's centre can stand, the largest first, and the area that the disc covers."""
    import shapely

    pieces = disc_centre_areas(plan.free_space, radius_m)
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


def way_values(
    plan: FloorPlan, start: tuple[float, float], goal: tuple[float, float], radius_m: float
) -> dict[str, Any]:
    """Return the shortest path of a disc between two points; a point too near to a wall moves to where it fits."""
    import shapely

    pieces = disc_centre_areas(plan.free_space, radius_m)
    ends = [shapely.Point(start), shapely.Point(goal)]
    if not pieces:
        return {"found": False, "why": "The robot fits nowhere."}
    homes = [int(np.argmin(shapely.distance(pieces, end))) for end in ends]
    if any(pieces[home].distance(end) > _SNAP_M for home, end in zip(homes, ends, strict=True)):
        return {"found": False, "why": "One of the two points is outside the plan."}
    moved = [_nearest(pieces[home], end) for home, end in zip(homes, ends, strict=True)]
    if homes[0] != homes[1]:
        return {"found": False, "why": "No path: the robot is too wide for a passage on the way.", "ends": moved}
    found = shortest_path(pieces[homes[0]], *moved)
    if found is None:
        return {"found": False, "why": "No path between the two points.", "ends": moved}
    points = found.points.round(_DIGITS).tolist()
    return {"found": True, "length": round(found.length, 2), "points": points, "ends": moved}


def clearance_picture(plan: FloorPlan) -> dict[str, Any]:
    """Return the distance to the nearest wall as a picture (PNG in base 64), with its bounds and its maximum.

    Free cells run from transparent blue to opaque yellow; walls are transparent.
    """
    import cv2

    x1, y1, x2, y2 = plan.free_space.bounds
    side = max(x2 - x1, y2 - y1, 0.001)
    scale = min(_FIELD_PX / side, max(25.0, FEWEST_CELLS / side))
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


def _rings(shape: Any) -> list[list[list[float]]]:
    return _points(all_rings(shape))


def _points(rings: Iterable[Any]) -> list[list[list[float]]]:
    return [np.asarray(ring).round(_DIGITS).tolist() for ring in rings]


_CANDIDATES: Final = 120
_PLANS_COMPARED: Final = 24
"""R1, R2: how many plans are fingerprinted, and how many of them are compared."""
_SHOWN: Final = 8
"""How many of these are returned."""
_PIXELS_PER_METRE: Final = 10.0
_MAX_DIFFERENCE: Final = 0.5
_FINGERPRINT: Final = "fingerprint, 3"
"""The name under which fingerprints are cached; another way of computing them needs another number."""


def most_similar_plans(now: OpenedDataset, plan_id: str) -> list[dict[str, Any]]:
    """Return the plans most similar to one: id, title, difference (0: equal; 1: nothing in common) and symmetry.

    Raises
    ------
    UnknownPlanError
        There is no plan with this id.
    """
    from houseexpo.analysis.kernels.masks import least_difference, pack_mask

    plan, table = now.plan(plan_id), now.views.table
    row = now.numbers[plan_id]
    columns = [
        _relative_distances(table.numbers(name), row) for name in ("area", "long_side", "short_side", "source_rooms")
    ]
    far = np.sum(np.nan_to_num(np.stack(columns), nan=1.0) ** 2, axis=0)
    far[row] = np.inf
    near = np.argsort(far, kind="stable")[:_CANDIDATES]
    near = near[np.isfinite(far[near])]
    if not len(near):
        return []
    ids = [table.ids[other] for other in near.tolist()]
    try:
        kept = now.data.only(ids).measure_cached(_FINGERPRINT, _fingerprint_of)
    except HouseExpoError:  # R4
        ids = [name for name in ids if _read(now, name) is not None]
        kept = now.data.only(ids).measure_cached(_FINGERPRINT, _fingerprint_of)
    if not ids:
        return []
    prints = np.array(kept, dtype=np.int32)
    own = np.array(_fingerprint_of(plan), np.int32)
    bounds = difference_lower_bound(own, prints) / np.maximum(prints[:, 0], own[0])
    mask, names = pack_mask(comparison_cells(plan, _PIXELS_PER_METRE)), tuple(SYMMETRIES)
    found: list[tuple[float, str, str]] = []
    for other in np.argsort(bounds, kind="stable")[:_PLANS_COMPARED].tolist():
        limit = sorted(each[0] for each in found)[_SHOWN - 1] if len(found) >= _SHOWN else _MAX_DIFFERENCE
        if bounds[other] > limit:
            break
        there = _read(now, ids[other])  # R4, if its traits are in the cache
        if there is None:
            continue
        packed = pack_mask(comparison_cells(there, _PIXELS_PER_METRE))
        cells, symmetry = least_difference(mask, packed, limit, SHIFT_PX, len(names))
        if symmetry >= 0:
            area = max(int(each.profiles.rows.sum()) for each in (mask, packed))
            found.append((cells / area, ids[other], names[symmetry]))
    return [
        {"id": name, "title": table.title(now.numbers[name]), "difference": round(difference, 4), "symmetry": symmetry}
        for difference, name, symmetry in sorted(found)[:_SHOWN]
    ]


def _fingerprint_of(plan: FloorPlan) -> list[int]:
    from houseexpo.analysis.kernels.masks import mask_profiles

    found: list[int] = fingerprint_from_profiles(mask_profiles(comparison_cells(plan))).tolist()
    return found


def _read(now: OpenedDataset, plan_id: str) -> FloorPlan | None:
    try:
        return now.data[plan_id]
    except HouseExpoError:
        return None


def _relative_distances(values: Any, row: int) -> Any:
    """Return the distance of each value from one of them, as a share of that value."""
    return (values - values[row]) / max(abs(float(values[row])), 1.0)
