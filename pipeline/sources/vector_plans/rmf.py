"""Read an Open-RMF building (``*.building.yaml``) of traffic_editor: walls, doors, rooms and lifts of its levels.

Format: open-rmf/rmf_traffic_editor, rmf_building_map_tools (Building, Level, Wall, Lift). Vertices are
[x, y, z, name, parameters]; walls, doors, measurements are [start, end, parameters], a parameter [type, value].

R1  A level's scale is the mean of its measurements; without one, it is that of the reference level times the ratio of
    the distances between fiducials that both have, or simply that of the reference level. y of pictures runs down.
R2  A wall is 0.1 m thick and 2.5 m high, as rmf_building_map_tools makes it; ``thickness`` among its parameters, which
    our own export writes, says another one. Walls that are two faces of one are filled.
R3  A vertex whose name is the name of a room names the room around it. Where two floors or more have one such vertex
    each, and none has two, these floors are the rooms, as our own export draws them.
R4  A lift is a room of the levels that it has doors on, or passes where it names none; its doors are doors.
R5  What refers to vertices that are not there is left out, with a note.
R6  Holes of a level are no floor, and nobody walks there: they are wall. So is a place between walls, in a level with
    floors, that no floor, no door and no vertex is in: the block between corridors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString, Polygon

from houseexpo.files import decode_yaml
from pipeline.geometry.areas import polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import Wall, polygon_from_ring, unite_rooms
from pipeline.sources.files import LeftOutParts, read_bytes
from pipeline.sources.roles import labels_for
from pipeline.sources.tolerances import (
    COVER_MARGIN_M,
    DEEPEST,
    FILE_GRID_M,
    LARGEST_COORDINATE,
    LARGEST_TEXT_BYTES,
    LINE_WALL_M,
    SCARCELY,
    WALL_HEIGHT_M,
)
from pipeline.sources.vector_plans.drawing import Drawing, DrawnStorey, Feature, Point
from pipeline.sources.vector_plans.named_features import storey_from_features
from pipeline.values import SourceRoom

MOST_FIDUCIALS = 100
"""So many give the ratio of two scales as well as all of them do."""
_ADVICE = "save it again with traffic_editor"
_LIFT = "Lift"


def can_read(path: Path, head: bytes) -> bool:
    """By its name, or by the keys that a level has."""
    if path.suffix.lower() not in {".yaml", ".yml"}:
        return False
    return path.name.lower().endswith((".building.yaml", ".building.yml")) or (
        re.search(rb"^levels:", head, re.MULTILINE) is not None and re.search(rb"^ +vertices:", head, re.M) is not None
    )


TAKES: Final = ("unit_m",)


def read_drawing(path: Path, *, unit_m: float | None = None) -> Drawing:
    """Read a building, in a unit that is given or measured; raise Rejection if it cannot be, or no level has a wall."""
    building = _document(path)
    levels = building.get("levels")
    if not isinstance(levels, Mapping) or not levels:
        raise _unreadable(path, "expected levels, found none")
    system = str(building.get("coordinate_system", "reference_image"))
    if not any(isinstance(level, Mapping) and level.get("walls") for level in levels.values()):
        detail = f"{path.name}: expected walls on a level, found none; it is a traffic map of lanes"
        raise Rejection("source", Reason.NO_LEVEL, detail, "draw its walls in traffic_editor, or leave it out")
    left_out = LeftOutParts()
    usable = {str(name): level for name, level in levels.items() if isinstance(level, Mapping)}
    reference = str(building.get("reference_level_name", next(iter(usable), "")))
    scales = dict.fromkeys(usable, unit_m) if unit_m else _scales(usable, reference, system, path, left_out)
    lifts = building.get("lifts")
    storeys = []
    for name, level in usable.items():
        with left_out.part():
            sheet = _Sheet(name, level, scales[name], -1.0 if system != "cartesian_meters" else 1.0, left_out)
            rooms, doors = _lifts(lifts, reference, scales, sheet)
            storeys.append(sheet.storey(rooms, doors))
    return Drawing("open-rmf", tuple(storeys), left_out, unit_m=scales.get(reference, 1.0))


class _Sheet:
    """One level: its vertices in metres, y up, and what refers to them."""

    def __init__(self, name: str, level: Mapping[str, Any], scale: float, up: float, left_out: LeftOutParts) -> None:
        self.where = f"level {name[:40]}"
        self.name, self.level, self.left_out = name, level, left_out
        self.scale, self.up = scale, up
        self.names: list[tuple[str, Point]] = []
        self.points: list[Point | None] = []
        for number, vertex in enumerate(_as_list(level.get("vertices"))):
            point = _point(vertex, scale, up)
            self.points.append(point)
            if point is None:
                left_out.add(f"{self.where}: vertex {number} has no place")
            elif len(vertex) > 3 and isinstance(vertex[3], str) and vertex[3]:
                self.names.append((vertex[3], point))

    def storey(self, lifts: list[SourceRoom], lift_doors: list[tuple[Point, Point]]) -> DrawnStorey:
        """Draw the level."""
        holes, floors = list(self._polygons("holes")), self._floors()
        features = [
            Feature("wall", LineString([a, b]), thick_m=_parameter(said, "thickness", LINE_WALL_M))
            for a, b, said in self.edges("walls")
        ]
        features += [Feature("wall", hole, filled=True) for hole in holes]
        doors = [(a, b, "door" if _has_leaf(said) else "opening") for a, b, said in self.edges("doors")]
        doors += [(a, b, "door") for a, b in lift_doors]
        features += [Feature(kind, LineString([a, b])) for a, b, kind in doors]
        features += [*(Feature("floor", floor) for floor in floors), *self._rooms(floors)]
        drawn = storey_from_features(features, _number(self.level.get("elevation"), 0.0))
        passages = [hole.shape for hole in drawn.holes]
        blocks = self._blocks([wall.shape for wall in drawn.walls], passages, floors)
        return replace(
            drawn,
            walls=(*drawn.walls, *(Wall(block, 0.0, WALL_HEIGHT_M) for block in blocks)),
            rooms=(*drawn.rooms, *lifts),
            floor=unite_rooms([*floors, *passages]) if floors else None,
            all_named=False,
            about={"level_name": self.name},
        )

    def _rooms(self, floors: list[Polygon]) -> list[Feature]:
        """Return the rooms that vertices with the names of rooms name."""
        named = [Feature("name", shapely.Point(at), (name,)) for name, at in self.names if labels_for((name,))]
        inside = [sum(floor.contains(each.shape) for each in named) for floor in floors]
        are_rooms = max(inside, default=0) == 1 and sum(inside) > 1
        rooms = [Feature("room", floor) for floor, count in zip(floors, inside, strict=True) if count and are_rooms]
        return rooms + named

    def _floors(self) -> list[Polygon]:
        """Return the floors without the holes of the level, which are wall."""
        holes = shapely.union_all(list(self._polygons("holes")))
        floors = [shapely.difference(floor, holes) for floor in self._polygons("floors")]
        return [part for floor in floors for part in polygons_of(floor)]

    def _blocks(self, walls: list[Polygon], doors: list[Polygon], floors: list[Polygon]) -> list[Polygon]:
        """Return the places between walls that have no floor: nobody walks there."""
        if not floors:
            return []
        body = shapely.union_all([*walls, *doors], grid_size=FILE_GRID_M)
        whole = shapely.union_all([Polygon(part.exterior) for part in polygons_of(body)])
        seen = shapely.MultiPoint([point for point in self.points if point is not None])
        floor = shapely.union_all(floors)
        return [
            place
            for place in polygons_of(shapely.difference(whole, body))
            if shapely.intersection(place, floor).area < SCARCELY * place.area  # a place without a floor
            and not place.intersects(seen)
            and not any(shapely.dwithin(place, door, FILE_GRID_M) for door in doors)
        ]

    def _polygons(self, kind: str) -> Iterator[Polygon]:
        for each in _as_list(self.level.get(kind)):
            corners = each.get("vertices") if isinstance(each, Mapping) else None
            ring = [point for index in _as_list(corners) if (point := self._at(index)) is not None]
            if (shape := polygon_from_ring(ring)) is not None:
                yield shape

    def edges(self, kind: str) -> Iterator[tuple[Point, Point, Mapping[str, Any]]]:
        """Yield the edges of a kind; R5."""
        for number, edge in enumerate(_as_list(self.level.get(kind))):
            ends = [self._at(index) for index in edge[:2]] if isinstance(edge, list) else []
            if len(ends) < 2 or ends[0] is None or ends[1] is None:
                self.left_out.add(f"{self.where}: {kind}[{number}] names a vertex that is not there")
            else:
                yield ends[0], ends[1], edge[2] if len(edge) > 2 and isinstance(edge[2], Mapping) else {}

    def _at(self, index: Any) -> Point | None:
        known = isinstance(index, int) and 0 <= index < len(self.points)
        return self.points[index] if known else None


def _document(path: Path) -> Mapping[str, Any]:
    data = read_bytes(path, "expected one building", LARGEST_TEXT_BYTES)
    try:
        document = decode_yaml(data, DEEPEST)
    except ValueError as error:
        raise _unreadable(path, str(error)) from None
    if not isinstance(document, Mapping):
        raise _unreadable(path, "expected a mapping with levels")
    return document


def _unreadable(path: Path, what: str) -> Rejection:
    return Rejection("source", Reason.UNREADABLE, f"{path.name} {what}", _ADVICE)


def _scales(
    levels: Mapping[str, Any], reference: str, system: str, path: Path, left_out: LeftOutParts
) -> dict[str, float]:
    """Metres a unit of each level."""
    if system in {"cartesian_meters"}:
        return dict.fromkeys(levels, 1.0)
    if system in {"web_mercator", "wgs84"}:
        detail = f"{path.name} is drawn in {system} coordinates, which are no metres"
        raise Rejection("source", Reason.BAD_UNITS, detail, "save it with reference_image or cartesian_meters")
    own = {name: scale for name, level in levels.items() if (scale := _metres_a_unit(level))}
    known = own.get(reference) or next(iter(own.values()), None)
    if known is None:
        detail = f"{path.name}: expected a measurement, which gives the metres of a pixel, found none"
        raise Rejection("source", Reason.BAD_UNITS, detail, "draw a measurement in traffic_editor")
    found = {}
    for name, level in levels.items():
        ratio = _ratio(levels.get(reference), level) if name not in own else None
        found[name] = own.get(name) or known * (ratio or 1.0)
        if name not in own and ratio is None and level.get("walls"):
            left_out.add(f"level {name[:40]} has no measurement: the scale of another level is taken")
    return found


def _metres_a_unit(level: Mapping[str, Any]) -> float | None:
    vertices, ratios = _as_list(level.get("vertices")), []
    for edge in _as_list(level.get("measurements")):
        if not (isinstance(edge, list) and len(edge) > 2 and isinstance(edge[2], Mapping)):
            continue
        known = [isinstance(i, int) and 0 <= i < len(vertices) for i in edge[:2]]
        ends = [
            _point(vertices[i], 1.0, 1.0) if is_known else None for i, is_known in zip(edge[:2], known, strict=True)
        ]
        length = math.dist(ends[0], ends[1]) if ends[0] and ends[1] else 0.0
        metres = _parameter(edge[2], "distance", 0.0)
        if length > 0 and metres > 0:
            ratios.append(metres / length)
    return float(np.mean(ratios)) if ratios else None


def _ratio(reference: Any, level: Mapping[str, Any]) -> float | None:
    """Return how much longer a unit of this level is than one of the reference's, by the fiducials of both."""
    ours, theirs = _fiducials(level), _fiducials(reference if isinstance(reference, Mapping) else {})
    names = sorted(set(ours) & set(theirs))[:MOST_FIDUCIALS]
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
    ratios = [math.dist(theirs[a], theirs[b]) / d for a, b in pairs if (d := math.dist(ours[a], ours[b])) > 0]
    return float(np.mean(ratios)) if ratios else None


