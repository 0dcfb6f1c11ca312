"""IR-SIM: a world in YAML, walls as convex polygons."""

from __future__ import annotations

import json

from houseexpo.exports.files import Files, number
from houseexpo.exports.orientation import Orientation
from houseexpo.exports.solid import ROBOT_RADIUS_M, WALL_THICKNESS_M, solid, start_and_goal
from houseexpo.exports.trapezoids import trapezoids
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring


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
        f"    shape: {{name: 'circle', radius: {number(ROBOT_RADIUS_M)}}}",
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
