"""Convert a plan to a USD world as text (``.usda``): walls, floors, doors and furniture, each with its class."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, Unpack

import numpy as np
import numpy.typing as npt

from houseexpo.exports.encoding import Files, format_number, valid_xml_text
from houseexpo.exports.mesh import extrude_polygon
from houseexpo.exports.placement import Pose
from houseexpo.exports.plan_bodies import BodyOptions, PlanBodies, plan_bodies, wall_openings
from houseexpo.exports.storeys import FLOOR_M, storey_bodies
from houseexpo.floorplan import FloorPlan

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_COLOURS: Final = {
    "wall": "0.86, 0.85, 0.82",
    "floor": "0.62, 0.56, 0.47",
    "door": "0.55, 0.36, 0.2",
    "glass": "0.7, 0.85, 0.9",
    "furniture": "0.66, 0.53, 0.4",
}


def usd(plan: FloorPlan, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<id>.usda``: metres, z up, one mesh a wall, lintel, floor of a room, door and piece of furniture.

    The default prim is ``House``, with the scopes ``Walls``, ``Windows`` (glass, if the plan has windows), ``Floors``,
    ``Doors`` and ``Furniture``. Walls, glass, floors and furniture are colliders (PhysicsCollisionAPI). Doors are
    bodies of the passage between its jambs: guides, which renderers and physics pass over, so that a robot drives
    through. Each prim carries its class in the three ways that are in use (``semantics:labels:class``,
    ``semantic:Semantics:params:semanticData``, ``semanticLabel``): wall, window, floor and the room's label, door,
    opening or entrance, or the object's word. Options are those of ``plan_bodies``.
    """
    built = plan_bodies(plan, **options)
    return _file(plan.id, [*_place(built.pose), *_scopes(built)])


