"""Convert a plan to closed 3D bodies of walls with lintels, floor and furniture, as a glTF (GLB) or OBJ file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final, Unpack

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.exports.encoding import Files, valid_xml_text
from houseexpo.exports.placement import Pose
from houseexpo.exports.plan_bodies import (
    BodyOptions,
    PlanBodies,
    doorway_floors,
    entrance_doors,
    plan_bodies,
    room_floors,
    unnamed_floor,
)
from houseexpo.exports.storeys import FLOOR_M, RISER_M, storey_bodies
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import all_rings

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold
    from shapely.geometry.base import BaseGeometry

_COLOURS: Final = {
    "walls": (221, 218, 209, 255),
    "floor": (158, 142, 120, 255),
    "furniture": (168, 135, 102, 255),
    "glass": (178, 216, 230, 102),
}


def glb(plan: FloorPlan, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<id>.glb`` (binary glTF 2.0) in metres with y up: world (x, y, z) becomes (X, Y, Z) = (x, z, -y).

    World x and y are the plan's (mirrored plans are mirrored back), and z is the height above the floor. The nodes are
    ``walls`` (with doors as gaps under lintels), ``window_<id>`` (glass in a hole of the walls),
    ``entrance_door_<id>``, ``<label>_floor_<id>`` of each room, ``door_threshold_<id>`` or
    ``opening_threshold_<id>``, ``floor`` (under the walls) and, if there is any, ``furniture``; each is a closed body.
    In the frame of the source they are in the node ``place``, which moves and turns them. Options are those
    of ``houseexpo.exports.plan_bodies.plan_bodies``.
    """
    import trimesh

    built = plan_bodies(plan, **options)
    scene = trimesh.Scene()
    if built.pose:
        scene.graph.update(frame_to=_PLACE, matrix=_matrix(built.pose))
    _add_bodies(scene, built, within=_PLACE if built.pose else None)
    return {f"{plan.id}.glb": bytes(scene.export(file_type="glb"))}