def _fiducials(level: Mapping[str, Any]) -> dict[str, Point]:
    found = {}
    for each in _as_list(level.get("fiducials")):
        point = _point(each, 1.0, 1.0)
        if point is not None and isinstance(each[-1], str):
            found[each[-1]] = point
    return found


def _lifts(
    lifts: Any, reference: str, scales: Mapping[str, float], sheet: _Sheet
) -> tuple[list[SourceRoom], list[tuple[Point, Point]]]:
    """Return the lifts as rooms of the levels that they have doors on, and their doors."""
    rooms, doors = [], []
    for name, lift in (lifts or {}).items() if isinstance(lifts, Mapping) else ():
        if not isinstance(lift, Mapping):
            continue
        scale = scales.get(str(lift.get("reference_floor_name", reference)), sheet.scale)
        at = _point([lift.get("x"), lift.get("y")], scale, sheet.up)
        width, depth = _number(lift.get("width"), 0.0), _number(lift.get("depth"), 0.0)
        if at is None or not 0 < width < 20 or not 0 < depth < 20:
            sheet.left_out.add(f"{sheet.where}: lift {str(name)[:40]} has no place or size")
            continue
        served = lift.get("level_doors")
        if isinstance(served, Mapping) and served and sheet.name not in {str(each) for each in served}:
            continue
        yaw = _number(lift.get("yaw"), 0.0)
        turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        half = np.array([width / 2 + COVER_MARGIN_M, depth / 2 + COVER_MARGIN_M])
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half @ turn.T + at
        box = shapely.bounds(Polygon(corners)).tolist()
        rooms.append(SourceRoom((f"{_LIFT} {name}",), ("Passenger_elevator",), box=(box[0], box[1], box[2], box[3])))
        opens = (
            {str(each) for each in _as_list((served or {}).get(sheet.name))} if isinstance(served, Mapping) else set()
        )
        for key, door in (lift.get("doors") or {}).items() if isinstance(lift.get("doors"), Mapping) else ():
            if str(key) in opens and isinstance(door, Mapping):
                middle = np.array([_number(door.get("x"), 0.0), _number(door.get("y"), 0.0)])
                axis = _number(door.get("motion_axis_orientation"), 0.0)
                step = np.array([math.cos(axis), math.sin(axis)]) * _number(door.get("width"), 0.0) / 2
                a, b = (middle - step) @ turn.T + at, (middle + step) @ turn.T + at
                doors.append(((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))))
    return rooms, doors


def _has_leaf(parameters: Mapping[str, Any]) -> bool:
    """Our own export writes a passage without a leaf as a door of type "opening"."""
    kind = parameters.get("type")
    return not (isinstance(kind, list) and len(kind) > 1 and kind[1] == "opening")


def _point(found: Any, scale: float, up: float) -> Point | None:
    if not isinstance(found, list) or len(found) < 2:
        return None
    x, y = (_number(each, math.nan) * scale for each in found[:2])
    return (x, y * up) if math.isfinite(x) and math.isfinite(y) else None


def _parameter(parameters: Mapping[str, Any], name: str, default: float) -> float:
    """A parameter's value where it is a number above 0."""
    found = parameters.get(name)
    value = _number(found[1] if isinstance(found, list) and len(found) > 1 else found, default)
    return value if value > 0 else default


def _number(value: Any, default: float) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) < LARGEST_COORDINATE:
        return default
    return float(value)


def _as_list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
