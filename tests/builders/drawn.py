"""What a person might draw into a plan: doors in walls that have none, and points in rooms; and what may not change."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Point, Polygon

from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Door, Frame, Room

DOOR_M = 0.9
Line = tuple[tuple[float, float], tuple[float, float]]


def walls_without_door(plan: FloorPlan, thickest_m: float = 0.5) -> Iterator[tuple[Line, Room, Room]]:
    """Doors (in the plan's metres) in the middles of walls between two rooms, clear of the doors that it has."""
    for room in plan.rooms:
        points = np.vstack([room.ring, room.ring[:1]])
        for a, b in pairwise(points):
            length = math.dist(a, b)
            if length < DOOR_M + 0.4:
                continue
            along = (b - a) / length
            for out in (np.array([-along[1], along[0]]), np.array([along[1], -along[0]])):
                found = _across((a + b) / 2, along, out, room, plan, thickest_m)
                if found is not None and found[1].id > room.id:
                    yield found[0], room, found[1]


def _across(
    middle: npt.NDArray[np.float64],
    along: npt.NDArray[np.float64],
    out: npt.NDArray[np.float64],
    room: Room,
    plan: FloorPlan,
    thickest_m: float,
) -> tuple[Line, Room] | None:
    if room.polygon.covers(Point(middle + 0.02 * out)):
        return None
    ends = [middle - DOOR_M / 2 * along, middle + DOOR_M / 2 * along]
    if any(door.polygon.distance(LineString(ends)) < 0.6 for door in plan.doors):
        return None
    for other in plan.rooms:
        rays = [LineString([end, end + thickest_m * out]) for end in ends]
        far = [float(other.polygon.intersection(ray).distance(Point(end))) for ray, end in zip(rays, ends, strict=True)]
        faces = all(math.isfinite(each) and each > 0.03 for each in far) and abs(far[0] - far[1]) < 0.01
        if other.id != room.id and faces:
            one, two = (tuple((end + far[0] / 2 * out).tolist()) for end in ends)
            return (one, two), other
    return None


def in_source(plan: FloorPlan, points: npt.ArrayLike) -> list[list[float]]:
    """Points of a plan in its source's axes."""
    assert plan.frame is not None
    return source_points_from_plan(plan.frame, np.array(points)).tolist()  # type: ignore[no-any-return]


def _shape(frame: Frame, ring: npt.NDArray[np.float64]) -> Polygon:
    return Polygon(source_points_from_plan(frame, ring))


def changed_shapes(before: FloorPlan, after: FloorPlan) -> list[Polygon]:
    """Areas, in the source's axes, of rooms and doors that only one of two plans has, but for rounding to the grid."""
    assert before.frame is not None
    assert after.frame is not None
    one = [_shape(before.frame, part.ring) for part in (*before.rooms, *before.doors)]
    other = [_shape(after.frame, part.ring) for part in (*after.rooms, *after.doors)]
    return [*_missing(one, other), *_missing(other, one)]


def _missing(shapes: list[Polygon], among: list[Polygon]) -> Iterator[Polygon]:
    tree = shapely.STRtree(among)
    for shape in shapes:
        near = [among[k] for k in tree.query(shape)]
        if not any(shapely.hausdorff_distance(shape, each) < 0.011 for each in near):
            yield shape


def doors_beside(plan: FloorPlan, room: Room) -> list[Door]:
    """The passages of a room."""
    return [door for door in plan.doors if room.id in door.rooms]
