"""Convert a plan to a world of a 2D robot simulator (IR-SIM, Stage): walls as convex polygons, and a robot."""

from __future__ import annotations

import json
import math

from houseexpo.exports.encoding import Files, number, numbers
from houseexpo.exports.orientation import Orientation
from houseexpo.exports.polygons import trapezoids
from houseexpo.exports.solid import WALL_HEIGHT_M, WALL_THICKNESS_M, solid, start_and_goal
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring
from houseexpo.tolerances import ROBOT_M

_STAGE_ROBOT = """define robot position
(
  size [{side} {side} 0.3]
  drive "diff"
  ranger ( sensor ( range [0.0 5.0] fov 180 samples 258 ) )
)
"""


def irsim(plan: FloorPlan, *, wall_thickness: float = WALL_THICKNESS_M, orientation: Orientation = "world") -> Files:
    """Write ``<id>.irsim.yaml``, in the plan's x and y in metres (mirrored plans are mirrored back).

    Obstacles are convex, as IR-SIM's planners require. One robot with a lidar starts at the widest place; its goal is a
    far place that it can reach.
    """
    built = solid(plan, wall_thickness=wall_thickness, orientation=orientation)
    x1, y1, x2, y2 = built.bounds
    start, goal = start_and_goal(built.free)
    solids = (*built.walls, *(thing.polygon for thing in built.furniture))
    lines = [
        f"# plan {json.dumps(plan.id)}; metres",
        "world:",
        f"  width: {number(x2 - x1)}",
        f"  height: {number(y2 - y1)}",
        f"  offset: {_list(x1, y1)}",
        "  step_time: 0.1",
        "  collision_mode: 'stop'",
        "robot:",
        "  - kinematics: {name: 'diff'}",
        f"    shape: {{name: 'circle', radius: {number(ROBOT_M)}}}",
        f"    state: {_list(*start, 0)}",
        f"    goal: {_list(*goal, 0)}",
        "    sensors:",
        "      - {name: 'lidar2d', range_min: 0, range_max: 5, angle_range: 3.14159265, number: 180}",
        "obstacle:",
        *(_obstacle(ring) for shape in solids for ring in trapezoids(shape)),
    ]
    return {f"{plan.id}.irsim.yaml": ("\n".join(lines) + "\n").encode()}


def _obstacle(ring: Ring) -> str:
    vertices = ", ".join(_list(x, y) for x, y in ring.tolist())
    return f"  - {{shape: {{name: 'polygon', vertices: [{vertices}]}}, state: [0, 0, 0]}}"


def _list(*values: float) -> str:
    return f"[{', '.join(map(number, values))}]"


def stage(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    wall_height: float = WALL_HEIGHT_M,
    orientation: Orientation = "world",
) -> Files:
    """Write ``<id>.world``, in the plan's x and y in metres (mirrored plans are mirrored back).

    Stage scales a model's blocks to the model's size and centres them on its pose; both are set so that blocks keep
    their coordinates. Stage draws blocks as convex polygons, so that walls are cut into convex pieces. One robot with a
    laser starts at the widest place. Options are those of ``houseexpo.exports.solid.solid``.
    """
    built = solid(
        plan,
        wall_thickness=wall_thickness,
        wall_height=wall_height,
        door_height=wall_height,  # no lintels: a 2D robot would never meet one
        orientation=orientation,
    )
    x1, y1, x2, y2 = built.bounds
    (x, y), _ = start_and_goal(built.free)
    side = ROBOT_M * math.sqrt(2)  # the square that fits in the disc
    middle = numbers((x1 + x2) / 2, (y1 + y2) / 2)
    lines = [
        f"name {_quote(plan.id)}",
        "resolution 0.02",
        "interval_sim 100",
        f"window ( size [800 800] center [{middle}] scale {number(round(700 / max(x2 - x1, y2 - y1), 2))} )",
        _STAGE_ROBOT.format(side=number(round(side, 3))),
        "model",
        "(",
        '  name "walls"',
        '  color "gray30"',
        f"  size [{numbers(x2 - x1, y2 - y1, built.wall_height)}]",
        f"  pose [{middle} 0 0]",
        "  gui_nose 0",
        "  gui_move 0",
        "  obstacle_return 1",
        *(_block(ring, built.wall_height) for wall in built.walls for ring in trapezoids(wall)),
        *(_block(ring, thing.height) for thing in built.furniture for ring in trapezoids(thing.polygon)),
        ")",
        f'robot ( name "robot" pose [{numbers(x, y, 0, 0)}] )',
    ]
    return {f"{plan.id}.world": ("\n".join(lines) + "\n").encode()}


def _block(ring: Ring, height: float) -> str:
    points = " ".join(f"point[{i}] [{numbers(x, y)}]" for i, (x, y) in enumerate(ring.tolist()))
    return f"  block ( points {len(ring)} {points} z [{numbers(0, height)}] )"


def _quote(name: str) -> str:
    return '"' + name.replace('"', "'") + '"'  # strings of world files have no escapes
