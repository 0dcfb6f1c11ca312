"""Find the openings of a plan's doors and windows through its walls as drawn, for formats that draw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from houseexpo.drawing.door_leaves import window_in_walls
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door
from houseexpo.tolerances import ENTRANCE_REACH_M, ENTRANCE_TOUCH_M, TINY

if TYPE_CHECKING:
    from shapely import Polygon


@dataclass(frozen=True, eq=False)
class WallOpening:
    """A door or window of the plan; ``shape`` is its opening in the drawn wall, ``segment`` the middle line of that."""

    door: Door
    shape: Polygon
    segment: tuple[tuple[float, float], tuple[float, float]]

    @property
    def has_leaf(self) -> bool:
        """Whether the opening has a door; a passage that the connectivity stage cut has no door."""
        return self.door.kind in {"door", "entrance"}


def wall_openings(plan: FloorPlan, wall_thickness: float) -> list[WallOpening]:
    """Return the doors of a plan whose outer walls are drawn ``wall_thickness`` metres thick."""
    return _through_walls(plan, plan.doors, wall_thickness)


def window_openings(plan: FloorPlan, wall_thickness: float) -> list[WallOpening]:
    """Return the windows of a plan whose outer walls are drawn ``wall_thickness`` metres thick."""
    return _through_walls(plan, plan.windows, wall_thickness)


def _through_walls(plan: FloorPlan, holes: Sequence[Door], wall_thickness: float) -> list[WallOpening]:
    found = []
    in_outline = {"entrance", "window"}  # these are no free space
    walls = shapely.union_all(plan.walls(wall_thickness)) if any(d.kind in in_outline for d in holes) else None
    for hole in holes:
        cut = hole.kind in in_outline
        shape = hole.polygon
        if walls is not None and hole.kind == "window":
            shape = window_in_walls(hole, walls, ENTRANCE_REACH_M) or shape
        elif walls is not None and cut:
            shape = _cut_in_wall(hole, walls)
        found.append(WallOpening(hole, shape, _middle(hole, shape) if cut else hole.segment))
    return found


def _cut_in_wall(door: Door, walls: shapely.Geometry) -> Polygon:
    """Return the opening of an entrance in an outer wall of the drawn thickness."""
    a, b = np.asarray(door.segment, np.float64)
    along = (b - a) / max(float(np.hypot(*(b - a))), TINY)
    across = np.array([-along[1], along[0]]) * ENTRANCE_REACH_M
    lane = shapely.Polygon([a - across, b - across, b + across, a + across])
    parts = shapely.get_parts(shapely.intersection(walls, lane))
    near = [p for p in parts if p.geom_type == "Polygon" and shapely.dwithin(p, door.polygon, ENTRANCE_TOUCH_M)]
    hull = shapely.convex_hull(shapely.union_all(near))
    return hull if hull.geom_type == "Polygon" else door.polygon


def _middle(door: Door, shape: Polygon) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the door's segment, moved to the middle of its shape."""
    a, b = np.asarray(door.segment, np.float64)
    along = (b - a) / max(float(np.hypot(*(b - a))), TINY)
    across = np.array([-along[1], along[0]])
    depths = (shapely.get_coordinates(shape) - a) @ across
    step = across * float(depths.min() + depths.max()) / 2
    return (float(a[0] + step[0]), float(a[1] + step[1])), (float(b[0] + step[0]), float(b[1] + step[1]))
