"""Split a level into one level with its spaces for each building or dwelling, so that no cut connects two of them.

R1  Parts of a level whose outlines stand apart are buildings. What stands wall to wall, with a joint of ``PARTITION_M``
    at most, is one building.
R2  Buildings are numbered by place, from the least x and then the least y; the number stands in the id before the
    level's (``_B1``).
R3  With ``dwellings``, dwellings wall to wall are buildings too, if the source names its doors. A dwelling has
    ``DWELLING_M2`` and ``GROUP`` rooms or more, no door to another dwelling, and its own way from outside: an entrance,
    or on an upper storey the void of a stair. A smaller part belongs to the nearest dwelling.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import IsolatedConfig
from pipeline.geometry.areas import Shapes, intersect, polygons_of, subtract, unite
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.rooms_and_passages import connected_rooms, rooms_inside
from pipeline.tolerances import GROUP, HAND_M, PARTITION_M, SHEET_M
from pipeline.values import Level, SourceRoom, Spaces

DWELLING_M2: Final = 25.0
STAIR_M2: Final = 1.0


def separate_buildings(level: Level, spaces: Spaces, config: IsolatedConfig) -> list[tuple[Level, Spaces]]:
    """Return each building as a level with its spaces. A level with one building is returned as it is."""
    found = _of_buildings(level, spaces)  # R1
    if config.dwellings:  # R3
        found = [dwelling for building in found for dwelling in _separate_dwellings(*building)]
    if len(found) < 2:
        return found
    found.sort(key=lambda each: shapely.total_bounds(each[1].rooms)[:2].tolist())  # R2
    return [
        (replace(part, id=building_id(part.id, number)), inside) for number, (part, inside) in enumerate(found, start=1)
    ]


def _of_buildings(level: Level, spaces: Spaces) -> list[tuple[Level, Spaces]]:
    """R1."""
    outlines = list(spaces.outlines)
    near = shapely.STRtree(outlines).query(outlines, predicate="dwithin", distance=PARTITION_M).T
    groups = connected_groups(len(outlines), near.tolist())
    if len(groups) < 2:
        return [(level, spaces)]
    outline_of, room_in = rooms_inside(outlines, spaces.rooms)
    drawn, middles = _middles_of_rooms(level)
    outline_at, drawn_in = shapely.STRtree(middles).query(outlines, predicate="intersects")
    found = []
    for group in groups:
        inside = np.unique(room_in[np.isin(outline_of, group)]).tolist()
        if not inside:
            continue
        part = replace(spaces.keeping(inside), outlines=tuple(outlines[k] for k in group))
        rooms = tuple(drawn[k] for k in np.unique(drawn_in[np.isin(outline_at, group)]).tolist())
        found.append((with_floor_near(part.outlines, _with_rooms(level, rooms)), part))
    return found


def _middles_of_rooms(level: Level) -> tuple[list[SourceRoom], Shapes]:
    """Return the source's rooms with a known place, and their middles (n,)."""
    placed = [room for room in level.rooms if room.polygon is not None or room.box is not None]
    shapes = [shapely.box(*room.box) if room.polygon is None and room.box else room.polygon for room in placed]
    return placed, np.asarray(shapely.centroid(np.array(shapes, np.object_)), np.object_)


def with_floor_near(outlines: Sequence[Polygon], level: Level) -> Level:
    """Return a level with only the pieces of its floor that reach into the convex hull of some outlines.

    The floors of other buildings do not matter for one, and take time.
    """
    if level.floor is None:
        return level
    pieces, hull = shapely.get_parts(level.floor), shapely.convex_hull(shapely.multipolygons(outlines))
    return replace(level, floor=shapely.multipolygons(pieces[shapely.intersects(pieces, hull)]))


def _with_rooms(level: Level, rooms: tuple[SourceRoom, ...]) -> Level:
    """Return a level with only these of the source's rooms."""
    return replace(level, rooms=rooms, room_count=len(rooms) if level.room_count is not None else None)


def _separate_dwellings(level: Level, spaces: Spaces) -> list[tuple[Level, Spaces]]:
    """R3, in one building."""
    parts = connected_rooms(spaces)
    if not level.names_doors or len(parts) < 2:
        return [(level, spaces)]
    named: list[list[SourceRoom]] = [[] for _ in parts]
    for room in level.rooms:
        named[_nearest(room, spaces, parts)].append(room)
    entered = {side for p in spaces.passages if p.leads_outside and p.closed_by == "door" for side in p.sides}
    stairs = _stair_voids(level, spaces)
    dwellings = [
        k
        for k, part in enumerate(parts)
        if sum(spaces.rooms[room].area for room in part) >= DWELLING_M2
        and len(named[k] if level.rooms else part) >= GROUP
        and (entered.intersection(part) or any(spaces.rooms[r].distance(v) < SHEET_M for r in part for v in stairs))
    ]
    shapes = [unite([spaces.rooms[room] for room in part]) for part in parts]
    doors = [each.polygon for each in level.openings if each.has_door]
    if len(dwellings) < 2 or any(_stands_between(door, [shapes[k] for k in dwellings]) for door in doors):
        return [(level, spaces)]
    home = [min(dwellings, key=lambda k: (shape.distance(shapes[k]), k)) for shape in shapes]
    found = []
    for dwelling in dwellings:
        inside = sorted(room for k, part in enumerate(parts) if home[k] == dwelling for room in part)
        rooms = tuple(room for k in range(len(parts)) if home[k] == dwelling for room in named[k])
        found.append((_with_rooms(level, rooms), spaces.keeping(inside)))
    return found


def _nearest(room: SourceRoom, spaces: Spaces, parts: Sequence[Sequence[int]]) -> int:
    """Return the part of a building that a room of the source lies in, or that is nearest to it."""
    shape = room.polygon if room.polygon is not None else shapely.box(*room.box) if room.box is not None else None
    if shape is None:
        return 0
    point = shape.representative_point()
    return min(range(len(parts)), key=lambda k: min(spaces.rooms[each].distance(point) for each in parts[k]))


def _stair_voids(level: Level, spaces: Spaces) -> list[Polygon]:
    """Return the areas where the storey below shows, between walls that hold no room there."""
    if level.below is None:
        return []
    free = subtract(unite(spaces.outlines), unite([spaces.walls, *spaces.rooms]))
    return [void for void in polygons_of(intersect(free, level.below)) if void.area > STAIR_M2]


def _stands_between(door: Polygon, parts: Sequence[BaseGeometry]) -> bool:
    """Return whether the source names a door between two parts, although no way was found there."""
    box = shapely.buffer(door, HAND_M, join_style="mitre")
    return sum(bool(part.intersects(box)) for part in parts) > 1


def building_id(level_id: str, number: int) -> str:
    """Return the id of a building of a level: ``house_L1`` becomes ``house_B2_L1``."""
    base, storey = re.fullmatch(r"(.*?)(_L\d+)?", level_id).groups()  # type: ignore[union-attr]
    return f"{base}_B{number}{storey or ''}"
