"""Split a level into one level with its spaces for each building, so that no cut connects two of them.

R1  Parts of a level whose outlines stand apart are buildings. What stands wall to wall, with a joint of ``PARTITION_M``
    at most, is one building.
R2  Buildings are numbered by place, from the least x and then the least y; the number stands in the id before the
    level's (``_B1``).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from pipeline.geometry.areas import Shapes
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.rooms_and_passages import rooms_inside
from pipeline.tolerances import PARTITION_M
from pipeline.values import Level, SourceRoom, Spaces


def separate_buildings(level: Level, spaces: Spaces) -> list[tuple[Level, Spaces]]:
    """Return each building as a level with its spaces. A level with one building is returned as it is."""
    found = _of_buildings(level, spaces)  # R1
    if len(found) < 2:
        return found
    found.sort(key=lambda each: shapely.total_bounds(each[1].rooms)[:2].tolist())  # R2
    return [
        (replace(part, id=building_id(part.id, number)), inside) for number, (part, inside) in enumerate(found, start=1)
    ]


def _of_buildings(level: Level, spaces: Spaces) -> list[tuple[Level, Spaces]]:
    """Return each part whose outline stands apart as a building with its spaces."""
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


def building_id(level_id: str, number: int) -> str:
    """Return the id of a building of a level: ``house_L1`` becomes ``house_B2_L1``."""
    base, storey = re.fullmatch(r"(.*?)(_L\d+)?", level_id).groups()  # type: ignore[union-attr]
    return f"{base}_B{number}{storey or ''}"