def usd_building(plans: Sequence[FloorPlan], name: str, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<name>.usda``: in the default prim ``House`` an Xform for each storey, at its place and elevation.

    The name of a storey's prim is the id of its plan, with _ for characters that are not allowed in names;
    ``houseexpo:id`` and the display name are the id itself. A storey has the scopes of ``usd``. The storeys are stacked
    by ``stack_storeys``; their walls end under the next floor.
    """
    bodies = storey_bodies(plans, name, options)
    lines: list[str] = []
    taken: set[str] = set()
    for number, each in enumerate(bodies):
        storey = each.storey
        prim = re.sub(r"[^A-Za-z0-9_]", "_", storey.plan.id)
        prim = f"_{prim}" if prim[:1].isdigit() or not prim else prim
        prim = f"{prim}_{number}" if prim in taken else prim
        taken.add(prim)
        within = [
            f'def Xform "{prim}" (',
            f"    displayName = {_quote(storey.plan.id)}",
            ")",
            "{",
            f"    custom string houseexpo:id = {_quote(storey.plan.id)}",
            *_place(storey.pose, always=True),
            *_scopes(each.built, each.roof),
            "}",
        ]
        lines += ["", *(f"    {line}" if line else "" for line in within)]
    return _file(name, lines)


def _place(pose: Pose, *, always: bool = False) -> list[str]:
    """Return the lines that place a prim at a pose, indented by 4; empty for the identity, unless ``always``."""
    if not (pose or always):
        return []
    turn = [f"    double xformOp:rotateZ = {round(math.degrees(pose.yaw), 9):.10g}"] if pose.yaw else []
    names = ['"xformOp:translate"', *(['"xformOp:rotateZ"'] if pose.yaw else [])]
    return [
        f"    double3 xformOp:translate = ({format_number(pose.x)}, {format_number(pose.y)}, {format_number(pose.z)})",
        *turn,
        f"    uniform token[] xformOpOrder = [{', '.join(names)}]",
    ]


def _scopes(built: PlanBodies, roof: BaseGeometry | None = None) -> list[str]:
    """Return the lines of the scopes of a storey, indented by 4."""
    turned, wall_height, door_height = built.plan, built.wall_height, built.door_height
    walls = [_body(f"Wall_{i}", "wall", "wall", each, 0.0, wall_height) for i, each in enumerate(built.standing)]
    panes: list[list[str]] = []
    for name, kind, shape, low, high in built.window_parts:
        parts, label = (panes, "window") if kind == "glass" else (walls, "wall")
        parts.append(_body(name.capitalize(), kind, label, shape, low, high - low))
    over = wall_height - door_height
    if over > 0:
        lintels = enumerate(built.lintels)
        walls += [_body(f"Lintel_{i}", "wall", "lintel", each, door_height, over) for i, each in lintels]
    doors = wall_openings(turned, built.wall_thickness)
    floors = [
        _body(f"Floor_{room.id}", "floor", room.label, room.polygon, -FLOOR_M, FLOOR_M, words=room.source_labels)
        for room in turned.rooms
    ]
    if not turned.rooms:
        floors = [_body("Floor", "floor", "floor", built.space, -FLOOR_M, FLOOR_M)]
    floors += [_body(f"Threshold_{p.door.id}", "floor", "threshold", p.shape, -FLOOR_M, FLOOR_M) for p in doors]
    bodies = [
        _body(f"Door_{p.door.id}", "door", p.door.kind, p.shape, 0.0, wall_height if not p.has_leaf else door_height)
        for p in doors
    ]
    things = [
        _body(f"Object_{thing.id}", "furniture", thing.label, thing.polygon, 0.0, thing.height)
        for thing in built.furniture
        if thing.height > 0
    ]
    things += [
        _body(name.capitalize(), "furniture", name, shape, 0.0, wall_height) for name, shape in built.named_wells
    ]
    if roof is not None and not roof.is_empty:
        walls.append(_body("Roof", "wall", "roof", roof, wall_height, FLOOR_M))
    lines = []
    for scope, parts in (
        ("Walls", walls),
        ("Windows", panes),
        ("Floors", floors),
        ("Doors", bodies),
        ("Furniture", things),
    ):
        if parts:
            lines += ["", f'    def Scope "{scope}"', "    {", *(line for part in parts for line in part), "    }"]
    return lines


def _file(name: str, content: Sequence[str]) -> Files:
    lines = [
        "#usda 1.0",
        "(",
        '    defaultPrim = "House"',
        "    metersPerUnit = 1",
        '    upAxis = "Z"',
        ")",
        "",
        'def Xform "House" (',
        '    kind = "component"',
        ")",
        "{",
        f"    custom string houseexpo:id = {_quote(name)}",
    ]
    return {f"{name}.usda": ("\n".join([*lines, *content, "}"]) + "\n").encode()}


def _body(
    name: str, kind: str, label: str, shape: BaseGeometry, *heights: float, words: Sequence[str] = ()
) -> list[str]:
    """Return the lines of a mesh on a shape; ``heights`` are the height of its foot and its own height, metres."""
    low, high = heights
    mesh = extrude_polygon(shape, high).to_mesh64()
    points = np.asarray(mesh.vert_properties)[:, :3] + (0.0, 0.0, low)
    lines = _mesh(name, kind, points, np.asarray(mesh.tri_verts))
    return [f"        {line}" for line in (*lines, *_semantics(kind, label, words), "}")]


def _mesh(name: str, kind: str, points: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]) -> Iterator[str]:
    apis = ['"SemanticsLabelsAPI:class"', '"SemanticsAPI:Semantics"']
    apis += [] if kind == "door" else ['"PhysicsCollisionAPI"']
    corners = ", ".join(f"({format_number(x)}, {format_number(y)}, {format_number(z)})" for x, y, z in points.tolist())
    yield f'def Mesh "{name}" ('
    yield f"    prepend apiSchemas = [{', '.join(apis)}]"
    yield ")"
    yield "{"
    yield f"    int[] faceVertexCounts = [{', '.join(['3'] * len(faces))}]"
    yield f"    int[] faceVertexIndices = [{', '.join(map(str, faces.ravel().tolist()))}]"
    yield f"    point3f[] points = [{corners}]"
    yield '    uniform token subdivisionScheme = "none"'
    yield f"    color3f[] primvars:displayColor = [({_COLOURS[kind]})]"


def _semantics(kind: str, label: str, words: Sequence[str]) -> Iterator[str]:
    yield f"    token[] semantics:labels:class = [{_quote(label)}]"
    yield '    string semantic:Semantics:params:semanticType = "class"'
    yield f"    string semantic:Semantics:params:semanticData = {_quote(label)}"
    yield f"    custom string semanticLabel = {_quote(label)}"
    if words:
        yield f"    custom string[] houseexpo:words = [{', '.join(map(_quote, words))}]"
    if kind == "door":
        yield '    uniform token purpose = "guide"'


def _quote(text: str) -> str:
    """Return a text as a quoted USD string without control characters."""
    said = valid_xml_text(re.sub(r"[\x00-\x1f]", " ", text)).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{said}"'
