"""Stage: a world file, with walls as convex blocks."""

from __future__ import annotations

import math

from houseexpo.exports.files import Files, number, numbers
from houseexpo.exports.orientation import Orientation
from houseexpo.exports.solid import (
    ROBOT_RADIUS_M,
    WALL_HEIGHT_M,
    WALL_THICKNESS_M,
    solid,
    start_and_goal,
)
from houseexpo.exports.trapezoids import trapezoids
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring

_ROBOT = """define robot position
(
  size [{side} {side} 0.3]
  drive "diff"
  ranger ( sensor ( range [0.0 5.0] fov 180 samples 258 ) )
)
"""


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
    side = ROBOT_RADIUS_M * math.sqrt(2)  # the square that fits in the disc
    middle = numbers((x1 + x2) / 2, (y1 + y2) / 2)
    lines = [
        f"name {_quoted(plan.id)}",
        "resolution 0.02",
        "interval_sim 100",
        f"window ( size [800 800] center [{middle}] scale {number(round(700 / max(x2 - x1, y2 - y1), 2))} )",
        _ROBOT.format(side=number(round(side, 3))),
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


def _quoted(name: str) -> str:
    return '"' + name.replace('"', "'") + '"'  # strings of world files have no escapes
