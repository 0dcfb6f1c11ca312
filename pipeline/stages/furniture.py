"""Subtract furniture that stands on the floor from the rooms, if the build asks for it, and return it as obstacles.

R1  An object is an obstacle if it begins below ``KNEE_M``. A hanging lamp is not an obstacle.
R2  If furniture divides a room, its largest part in the main piece of the floor stays.
R3  Furniture without a name is what the evidence took for furniture, and what is thin and low and bounds no room. Its
    height is that of what stands there.
R4  An opening in the floor that the stairs from below fill for half or more, in no room, is an obstacle without height
    in all builds. So is what the source calls a stairwell, as our own exports do; it is no part of a room.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import drop_thin_parts, intersect, polygons_of, subtract, unite
from pipeline.geometry.meshes import footprint
from pipeline.geometry.rooms_and_passages import walkable_floor
from pipeline.tolerances import KNEE_M, MOST, SLIVER_M, TINY_M2
from pipeline.values import Evidence, FloorObstacle, Level, SourceObject, Spaces

UNNAMED = "object"


def subtract_furniture(level: Level, evidence: Evidence, spaces: Spaces) -> tuple[Spaces, tuple[FloorObstacle, ...]]:
    """Return the spaces without the area that furniture covers, and the furniture."""
    obstacles = [*_named_obstacles(level), *_unnamed_obstacles(level, evidence)]
    floor = unite(spaces.rooms)
    inside = [o for o in obstacles if intersect(o.polygon, floor).area > TINY_M2]
    if not inside:
        return spaces, ()
    furnished = _without(spaces, unite(o.polygon for o in inside))
    return (furnished, tuple(inside)) if furnished.rooms else (spaces, ())


def _without(spaces: Spaces, taken: BaseGeometry) -> Spaces:
    """Return the spaces without an area (R2); none where it leaves no floor."""
    parts = [polygons_of(drop_thin_parts(subtract(room, taken), SLIVER_M)) for room in spaces.rooms]
    left = replace(spaces, rooms=tuple(part for room in parts for part in room))
    reached = polygons_of(walkable_floor(left))
    if not reached:
        return spaces.keeping([])
    kept = [max(found, key=lambda p: intersect(p, reached[0]).area) for found in parts if found]
    owners = [k for k, found in enumerate(parts) if found]
    return replace(spaces.keeping(owners), rooms=tuple(kept))


def subtract_stairwells(level: Level, spaces: Spaces) -> tuple[Spaces, tuple[FloorObstacle, ...]]:
    """Return the spaces without the openings in the floor over stairs, and these as obstacles (R4)."""
    found = polygons_of(unite(footprint(each.mesh) for each in level.furniture if _is_stairwell(each)))
    if found and (left := _without(spaces, unite(found))).rooms:
        spaces = left
    if level.below is not None and level.stairs is not None:
        open_ = polygons_of(subtract(level.below, unite([*spaces.rooms, *found])))
        found += [part for part in open_ if intersect(part, level.stairs).area >= part.area * MOST]
    return spaces, tuple(FloorObstacle(part, 0.0, "stairs", in_room=False) for part in found)


def _is_stairwell(thing: SourceObject) -> bool:
    return bool(thing.words) and "stairwell" in re.split(r"[\W\d_]+", thing.words[0].lower())


def _named_obstacles(level: Level) -> list[FloorObstacle]:
    """Return the named objects that begin below the knee; a hanging lamp is no obstacle."""
    found = []
    for each in level.furniture:
        z = each.mesh.vertices[:, 2]
        if len(z) and z.min() < KNEE_M and not _is_stairwell(each):
            word = each.words[0] if each.words else UNNAMED
            found += [FloorObstacle(p, float(z.max()), word) for p in polygons_of(footprint(each.mesh))]
    return [obstacle for obstacle in found if obstacle.polygon.area > TINY_M2]


def _unnamed_obstacles(level: Level, evidence: Evidence) -> list[FloorObstacle]:
    """Return what the evidence took for furniture, and thin low things that bound no room."""
    if level.sills:
        return []
    named = unite(footprint(each.mesh) for each in level.furniture)
    parts = polygons_of(drop_thin_parts(subtract(unite([evidence.furniture, evidence.rails]), named), SLIVER_M))
    return [FloorObstacle(Polygon(part.exterior), _height(part, level), UNNAMED) for part in parts]


def _height(part: BaseGeometry, level: Level) -> float:
    points = level.walls.vertices
    x1, y1, x2, y2 = part.bounds
    near = points[(points[:, 0] >= x1) & (points[:, 0] <= x2) & (points[:, 1] >= y1) & (points[:, 1] <= y2)]
    standing = near[(near[:, 2] > 0) & (near[:, 2] < level.ceiling_m - SLIVER_M)]
    within = standing[shapely.intersects_xy(shapely.buffer(part, SLIVER_M), *standing[:, :2].T)]
    return float(np.max(within[:, 2])) if len(within) else 0.0
