"""Two rooms with a door between, as the published data sets write them: to the letter of their keys, no file of theirs.

The rooms are 4 x 4 m, a wall of 0.1 m between them from x = 4 to 4.1; the door is 0.9 m wide, from y = 1.5 to 2.4.
"""

from __future__ import annotations

import json
import pickle
from typing import Any

import shapely
from shapely import box

KITCHEN, BEDROOM, DOOR = box(0, 0, 4, 4), box(4.1, 0, 8.1, 4), box(4, 1.5, 4.1, 2.4)
WALLS = box(-0.1, -0.1, 8.2, 4.1).difference(shapely.union_all([KITCHEN, BEDROOM]))
AREA_M2 = 32.0 + 0.09


def spatiallm() -> str:
    """The walls are lines in the middle of walls of 0.1 m, as SpatialLM's entities are written."""
    ends = [
        (-0.05, -0.05, 8.15, -0.05),
        (8.15, -0.05, 8.15, 4.05),
        (8.15, 4.05, -0.05, 4.05),
        (-0.05, 4.05, -0.05, -0.05),
    ]
    ends += [(4.05, -0.05, 4.05, 4.05)]
    lines = [f"wall_{i}=Wall({a},{b},0.0,{c},{d},0.0,2.6,0.1)" for i, (a, b, c, d) in enumerate(ends)]
    lines += ["door_0=Door(wall_4,4.05,1.95,1.05,0.9,2.1)", "window_0=Window(wall_0,2.0,-0.05,1.5,1.0,1.0)"]
    lines += ["bbox_0=Bbox(sofa,1.0,1.0,0.4,0.3,1.8,0.8,0.8)"]
    return "\n".join(lines) + "\n"


def aria() -> str:
    """The same in Aria's words: commands and named parameters."""
    lines = []
    for number, line in enumerate(spatiallm().splitlines()[:5]):
        a, b, z, c, d, w, height, thick = line[line.index("(") + 1 : -1].split(",")
        where = f"a_x={a}, a_y={b}, a_z={z}, b_x={c}, b_y={d}, b_z={w}"
        lines.append(f"make_wall, id={number}, {where}, height={height}, thickness={thick}")
    place = "position_x=4.05, position_y=1.95, position_z=1.05, width=0.9, height=2.1"
    return "\n".join([*lines, f"make_door, id=1000, wall0_id=4, wall1_id=4, {place}"]) + "\n"


def structured3d() -> str:
    """Two rooms of floor planes and a door of two planes; millimetres."""
    junctions, lines, planes, semantics = [], [], [], []

    def plane(kind: str, corners: list[tuple[float, float, float]]) -> int:
        first = len(junctions)
        junctions.extend({"ID": first + i, "coordinate": [1000 * c for c in xyz]} for i, xyz in enumerate(corners))
        start = len(lines)
        lines.extend((first + i, first + (i + 1) % len(corners)) for i in range(len(corners)))
        planes.append(
            {"ID": len(planes), "type": kind, "lines": range(start, len(lines)), "normal": [0, 0, 1], "offset": 0}
        )
        return len(planes) - 1

    for name, (x1, y1, x2, y2) in (("kitchen", KITCHEN.bounds), ("bedroom", BEDROOM.bounds)):
        floor = plane("floor", [(x1, y1, 0), (x2, y1, 0), (x2, y2, 0), (x1, y2, 0)])
        semantics.append({"ID": len(semantics), "type": name, "planeID": [floor]})
    sides = [plane("wall", [(x, 1.5, 0), (x, 2.4, 0), (x, 2.4, 2.1), (x, 1.5, 2.1)]) for x in (4.0, 4.1)]
    semantics.append({"ID": len(semantics), "type": "door", "planeID": sides})
    plane_lines = [[int(line in plane["lines"]) for line in range(len(lines))] for plane in planes]
    planes = [{key: value for key, value in plane.items() if key != "lines"} for plane in planes]
    line_junctions = [[int(j in ends) for j in range(len(junctions))] for ends in lines]
    named = [{"ID": i, "point": [0, 0, 0], "direction": [1, 0, 0]} for i in range(len(lines))]
    document = {"junctions": junctions, "lines": named, "planes": planes, "semantics": semantics}
    return json.dumps({**document, "planeLineMatrix": plane_lines, "lineJunctionMatrix": line_junctions})


def cubicasa() -> str:
    """Walls, doors and spaces as groups with polygons, 100 pixels a metre; y down."""

    def polygon(shape: Any) -> str:
        corners = " ".join(f"{100 * x:g},{400 - 100 * y:g}" for x, y in shape.exterior.coords[:-1])
        return f'<polygon points="{corners}"/>'

    walls = [
        box(-0.1, -0.1, 8.2, 0),
        box(-0.1, 4, 8.2, 4.1),
        box(-0.1, 0, 0, 4),
        box(8.1, 0, 8.2, 4),
        box(4, 0, 4.1, 4),
    ]
    groups = [f'<g id="Wall" class="Wall External" >{polygon(wall)}</g>' for wall in walls[:4]]
    door = f'<g id="Door" class="Door Swing Beside">{polygon(DOOR)}<path d="M1,1L2,2"/></g>'
    groups.append(f'<g id="Wall" class="Wall">{polygon(walls[4])}{door}</g>')
    groups += [
        f'<g class="Space {n}">{polygon(s)}<text>x</text></g>' for n, s in (("Kitchen", KITCHEN), ("Bedroom", BEDROOM))
    ]
    body = f'<g id="Model" class="Model v1-1"><g class="Floorplan Floor-1">{"".join(groups)}</g></g>'
    return f'<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" width="900" height="500">{body}</svg>'


def swiss_dwellings(floors: int = 1, column: str = "geometry") -> str:
    """A table of shapes; MSD calls the last column ``geom``."""
    lines = [f"apartment_id,site_id,building_id,floor_id,unit_id,entity_type,entity_subtype,elevation,height,{column}"]
    shapes = [("area", "KITCHEN", KITCHEN), ("area", "BEDROOM", BEDROOM), ("separator", "WALL", WALLS)]
    shapes += [("opening", "DOOR", DOOR), ("feature", "SINK", box(1, 1, 1.5, 1.5))]
    for floor in range(floors):
        lines += [f'a,1,2,{floor + 7},3,{kind},{name},0.0,2.6,"{shape.wkt}"' for kind, name, shape in shapes]
    return "\n".join(lines) + "\n"


def resplan(count: int = 1) -> bytes:
    """A list of plans in units of their own, with the area in square metres."""
    by = 256 / 8.3

    def scaled(shape: Any) -> Any:
        return shapely.transform(shape, lambda points: points * by)

    plan = {
        "kitchen": scaled(KITCHEN),
        "bedroom": shapely.MultiPolygon([scaled(BEDROOM)]),
        "wall": scaled(WALLS.difference(DOOR)),
        "door": scaled(DOOR),
        "window": shapely.Polygon(),
        "front_door": shapely.Polygon(),
        "inner": scaled(shapely.union_all([KITCHEN, BEDROOM, box(4, 0, 4.1, 4)])),
        "area": 32.4,
        "unitType": "apartment",
    }
    return pickle.dumps([{**plan, "id": number} for number in range(count)])
