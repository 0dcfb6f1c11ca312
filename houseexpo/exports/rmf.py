"""Convert a plan to an Open-RMF building for traffic_editor: walls, doors, floors and names, over a picture of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from houseexpo.exports.encoding import Files, valid_xml_text
from houseexpo.exports.placement import ExportFrame, Orientation, Pose, default_frame, orient_plan, pose_in_export
from houseexpo.exports.plan_bodies import WALL_THICKNESS_M, WallOpening, plan_bodies, wall_openings, window_openings
from houseexpo.exports.polygons import cut_into_trapezoids
from houseexpo.exports.rasters import PNG_RESOLUTION_M, png
from houseexpo.exports.storeys import PlacedStorey, stack_storeys
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import all_rings, free_mask
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.tolerances import CRUMB_M2, MITRE, TINY

if TYPE_CHECKING:
    from shapely import Polygon

RMF_WALL_M: Final = 0.1
"""rmf_building_map_tools makes every wall so thick."""

_WALL: Final = {"alpha": [3, 1.0], "texture_name": [1, "default"]}
_GLASS: Final = {**_WALL, "alpha": [3, 0.3]}


def rmf(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.building.yaml``, and ``<id>.png``, a picture of the free space.

    The building has one level. In the plan's own frame, its coordinates are pixels of the picture, y down, which
    traffic_editor shows below it; a measurement gives the scale (``reference_image``). In the source's frame, they are
    metres, y up, and the picture is named but does not lie below (``cartesian_meters``).

    Walls of Open-RMF are lines that its tools make 0.1 m thick: a thicker wall is drawn by a ring of lines just inside
    its faces, so that rooms keep their size. A thinner wall is drawn by a line with a parameter ``thickness`` in
    metres, which Open-RMF ignores. It has no windows: they are walls that one sees through (``alpha``). Passages with
    a leaf are hinged doors; passages without a leaf have the type "opening". Each room is a floor, free-standing
    objects in it are holes of the level, and a vertex in the room is named by the room's label or the source's own
    word. The user draws the lanes.
    """
    is_source = (frame or default_frame(plan)) == "source"
    storey = PlacedStorey(plan, pose_in_export(plan, orientation, frame))
    level = _level(storey, wall_thickness, orientation, in_metres=is_source)
    return {
        f"{plan.id}.building.yaml": _as_yaml(_building(plan.id, [level], in_metres=is_source)),
        **png(plan, orientation=orientation, frame=frame),
    }


