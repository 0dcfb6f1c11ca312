"""Convert a plan to a Gazebo world (SDF): walls and furniture as boxes and prisms, doors as gaps under lintels."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, Unpack

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from houseexpo.exports.encoding import Files, format_numbers, valid_xml_text
from houseexpo.exports.placement import Pose
from houseexpo.exports.plan_bodies import (
    BodyOptions,
    PlanBodies,
    doorway_floors,
    entrance_doors,
    plan_bodies,
    room_floors,
)
from houseexpo.exports.polygons import cut_into_trapezoids
from houseexpo.exports.storeys import FLOOR_M, storey_bodies
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring

_VERSION = "1.6"  # read by Gazebo classic and by current Gazebo
_WALL, _LINTEL, _GROUND = "0.86 0.85 0.82 1", "0.78 0.72 0.62 1", "0.62 0.6 0.57 1"
_FURNITURE, _FLOOR, _GLASS = "0.66 0.53 0.4 1", "0.62 0.56 0.47 1", "0.7 0.85 0.9 0.4"
_FLOOR_M = 0.001  # height of floors over the ground plane, so that the two do not flicker


def sdf(plan: FloorPlan, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<id>.sdf`` in metres with z up and the plan's x and y (mirrored plans are mirrored back).

    Everything is in one file, and every model is static. The walls are one. Each convex piece of a wall has a collision
    and a visual: a box if the piece is a rectangle along the axes, else an extruded polyline. Furniture is another
    model, with the height of each piece. Each room has a model ``<label>_floor_<id>``, each doorway a model
    ``door_threshold_<id>`` or ``opening_threshold_<id>``: visuals on the ground, which collide with nothing. Each
    entrance has a model ``entrance_door_<id>``, which shuts it. A window is glass,
    ``window_<id>``, in the walls. Options are those of ``plan_bodies``.
    """
    built = plan_bodies(plan, **options)
    pose = built.pose
    root, world = _world(plan.id, shapely.total_bounds([pose.shape(wall) for wall in built.walls]).tolist(), pose.z)
    _storey(world, built, pose)
    return _file(plan.id, root)


