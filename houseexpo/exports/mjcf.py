"""Convert a plan to a MuJoCo world (MJCF): walls, floors and furniture as named geoms, doors and openings as sites."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from typing import Any, Final, Unpack

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from houseexpo.exports.encoding import Files, format_numbers, valid_xml_text
from houseexpo.exports.placement import Pose
from houseexpo.exports.plan_bodies import BodyOptions, PlanBodies, WallOpening, plan_bodies, wall_openings
from houseexpo.exports.polygons import cut_into_trapezoids
from houseexpo.exports.storeys import FLOOR_M, storey_bodies
from houseexpo.floorplan import FloorPlan
from houseexpo.tolerances import CRUMB_M2, TINY

_SLAB_M: Final = 0.05
_WALL, _LINTEL, _FLOOR, _THING = "0.86 0.85 0.82 1", "0.78 0.72 0.62 1", "0.62 0.56 0.47 1", "0.66 0.53 0.4 1"
_MARK, _GLASS = "0.2 0.4 0.8 0.3", "0.7 0.85 0.9 0.4"

_Into = tuple[ET.Element, ET.Element]
"""The assets of a file, and the world or body that gets the geoms and sites."""


def mjcf(plan: FloorPlan, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<id>.xml`` for MuJoCo: metres, z up, one file without others beside it.

    Names: geoms ``wall_<i>``, ``lintel_<i>``, ``wall_under_window_<id>_<piece>``, ``window_lintel_<id>_<piece>`` and
    ``window_<id>_<piece>`` (glass), ``room|<id>|<label>|<piece>`` (a floor; without rooms ``floor_<i>``), and
    ``object_<id>_<piece>``; sites ``door_<id>`` for doors and entrances and ``doorway_<id>`` for openings, which are as
    large as the passage. Sites collide with nothing, so a robot drives through. A convex piece is a box where it is a
    rectangle along the axes, else a mesh with its corners in the file. Options are those of ``plan_bodies``.
    """
    built = plan_bodies(plan, **options)
    pose = built.pose
    bounds = shapely.total_bounds([pose.shape(wall) for wall in built.walls]).tolist()
    root, asset, world = _scene(plan.id, bounds, pose.z)
    _storey((asset, ET.SubElement(world, "body", _at("place", pose)) if pose else world), built)
    ET.indent(root)
    return {f"{plan.id}.xml": ET.tostring(root) + b"\n"}