def obj(plan: FloorPlan, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<id>.obj`` with the axes, bodies and options of ``glb``, without colours."""
    from trimesh import Scene
    from trimesh.exchange.obj import export_obj

    built = plan_bodies(plan, **options)
    scene = Scene()
    _add_bodies(scene, built, pose=built.pose)
    text = export_obj(scene, include_normals=False, include_color=False, include_texture=False, digits=6)
    return {f"{plan.id}.obj": text.encode() + b"\n"}


def glb_building(plans: Sequence[FloorPlan], name: str, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<name>.glb``: a node for each storey, named by the id of its plan, at its place and elevation.

    The storeys are stacked by ``stack_storeys``; their walls end under the next floor. A storey's node has the nodes of
    ``glb`` and ``roof``, the part that no storey above covers. The top storey has no roof.
    """
    bodies = storey_bodies(plans, name, options)
    import trimesh
    from trimesh.exchange.gltf import export_glb

    scene = trimesh.Scene()
    for number, each in enumerate(bodies):
        node = f"{number}{_STOREY}{each.storey.plan.id}"
        scene.graph.update(frame_to=node, matrix=_matrix(each.storey.pose))
        _add_bodies(scene, each.built, roof=each.roof, within=node, prefix=f"{number}{_STOREY}")
    return {f"{name}.glb": bytes(export_glb(scene, tree_postprocessor=_without_prefixes))}


def obj_building(plans: Sequence[FloorPlan], name: str, **options: Unpack[BodyOptions]) -> Files:
    """Write ``<name>.obj``: the objects of ``obj`` for each storey, with ``_storey_<number>`` after their names.

    The storeys are stacked as in ``glb_building``; comments say which plan is which storey.
    """
    from trimesh import Scene
    from trimesh.exchange.obj import export_obj

    bodies = storey_bodies(plans, name, options)
    scene, lines = Scene(), []
    for number, each in enumerate(bodies):
        lines.append(f"# storey {number}: {valid_xml_text(each.storey.plan.id)}\n")
        pose, suffix = each.storey.pose, f"_storey_{number}"
        _add_bodies(scene, each.built, roof=each.roof, pose=pose, suffix=suffix)
    text = export_obj(scene, include_normals=False, include_color=False, include_texture=False, digits=6)
    return {f"{name}.obj": ("".join(lines) + text + "\n").encode()}


_PLACE: Final = "place"
_STOREY: Final = "|"
"""Between the number of a storey and the name of its node: names in a scene must differ, in a file they need not."""


def _without_prefixes(tree: dict[str, Any]) -> None:
    for each in (*tree["nodes"], *tree["meshes"]):
        each["name"] = each["name"].partition(_STOREY)[2] or each["name"]


def _matrix(pose: Pose) -> npt.NDArray[np.float64]:
    """Return the matrix (4, 4) of a pose between nodes, whose axes have y up."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    rows = [[cos, 0, sin, pose.x], [0, 1, 0, pose.z], [-sin, 0, cos, 0.0 - pose.y], [0, 0, 0, 1]]
    return np.array(rows, np.float64)


def _add_bodies(
    scene: trimesh.Scene,
    built: PlanBodies,
    *,
    roof: BaseGeometry | None = None,
    within: str | None = None,
    prefix: str = "",
    suffix: str = "",
    pose: Pose = Pose(),  # noqa: B008 - frozen
) -> None:
    """Add the parts of a house at a pose in the node ``within``."""
    import trimesh

    materials = {
        name: trimesh.visual.material.PBRMaterial(
            name=name, baseColorFactor=colour, roughnessFactor=0.9, alphaMode="BLEND" if colour[3] < 255 else None
        )
        for name, colour in _COLOURS.items()
    }
    for part, material, body in _bodies(built, roof):
        name = f"{prefix}{part}{suffix}"
        mesh = body.to_mesh64()
        points = np.asarray(mesh.vert_properties)[:, :3]
        (x, y), z = pose.points(points[:, :2]).T, points[:, 2] + pose.z
        upright = np.column_stack([x, z, 0.0 - y])  # not -y: no negative zeros in the text
        shown = trimesh.Trimesh(upright, np.asarray(mesh.tri_verts), process=False)
        shown.visual = trimesh.visual.TextureVisuals(material=materials[material])
        scene.add_geometry(shown, node_name=name, geom_name=name, parent_node_name=within)


def _bodies(built: PlanBodies, roof: BaseGeometry | None = None) -> Iterator[tuple[str, str, Manifold]]:
    """Yield the name, material and body of each part of the house."""
    doors = entrance_doors(built)
    yield "walls", "walls", _without_windows(_walls(built, list(doors.values())), built)
    for name, shape in doors.items():
        yield name, "walls", extrude_polygon(shape, built.door_height)
    for name, kind, shape, low, high in built.window_parts:
        if kind == "glass":
            yield name, kind, extrude_polygon(shape, high - low).translate((0, 0, low))
    floors = {**room_floors(built), **doorway_floors(built)}
    for name, shape in {**floors, "floor": unnamed_floor(built, floors)}.items():
        yield name, "floor", extrude_polygon(shape, FLOOR_M).translate((0, 0, -FLOOR_M))
    for name, shape in built.named_wells:
        yield name, "furniture", extrude_polygon(shape, FLOOR_M).translate((0, 0, -RISER_M - FLOOR_M))
    if any(thing.height > 0 for thing in built.furniture):
        yield "furniture", "furniture", _furniture(built)
    if roof is not None and not roof.is_empty:
        yield "roof", "walls", extrude_polygon(roof, FLOOR_M).translate((0, 0, built.wall_height))


def _walls(built: PlanBodies, doors: list[BaseGeometry]) -> Manifold:
    """Return the walls: one part up to the height of doors, and one with lintels above."""
    above = shapely.union_all([*built.walls, *built.lintels])
    if not built.lintels and not doors:
        return extrude_polygon(above, built.wall_height)
    below = extrude_polygon(
        shapely.difference(shapely.union_all(built.walls), shapely.union_all(doors)), built.door_height
    )
    if built.door_height == built.wall_height:
        return below
    return below + extrude_polygon(above, built.wall_height - built.door_height).translate((0, 0, built.door_height))


def _without_windows(walls: Manifold, built: PlanBodies) -> Manifold:
    from manifold3d import Manifold, OpType

    holes = [extrude_polygon(each.shape, each.head - each.sill).translate((0, 0, each.sill)) for each in built.windows]
    return walls - Manifold.batch_boolean(holes, OpType.Add) if holes else walls


def _furniture(built: PlanBodies) -> Manifold:
    from manifold3d import Manifold, OpType

    pieces = [extrude_polygon(thing.polygon, thing.height) for thing in built.furniture if thing.height > 0]
    return Manifold.batch_boolean(pieces, OpType.Add)


def extrude_polygon(shape: Any, height: float) -> Manifold:
    """Return a closed body on a shape, from height 0 to ``height``."""
    from manifold3d import CrossSection, FillRule

    return CrossSection(all_rings(shape), FillRule.EvenOdd).extrude(height)