def sdf_building(plans: Sequence[FloorPlan], name: str, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<name>.sdf``: a static model for each storey, named by the id of its plan, at its place and elevation.

    The models of ``sdf`` are parts of it, and above the lowest storey also ``floor``, on which a robot stands. ``roof``
    is the part of a storey that no storey above covers; the top storey has no roof. The storeys are stacked by
    ``stack_storeys``; their walls end under the next floor.
    """
    bodies = storey_bodies(plans, name, options)
    bounds = shapely.total_bounds([each.storey.pose.shape(each.slab) for each in bodies]).tolist()
    root, world = _world(name, bounds, bodies[0].storey.pose.z)
    for each in bodies:
        storey = each.storey
        model = _child(world, "model", name=valid_xml_text(storey.plan.id))
        _child(model, "static", "true")
        _child(model, "pose", _pose(storey.pose))
        if each is not bodies[0]:
            _model(model, "floor", _slab_pieces("floor", _FLOOR, each.slab, -FLOOR_M))
        _storey(model, each.built)
        if not each.roof.is_empty:
            _model(model, "roof", _slab_pieces("roof", _WALL, each.roof, each.built.wall_height))
    return _file(name, root)


def _slab_pieces(name: str, colour: str, shape: BaseGeometry, low: float) -> Iterator[_Piece]:
    """Yield the pieces of a floor or a roof, FLOOR_M thick."""
    for i, ring in enumerate(_convex(shape)):
        yield _Piece(f"{name}_{i}", colour, ring, low, low + FLOOR_M)


def _world(name: str, bounds: Sequence[float], floor_m: float) -> tuple[ET.Element, ET.Element]:
    """Return a file, and its world with a sun and a ground under these bounds, at a height."""
    root = ET.Element("sdf", version=_VERSION)
    world = ET.SubElement(root, "world", name=name)
    _sun(world)
    _ground(world, bounds, floor_m)
    return root, world


def _file(name: str, root: ET.Element) -> Files:
    ET.indent(root)
    return {f"{name}.sdf": b'<?xml version="1.0"?>\n' + ET.tostring(root) + b"\n"}


def _pose(pose: Pose) -> str:
    return f"{format_numbers(pose.x, pose.y, pose.z, 0, 0)} {round(pose.yaw, 9) + 0.0:.9g}"


def _storey(world: ET.Element, built: PlanBodies, pose: Pose = Pose()) -> None:  # noqa: B008
    """Add the models of a storey to a world, each at the storey's pose, or to the model of the storey."""
    doors = entrance_doors(built)
    _model(world, "walls", _pieces(built, shapely.union_all(list(doors.values()))), pose)
    for name, shape in doors.items():
        _model(world, name, _plates(name, _WALL, shape, built.door_height), pose)
    for name, shape in {**room_floors(built), **doorway_floors(built)}.items():
        _model(world, name, _plates(name, _FLOOR, shape, _FLOOR_M), pose, kinds=("visual",))
    for name, shape in built.named_wells:  # a block: an edge of the floor keeps no robot away
        _model(world, name, _plates(name, _WALL, shape, built.wall_height), pose)
    if built.furniture:
        _model(world, "furniture", _furniture(built), pose)


class _Piece(NamedTuple):
    """A convex ring, extruded from ``foot`` to ``top``, metres."""

    name: str
    colour: str
    ring: Ring
    low: float
    high: float


def _pieces(built: PlanBodies, entrances: BaseGeometry) -> Iterator[_Piece]:
    standing = built.standing
    walls = _convex(shapely.difference(shapely.union_all(standing), entrances) if entrances.area else standing)
    lintels = _convex(built.lintels)
    for i, ring in enumerate(walls):
        yield _Piece(f"wall_{i}", _WALL, ring, 0.0, built.wall_height)
    for i, ring in enumerate(lintels):
        yield _Piece(f"lintel_{i}", _LINTEL, ring, built.door_height, built.wall_height)
    for name, kind, shape, low, high in built.window_parts:
        for i, ring in enumerate(_convex(shape)):
            yield _Piece(f"{name}_{i}", _GLASS if kind == "glass" else _WALL, ring, low, high)
    if built.door_height < built.wall_height:
        for i, ring in enumerate(_convex(entrances)):
            yield _Piece(f"entrance_lintel_{i}", _WALL, ring, built.door_height, built.wall_height)


def _plates(name: str, colour: str, shape: BaseGeometry, height: float) -> Iterator[_Piece]:
    for i, ring in enumerate(_convex(shape)):
        yield _Piece(f"{name}_{i}", colour, ring, 0.0, height)


def _convex(shape: BaseGeometry | Iterable[BaseGeometry]) -> list[Ring]:
    shapes = shape if isinstance(shape, BaseGeometry) else list(shape)
    parts = [part for part in np.atleast_1d(shapely.get_parts(shapes)) if part.geom_type == "Polygon"]
    return [ring for part in parts for ring in cut_into_trapezoids(part)]


def _furniture(built: PlanBodies) -> Iterator[_Piece]:
    for thing in built.furniture:
        rings = cut_into_trapezoids(thing.polygon) if thing.height > 0 else []
        for i, ring in enumerate(rings):
            name = f"{valid_xml_text(thing.label).replace(' ', '_')}_{thing.id}" + (f"_{i}" if len(rings) > 1 else "")
            yield _Piece(name, _FURNITURE, ring, 0.0, thing.height)


def _model(
    world: ET.Element,
    name: str,
    pieces: Iterator[_Piece],
    pose: Pose = Pose(),  # noqa: B008 - frozen
    kinds: Sequence[str] = ("collision", "visual"),
) -> None:
    """Add pieces as one static model at a pose."""
    model = _child(world, "model", name=name)
    _child(model, "static", "true")
    if pose:
        _child(model, "pose", _pose(pose))
    link = _child(model, "link", name=name)
    for piece in pieces:
        for kind in kinds:
            _add_piece(link, kind, piece)


def _add_piece(link: ET.Element, kind: str, piece: _Piece) -> None:
    """Add a piece as a collision or a visual."""
    x1, y1, x2, y2 = shapely.Polygon(piece.ring).bounds
    square = {tuple(corner) for corner in piece.ring.tolist()} == {(x1, y1), (x2, y1), (x2, y2), (x1, y2)}
    part = _child(link, kind, name=f"{piece.name}_{kind}")
    if square:
        _child(part, "pose", format_numbers((x1 + x2) / 2, (y1 + y2) / 2, (piece.low + piece.high) / 2, 0, 0, 0))
        size = format_numbers(x2 - x1, y2 - y1, piece.high - piece.low)
        _child(_child(_child(part, "geometry"), "box"), "size", size)
    else:
        _child(part, "pose", format_numbers(0, 0, piece.low, 0, 0, 0))
        polyline = _child(_child(part, "geometry"), "polyline")
        for x, y in piece.ring.tolist():
            _child(polyline, "point", format_numbers(x, y))
        _child(polyline, "height", format_numbers(piece.high - piece.low))
    if kind == "visual":
        _add_colour(part, piece.colour)


def _ground(world: ET.Element, bounds: Sequence[float], floor_m: float) -> None:
    x1, y1, x2, y2 = bounds
    model = _child(world, "model", name="ground")
    _child(model, "static", "true")
    _child(model, "pose", format_numbers((x1 + x2) / 2, (y1 + y2) / 2, floor_m, 0, 0, 0))
    link = _child(model, "link", name="ground")
    for kind in ("collision", "visual"):
        part = _child(link, kind, name=f"ground_{kind}")
        plane = _child(_child(part, "geometry"), "plane")
        _child(plane, "normal", "0 0 1")
        _child(plane, "size", format_numbers(x2 - x1 + 10, y2 - y1 + 10))
        if kind == "visual":
            _add_colour(part, _GROUND)


def _sun(world: ET.Element) -> None:
    light = _child(world, "light", name="sun", type="directional")
    _child(light, "cast_shadows", "false")
    _child(light, "pose", "0 0 10 0 0 0")
    _child(light, "diffuse", "0.9 0.9 0.9 1")
    _child(light, "direction", "-0.4 0.3 -0.9")


def _add_colour(visual: ET.Element, colour: str) -> None:
    material = _child(visual, "material")
    for light in ("ambient", "diffuse"):
        _child(material, light, colour)


def _child(parent: ET.Element, tag: str, text: str | None = None, **attributes: str) -> ET.Element:
    child = ET.SubElement(parent, tag, attributes)
    child.text = text
    return child
