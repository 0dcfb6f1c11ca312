"""Find the contour of a house, drop cells and parts that are too small for it, and split it into its buildings.

No cut connects two buildings.

R1  Parts of a level whose outlines stand apart are buildings. What stands wall to wall, with a joint of ``PARTITION_M``
    at most, is one building.
R2  Buildings are numbered by place, from the least x and then the least y; the number stands in the id before the
    level's (``_B1``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.plan.ids import building_id
from pipeline.config import CellsConfig, IsolatedConfig
from pipeline.geometry.areas import Shapes, polygons_of, shares_inside, unite
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.rooms_and_passages import connected_rooms, rooms_inside
from pipeline.rejection import Reason, Rejection
from pipeline.tolerances import MOST, PARTITION_M, PATCH_M2
from pipeline.values import Layout, Level, SourceRoom, Spaces

LONGEST_M: Final = 500.0
"""The longest side of a house, metres. Of 33,717 published plans the longest has 100 m, the Pentagon 431 m."""

_ADVICE = (
    "for a mesh, give the unit by --units or the scale by --scale; for a picture of a map, the side of a cell by "
    "--resolution; else export the file again in its true unit"
)


def trace_contour(spaces: Spaces) -> Spaces:
    """Add the outer contour of every part of the house that stands by itself and has rooms, largest first (line 6).

    The paper traces it on a raster (border following of Suzuki and Abe). The walls are polygons here, and the outer
    ring of each is the same contour without stair-steps.

    Raises
    ------
    Rejection
        TOO_LARGE: the longest side is more than ``LONGEST_M``, so the unit is wrong, or it is terrain.
    """
    outlines = [Polygon(part.exterior) for part in polygons_of(spaces.walls)]
    inside = shapely.point_on_surface(spaces.rooms)
    housing = [o for o in outlines if shapely.intersects(o, inside).any()]
    nested = {k for k, o in enumerate(housing) if any(p.contains(o) for p in housing[:k])}
    outlines = [o for k, o in enumerate(housing) if k not in nested]
    for x1, y1, x2, y2 in (outline.bounds for outline in outlines):
        if max(x2 - x1, y2 - y1) > LONGEST_M:
            detail = f"expected a house of at most {LONGEST_M:g} m a side, found {x2 - x1:,.0f} x {y2 - y1:,.0f} m"
            raise Rejection("contour", Reason.TOO_LARGE, detail, _ADVICE)
    return replace(spaces, outlines=tuple(outlines))


def drop_small_cells(spaces: Spaces, config: CellsConfig, layout: Layout | None = None) -> Spaces:
    """Drop every cell of less than ``area_m2``, such as a shaft (lines 8 and 9).

    A cell is a room together with all rooms that can be reached from it; a small room with a door is part of a larger
    cell and stays. The paper lists n = 500 points for this check, and no step of it uses them: labelling covers all.

    A note counts the other spaces of ``PATCH_M2`` or more that the ``layout`` found not to be rooms (a terrace, a void,
    a block), so that nothing is left out without a note.
    """
    if layout is not None:
        large = [space for space in layout.spaces if space.area >= PATCH_M2]
        gone = int((shares_inside(large, unite(layout.rooms)) < MOST).sum())
        spaces = replace(spaces, notes={**spaces.notes, "no_rooms": gone}) if gone else spaces
    keep, filled = [], 0
    for cell in connected_rooms(spaces):
        if sum(spaces.rooms[k].area for k in cell) < config.area_m2:
            filled += 1
        else:
            keep += cell
    return spaces.keeping(sorted(keep), filled_cells=filled) if filled else spaces


def erase_isolated(spaces: Spaces, config: IsolatedConfig) -> Spaces:
    """Drop the rooms of a small part that stands far from the main one, as the authors did with garages (section II).

    Both must hold: its wall outline stands more than ``distance_m`` from the main part's, and its rooms have less than
    ``share`` of the main part's area. What is nearer or larger stays, and is a plan of its own (``separate_buildings``)
    or, wall to wall with the main part, is joined by stage ``connectivity``.
    """
    outline_of, room_in = rooms_inside(spaces.outlines, spaces.rooms)
    inside = [np.sort(room_in[outline_of == k]).tolist() for k in range(len(spaces.outlines))]
    area = [sum(spaces.rooms[k].area for k in rooms) for rooms in inside]
    main = max(range(len(area)), key=lambda k: area[k])
    apart = {
        k
        for k, outline in enumerate(spaces.outlines)
        if k != main
        and outline.distance(spaces.outlines[main]) > config.distance_m
        and area[k] < config.share * area[main]
    }
    if not apart:
        return spaces
    keep = sorted(room for k, rooms in enumerate(inside) if k not in apart for room in rooms)
    left = spaces.keeping(keep, erased_parts=len(apart))
    return replace(left, outlines=tuple(o for k, o in enumerate(spaces.outlines) if k not in apart))


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