def rmf_building(
    plans: Sequence[FloorPlan],
    name: str,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<name>.building.yaml`` with a level for each plan, lowest first, and a picture for each.

    The levels are stacked by ``stack_storeys``. Three fiducials, the same in all levels, align them. Everything else is
    as in ``rmf``.
    """
    storeys = stack_storeys(plans, name, orientation, frame)
    is_source = all((frame or default_frame(plan)) == "source" for plan in plans)
    boxes = [shapely.box(*orient_plan(each.plan, orientation).bbox) for each in storeys]
    if is_source:
        boxes = [each.pose.shape(box) for each, box in zip(storeys, boxes, strict=True)]
    x1, y1, x2, y2 = shapely.total_bounds(boxes).tolist()
    corners = {"southwest": (x1, y1), "southeast": (x2, y1), "northwest": (x1, y2)}
    levels = [_level(each, wall_thickness, orientation, corners, in_metres=is_source) for each in storeys]
    pictures = [png(each.plan, orientation=orientation, frame=frame) for each in storeys]
    building = {f"{name}.building.yaml": _as_yaml(_building(name, levels, in_metres=is_source))}
    return building | {file: data for picture in pictures for file, data in picture.items()}


def _level(
    storey: PlacedStorey,
    wall_thickness: float,
    orientation: Orientation,
    corners: Mapping[str, tuple[float, float]] | None = None,
    *,
    in_metres: bool,
) -> dict[str, Any]:
    """Return a level; ``corners`` are the fiducials, in metres along the axes of the building."""
    turned = orient_plan(storey.plan, orientation)
    picture = None if in_metres else free_mask(turned, 1.0 / PNG_RESOLUTION_M, y_up=True)[1]
    sheet = _Sheet(storey.pose, picture)
    doors = wall_openings(turned, wall_thickness)
    built = plan_bodies(turned, wall_thickness=wall_thickness, orientation="plan")
    walls = shapely.union_all([*built.walls, *built.wells])
    gaps = shapely.union_all([each.shape for each in doors]) if doors else shapely.Polygon()
    glass = shapely.union_all([each.shape for each in window_openings(turned, wall_thickness)])
    standing = shapely.difference(walls, gaps)
    looks = ((shapely.difference(standing, glass), _WALL), (shapely.intersection(standing, glass), _GLASS))
    bodies = [(part, look) for shape, look in looks for part in shapely.get_parts(shape) if part.area > CRUMB_M2]
    level = {
        "drawing": {"filename": f"{storey.plan.id}.png"},
        "elevation": storey.pose.z,
        "fiducials": [[*sheet.fiducial(corner), word] for word, corner in (corners or {}).items()],
        "walls": [sheet.edge(a, b, parameters) for body in bodies for a, b, parameters in _lines(*body)],
        "doors": [sheet.edge(*each.segment, _leaf(each)) for each in doors],
        "floors": [
            {"parameters": dict(_FLOOR), "vertices": [sheet.vertex(point) for point in part.exterior.coords[:-1]]}
            for part in [*(room.polygon for room in turned.rooms), *(each.shape for each in doors)]
        ],
        "holes": [
            {"parameters": {}, "vertices": [sheet.vertex(point) for point in ring.coords[:-1]]}
            for room in turned.rooms
            for ring in room.polygon.interiors
        ],
        "measurements": [_measurement(sheet, turned)],
        "lanes": [],
        "layers": {},
        "models": [],
    }
    for room in turned.rooms:
        word = room.label if room.label != UNLABELLED else next(iter(room.source_labels), "")
        at = shapely.point_on_surface(room.polygon)
        if word:
            sheet.name(valid_xml_text(word.replace("_", " ")), (at.x, at.y))
    level["vertices"] = sheet.vertices
    return level


def _building(name: str, levels: Sequence[Mapping[str, Any]], *, in_metres: bool) -> dict[str, Any]:
    return {
        "coordinate_system": "cartesian_meters" if in_metres else "reference_image",
        "graphs": {},
        "levels": {f"L{number}": level for number, level in enumerate(levels, start=1)},
        "lifts": {},
        "name": name,
    }


_FLOOR: Final = {"texture_name": [1, "blue_linoleum"], "texture_rotation": [3, 0.0], "texture_scale": [3, 1.0]}


def _as_yaml(building: Mapping[str, Any]) -> bytes:
    """Return the text in traffic_editor's style: the innermost lists and mappings on one line each, no aliases."""
    import yaml

    dumper = type("Plain", (yaml.SafeDumper,), {"ignore_aliases": lambda *_: True})
    text = yaml.dump(building, Dumper=dumper, default_flow_style=None, width=10_000, allow_unicode=True)
    return str(text).encode()


class _Sheet:
    """The level's vertices, in pixels of the picture or, without a picture, in metres of the building."""

    def __init__(self, pose: Pose, picture: GridFrame | None) -> None:
        self._pose, self._picture = pose, picture
        self._index: dict[tuple[float, float], int] = {}
        self.vertices: list[list[Any]] = []

    def vertex(self, point: Sequence[float]) -> int:
        """Return the number of the vertex at a point in metres; add the vertex if it is missing."""
        key = (round(float(point[0]), 4), round(float(point[1]), 4))
        if key not in self._index:
            self._index[key] = len(self.vertices)
            self._add(key, "")
        return self._index[key]

    def name(self, word: str, point: tuple[float, float]) -> None:
        """Add a vertex with a name."""
        self._add(point, word)

    def edge(self, a: Sequence[float], b: Sequence[float], parameters: Mapping[str, Any]) -> list[Any]:
        """Return an edge between two points."""
        return [self.vertex(a), self.vertex(b), dict(parameters)]

    def pixel(self, point: Sequence[float]) -> list[float]:
        """Convert a point of the plan, metres, to coordinates of the file."""
        if self._picture is None:
            return [round(value, 4) for value in self._pose.point(point)]
        x, y = self._picture.pixel_from_point(*point)
        return [round(x, 3), round(y, 3)]

    def fiducial(self, corner: Sequence[float]) -> list[float]:
        """Convert a point of the building, metres, to coordinates of the file."""
        if self._picture is None:
            return [round(value, 4) for value in corner]
        return self.pixel(np.subtract(corner, (self._pose.x, self._pose.y)).tolist())

    def _add(self, point: Sequence[float], name: str) -> None:
        self.vertices.append([*self.pixel(point), 0.0, name])


def _lines(
    body: Polygon, look: Mapping[str, Any]
) -> Iterator[tuple[Sequence[float], Sequence[float], Mapping[str, Any]]]:
    """Yield the lines of one wall: rings inside its faces, and strips where it is thinner than Open-RMF's walls."""
    core = shapely.buffer(body, -RMF_WALL_M / 2, join_style="mitre", mitre_limit=MITRE)
    cores = [part for part in shapely.get_parts(core) if part.area > 0]
    for part in cores:
        for ring in all_rings(part):
            yield from ((a, b, look) for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True))
    covered = shapely.buffer(shapely.union_all(cores), RMF_WALL_M / 2 + 1e-3, join_style="mitre", mitre_limit=MITRE)
    for rest in shapely.get_parts(shapely.difference(body, covered)):
        if rest.geom_type == "Polygon" and rest.area > CRUMB_M2:
            yield from (_strip(ring, look) for ring in cut_into_trapezoids(rest))


def _strip(ring: Any, look: Mapping[str, Any]) -> tuple[Sequence[float], Sequence[float], dict[str, Any]]:
    """Return the middle line of a piece and its thickness, shortened by the length that Open-RMF adds at the ends."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shapely.Polygon(ring)))[:4]
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    k = int(np.argmin(sides))
    thick = float(sides[k])
    a, b = (corners[k] + corners[(k + 1) % 4]) / 2, (corners[(k + 2) % 4] + corners[(k + 3) % 4]) / 2
    step = (b - a) / max(float(np.hypot(*(b - a))), TINY) * min(thick, float(sides[(k + 1) % 4]) * 0.98) / 2
    return a + step, b - step, {**look, "thickness": [3, round(thick, 4)]}


def _leaf(each: WallOpening) -> dict[str, Any]:
    kind = "hinged" if each.has_leaf else "opening"
    return {
        "motion_axis": [1, "start"],
        "motion_degrees": [3, 90.0],
        "motion_direction": [2, 1],
        "name": [1, f"door_{each.door.id}"],
        "plugin": [1, "none"],
        "right_left_ratio": [3, 1.0],
        "type": [1, kind],
    }


def _measurement(sheet: _Sheet, plan: FloorPlan) -> list[Any]:
    x1, y1, x2, y2 = plan.bbox
    start, end = ((x1, y1), (x2, y1)) if x2 - x1 > y2 - y1 else ((x1, y1), (x1, y2))
    return sheet.edge(start, end, {"distance": [3, round(max(x2 - x1, y2 - y1), 4)]})