def mjcf_building(plans: Sequence[FloorPlan], name: str, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<name>.xml``: a static body for each storey, named by the id of its plan, at its place and elevation.

    A body has the geoms and sites of ``mjcf``, whose names end in ``_storey_<number>``. Over the lowest storey,
    ``ceiling_<i>`` is the floor's part under walls; ``roof_<i>`` is the part that no storey above covers. The top
    storey has no roof. The storeys are stacked by ``stack_storeys``; their walls end under the next floor.
    """
    bodies = storey_bodies(plans, name, options)
    bounds = shapely.total_bounds([each.storey.pose.shape(each.slab) for each in bodies]).tolist()
    root, asset, world = _scene(name, bounds, bodies[0].storey.pose.z)
    for number, each in enumerate(bodies):
        end = f"_storey_{number}"
        body = ET.SubElement(world, "body", _at(valid_xml_text(each.storey.plan.id), each.storey.pose))
        into = asset, body
        _storey(into, each.built, end)
        if number:
            _slab(into, "ceiling", shapely.difference(each.slab, each.built.space), -FLOOR_M, end)
        _slab(into, "roof", each.roof, each.built.wall_height, end)
    ET.indent(root)
    return {f"{name}.xml": ET.tostring(root) + b"\n"}


def _at(name: str, pose: Pose) -> dict[str, str]:
    """Return the attributes of a body at a pose."""
    place = {"name": name, "pos": format_numbers(pose.x, pose.y, pose.z)}
    return place | ({"euler": f"0 0 {round(pose.yaw, 9):.9g}"} if pose.yaw else {})


def _scene(name: str, bounds: Sequence[float], floor_m: float) -> tuple[ET.Element, ET.Element, ET.Element]:
    """Return a file, its assets, and its world with a light and a ground under these bounds, at a height."""
    root = ET.Element("mujoco", model=name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    asset = ET.SubElement(root, "asset")
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 0 20", dir="-0.2 0.1 -1", directional="true", castshadow="false")
    x1, y1, x2, y2 = bounds
    middle, half = (
        format_numbers((x1 + x2) / 2, (y1 + y2) / 2, floor_m - _SLAB_M),
        format_numbers((x2 - x1) / 2 + 5, (y2 - y1) / 2 + 5, 1),
    )
    ET.SubElement(world, "geom", name="ground", type="plane", pos=middle, size=half, rgba="0.5 0.5 0.5 1")
    return root, asset, world


def _storey(into: _Into, built: PlanBodies, end: str = "") -> None:
    """Add the geoms and sites of a storey; their names get this end."""
    for name, colour, ring, low, high in _pieces(built):
        _geom(into, name + end, ring, (low, high), colour)
    asset, world = into
    things = ET.SubElement(world, "body", name=f"furniture{end}") if end and built.furniture else world
    for name, colour, ring, low, high in _furniture(built):
        _geom((asset, things), name + end, ring, (low, high), colour)
    for each in wall_openings(built.plan, built.wall_thickness):
        _site(world, each, built.door_height if each.has_leaf else built.wall_height, end)


def _slab(into: _Into, name: str, shape: BaseGeometry, low: float, end: str) -> None:
    """Add a slab, FLOOR_M thick."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and part.area > CRUMB_M2]
    for i, ring in enumerate(ring for part in parts for ring in cut_into_trapezoids(part)):
        _geom(into, f"{name}_{i}{end}", ring, (low, low + FLOOR_M), _WALL)


def _pieces(built: PlanBodies) -> Iterator[tuple[str, str, Any, float, float]]:
    """Yield convex pieces: name, colour, ring (n, 2), lower and upper height, metres."""
    walls = [ring for wall in built.standing for ring in cut_into_trapezoids(wall)]
    yield from ((f"wall_{i}", _WALL, ring, 0.0, built.wall_height) for i, ring in enumerate(walls))
    lintels = [ring for lintel in built.lintels for ring in cut_into_trapezoids(lintel)]
    if built.door_height < built.wall_height:
        yield from ((f"lintel_{i}", _LINTEL, r, built.door_height, built.wall_height) for i, r in enumerate(lintels))
    for name, kind, shape, low, high in built.window_parts:
        colour, parts = _GLASS if kind == "glass" else _WALL, shapely.get_parts(shape)
        rings = [ring for part in parts if part.area > CRUMB_M2 for ring in cut_into_trapezoids(part)]
        yield from ((f"{name}_{i}", colour, ring, low, high) for i, ring in enumerate(rings))
    for room in built.plan.rooms:
        for i, ring in enumerate(cut_into_trapezoids(room.polygon)):
            yield f"room|{room.id}|{room.label}|{i}", _FLOOR, ring, -_SLAB_M, 0.0
    rest = shapely.difference(built.space, shapely.union_all([room.polygon for room in built.plan.rooms]))
    floors = [ring for part in shapely.get_parts(rest) if part.area > CRUMB_M2 for ring in cut_into_trapezoids(part)]
    yield from ((f"floor_{i}", _FLOOR, ring, -_SLAB_M, 0.0) for i, ring in enumerate(floors))


def _furniture(built: PlanBodies) -> Iterator[tuple[str, str, Any, float, float]]:
    """Yield the convex pieces of the furniture, as ``_pieces`` does, and the blocks that shut the stairs from below."""
    for name, shape in built.named_wells:
        for i, ring in enumerate(cut_into_trapezoids(shape)):
            yield f"{name}_{i}", _WALL, ring, 0.0, built.wall_height
    for thing in built.furniture:
        for i, ring in enumerate(cut_into_trapezoids(thing.polygon) if thing.height > 0 else ()):
            yield f"object_{thing.id}_{i}", _THING, ring, 0.0, thing.height


def _geom(into: _Into, name: str, ring: Any, heights: tuple[float, float], colour: str) -> None:
    asset, world = into
    low, high = heights
    x1, y1, x2, y2 = shapely.Polygon(ring).bounds
    square = {tuple(corner) for corner in ring.tolist()} == {(x1, y1), (x2, y1), (x2, y2), (x1, y2)}
    if square:
        at = format_numbers((x1 + x2) / 2, (y1 + y2) / 2, (low + high) / 2)
        size = format_numbers((x2 - x1) / 2, (y2 - y1) / 2, (high - low) / 2)
        ET.SubElement(world, "geom", name=name, type="box", pos=at, size=size, rgba=colour)
        return
    corners = [(x, y, z) for z in heights for x, y in ring.tolist()]
    ET.SubElement(asset, "mesh", name=name, vertex=format_numbers(*np.ravel(corners).tolist()), inertia="shell")
    ET.SubElement(world, "geom", name=name, type="mesh", mesh=name, rgba=colour)


def _site(world: ET.Element, each: WallOpening, height: float, end: str) -> None:
    """Add the passage as a box along its own segment."""
    (ax, ay), (bx, by) = each.segment
    along = np.array([bx - ax, by - ay])
    length = float(np.hypot(*along))
    turn = float(np.arctan2(along[1], along[0]))
    across = np.array([-along[1], along[0]]) / max(length, TINY)
    depths = (shapely.get_coordinates(each.shape) - (ax, ay)) @ across
    middle = np.array([(ax + bx) / 2, (ay + by) / 2]) + across * float(depths.min() + depths.max()) / 2
    kind = "door" if each.has_leaf else "doorway"
    ET.SubElement(
        world,
        "site",
        name=f"{kind}_{each.door.id}{end}",
        type="box",
        pos=format_numbers(*middle.tolist(), height / 2),
        size=format_numbers(length / 2, float(depths.max() - depths.min()) / 2, height / 2),
        euler=format_numbers(0, 0, turn),
        rgba=_MARK,
    )
