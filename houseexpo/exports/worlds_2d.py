"""Convert a plan to a world of a 2D robot simulator (IR-SIM, Stage): walls as convex polygons, and a robot."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np

from houseexpo.analysis.navigability import disc_centre_areas
from houseexpo.exports.encoding import Files, format_number, format_numbers
from houseexpo.exports.placement import ExportFrame, Orientation, Pose, pose_in_export
from houseexpo.exports.plan_bodies import WALL_HEIGHT_M, WALL_THICKNESS_M, PlanBodies, plan_bodies
from houseexpo.exports.polygons import cut_into_trapezoids
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring
from houseexpo.tolerances import ROBOT_M

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Point = tuple[float, float]

_STAGE_ROBOT = """define robot position
(
  size [{side} {side} 0.3]
  drive "diff"
  ranger ( sensor ( range [0.0 5.0] fov 180 samples 258 ) )
)
"""


def irsim(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.irsim.yaml``, in metres (mirrored plans are mirrored back).

    Obstacles are convex, as IR-SIM's planners require. One robot with a lidar starts at the widest place; its goal is a
    far place that it can reach.
    """
    built = plan_bodies(plan, wall_thickness=wall_thickness, orientation=orientation)
    pose = pose_in_export(plan, orientation, frame)
    x1, y1, x2, y2 = _bounds(built, pose)
    start, goal = map(pose.point, start_and_goal(built.free))
    solids = (*built.walls, *built.wells, *(thing.polygon for thing in built.furniture))
    lines = [
        f"# plan {json.dumps(plan.id)}; metres",
        "world:",
        f"  width: {format_number(x2 - x1)}",
        f"  height: {format_number(y2 - y1)}",
        f"  offset: {_list(x1, y1)}",
        "  step_time: 0.1",
        "  collision_mode: 'stop'",
        "robot:",
        "  - kinematics: {name: 'diff'}",
        f"    shape: {{name: 'circle', radius: {format_number(ROBOT_M)}}}",
        f"    state: {_list(*start, 0)}",
        f"    goal: {_list(*goal, 0)}",
        "    sensors:",
        "      - {name: 'lidar2d', range_min: 0, range_max: 5, angle_range: 3.14159265, number: 180}",
        "obstacle:",
        *(_obstacle(pose.points(ring)) for shape in solids for ring in cut_into_trapezoids(shape)),
    ]
    return {f"{plan.id}.irsim.yaml": ("\n".join(lines) + "\n").encode()}


def _bounds(built: PlanBodies, pose: Pose) -> tuple[float, float, float, float]:
    """Return the bounds of the walls in the export."""
    import shapely

    x1, y1, x2, y2 = shapely.total_bounds([pose.shape(wall) for wall in built.walls]).tolist()
    return x1, y1, x2, y2


def _obstacle(ring: Ring) -> str:
    vertices = ", ".join(_list(x, y) for x, y in ring.tolist())
    return f"  - {{shape: {{name: 'polygon', vertices: [{vertices}]}}, state: [0, 0, 0]}}"


def _list(*values: float) -> str:
    return f"[{', '.join(map(format_number, values))}]"


def stage(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    wall_height: float = WALL_HEIGHT_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.world``, in metres (mirrored plans are mirrored back).

    Stage scales a model's blocks to the model's size and centres them on its pose; both are set so that blocks keep
    their coordinates. Stage draws blocks as convex polygons, so that walls are cut into convex pieces. One robot with a
    laser starts at the widest place. Options are those of ``houseexpo.exports.plan_bodies.plan_bodies``.
    """
    built = plan_bodies(
        plan,
        wall_thickness=wall_thickness,
        wall_height=wall_height,
        door_height=wall_height,  # no lintels: a 2D robot would never meet one
        orientation=orientation,
    )
    pose = pose_in_export(plan, orientation, frame)
    x1, y1, x2, y2 = _bounds(built, pose)
    x, y = pose.point(start_and_goal(built.free)[0])
    side = ROBOT_M * math.sqrt(2)  # the square that fits in the disc
    middle = format_numbers((x1 + x2) / 2, (y1 + y2) / 2)
    lines = [
        f"name {_quote(plan.id)}",
        "resolution 0.02",
        "interval_sim 100",
        f"window ( size [800 800] center [{middle}] scale {format_number(round(700 / max(x2 - x1, y2 - y1), 2))} )",
        _STAGE_ROBOT.format(side=format_number(round(side, 3))),
        "model",
        "(",
        '  name "walls"',
        '  color "gray30"',
        f"  size [{format_numbers(x2 - x1, y2 - y1, built.wall_height)}]",
        f"  pose [{middle} 0 0]",
        "  gui_nose 0",
        "  gui_move 0",
        "  obstacle_return 1",
        *(
            _block(pose.points(ring), built.wall_height)
            for solid in (*built.walls, *built.wells)
            for ring in cut_into_trapezoids(solid)
        ),
        *(
            _block(pose.points(ring), thing.height)
            for thing in built.furniture
            for ring in cut_into_trapezoids(thing.polygon)
        ),
        ")",
        f'robot ( name "robot" pose [{format_numbers(x, y, 0, 0)}] )',
    ]
    return {f"{plan.id}.world": ("\n".join(lines) + "\n").encode()}


def _block(ring: Ring, height: float) -> str:
    points = " ".join(f"point[{i}] [{format_numbers(x, y)}]" for i, (x, y) in enumerate(ring.tolist()))
    return f"  block ( points {len(ring)} {points} z [{format_numbers(0, height)}] )"


def _quote(name: str) -> str:
    return '"' + name.replace('"', "'") + '"'  # strings of world files have no escapes


def start_and_goal(space: Polygon | MultiPolygon) -> tuple[Point, Point]:
    """Return the widest place of a free space, and a far place that a robot can reach from it, metres.

    If the space is too narrow for the robot, both are the same point inside.
    """
    import shapely

    pieces = disc_centre_areas(space, ROBOT_M)
    if not pieces:
        point = space.representative_point()
        return (point.x, point.y), (point.x, point.y)
    start = np.asarray(shapely.maximum_inscribed_circle(pieces[0], tolerance=0.01).coords[0])
    corners = np.asarray(pieces[0].exterior.coords)
    goal = corners[np.argmax(np.hypot(*(corners - start).T))]
    (x1, y1), (x2, y2) = start.round(3).tolist(), goal.round(3).tolist()
    return (x1, y1), (x2, y2)
