"""Decide which spaces between walls are rooms, and which part of them is floor.

R1  A room that the source names is a room. Any other space is a room unless one of these holds:

    - The house has floors and the space has none, unless walls and known doors close it nearly all round (a stairwell,
      a room whose floor nobody drew). Around a corridor, lintels and gaps count like walls. A corridor has several
      known doors, or one known door and is all that joins its neighbours. Where no door is known, gaps and lintels no
      wider than a door are its doors.
    - A roof leaves it too low to stand in (a void under a roof).
    - The source says that most of it is outdoors.
    - It has no way to another space, and a railing bounds most of its edge (a roof terrace), or ``STANDS`` of it at
      the outside of the house (a balcony).
    - It has no way to another space, and the edge of the floor bounds most of its edge, unless this holds for all
      spaces (a slab that goes on past the walls). Where the source marks each door (``Level.sills``), it draws the
      floors of rooms only: the edge of the floor does not count, here and below.
    - It has no way to another space, and most of it lies over the floor of a lower level (the upper part of a hall, a
      lantern). This does not count where the source names its walls and shows no way between any two spaces: nobody
      drew slab and doors.
    - It is under the sky, a railing or a parapet bounds ``STANDS`` of its edge at the outside of the house, and the
      other spaces lie under a ceiling or a roof (a balcony or a terrace, with a door or without).
    - It is under the sky, the source keeps slabs and roofs apart, the other spaces surround it, and it is twice as
      large as most of them (a court).
    - ``THIRD`` of its edge is open to the outside or to another such space, at the edge of the floor or under
      lintels too wide for a door with one leaf (a porch, a terrace, a strip under eaves), unless this holds for all
      spaces. The edge of the floor does not count if the rooms with ``HARDLY`` of their edge at it are most of the
      house: then the house is cut open. A space is a hall, and stays, if two rooms or more that nothing else joins
      open to it by more than the width of a door with one leaf.
    - It has no floor, nothing above it and no way in, where the others have all three and the source names no walls
      (the inside of a thick wall of which only the faces are drawn).
    - It has no known door, and furniture fills it (a block under a ceiling).
    - It has no way in and hardly a face looks into it, where faces look into the others (a plinth, a pillar of sheets).

R2  A room's part over a void in the floor is not free space (``geometry.room_shapes``), if the source draws floor under
    most of the rest. A room of which this leaves nothing stays as a stairwell if the stairs that lead up through the
    void take half of it or more.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    EMPTY,
    OUTSIDE,
    are_too_narrow,
    buffer_mitred,
    fill_enclosed,
    intersect,
    shares_inside,
    subtract,
    unite,
)
from pipeline.geometry.groups import Groups
from pipeline.geometry.mesh_slicing import lengths_of_faces
from pipeline.geometry.openings import KNOWN
from pipeline.geometry.prisms import Prisms
from pipeline.geometry.room_shapes import SMALLEST_ROOM_M2, subtract_floor_voids
from pipeline.tolerances import (
    CRACK_M,
    DOORWAY_M,
    HARDLY,
    HEAD_M,
    LARGELY,
    MM_M,
    MOST,
    MOSTLY,
    NEARLY_ALL,
    PASSABLE_M,
    SHOULDERS_M,
    SINGLE_DOOR_M,
    SOME,
    STANDS,
    THIRD,
    TINY_M2,
    WALL_M,
)
from pipeline.values import Evidence, Level, Opening, Planes


def keep_habitable_spaces(
    rooms: list[Polygon],
    candidates: list[Opening],
    planes: Planes,
    evidence: Evidence,
    level: Level,
    *,
    filled: set[int],
    all_closed: bool = False,
) -> list[Polygon]:
    """Return the spaces that are rooms (R1). ``filled`` holds the indices of ``filled_spaces``, which are not rooms.

    With ``all_closed``, each space without a way that walls close nearly all round is a room, as in the paper.
    """
    inner = [c.sides for c in candidates if c.is_strip and OUTSIDE not in c.sides]
    entered = {side for sides in inner for side in sides}
    area = shapely.area(rooms)
    covered = shares_inside(rooms, evidence.floor)
    low = shares_inside(rooms, evidence.low_headroom)
    below = shares_inside(rooms, level.below)
    known = evidence.floor is not None and bool((covered * area).sum() > MOST * _floorable_m2(rooms, level))
    doors = [c.polygon for c in candidates if c.closed_by in KNOWN]
    lintels = [c.polygon for c in candidates if c.closed_by == "lintel"]
    ways = [] if level.sills else [c for c in candidates if _is_way_inside(c)]
    walls = cache(lambda: shapely.buffer(unite([planes.door, *doors]), CRACK_M, quad_segs=2))
    passed = [*doors, *lintels, *(c.polygon for c in ways)]
    over = cache(lambda: shapely.buffer(unite([planes.door, *passed]), CRACK_M, quad_segs=2))
    fences = shapely.buffer(planes.rails, CRACK_M, quad_segs=2)
    house = EMPTY if planes.rails.is_empty else fill_enclosed(unite([planes.door, planes.rails, *rooms]))
    outer = intersect(fences, shapely.buffer(house.boundary, WALL_M, quad_segs=2))
    ends = [] if level.sills else [c.polygon for c in candidates if c.closed_by == "floor_edge"]
    edge = shapely.buffer(unite(ends), CRACK_M, quad_segs=2)
    beyond = {k for k, room in enumerate(rooms) if k not in entered and _along(room, edge) > MOST}
    outdoors = beyond if len(beyond) < len(rooms) else set()
    railed = {k for k, room in enumerate(rooms) if _along(room, outer) > STANDS}
    outdoors |= set(np.flatnonzero(shares_inside(rooms, level.outdoors) > MOST).tolist())
    outdoors |= _under_the_sky(rooms, railed, level) | _courts(rooms, area, level)
    if entered or not level.only_walls:
        outdoors |= {k for k in range(len(rooms)) if k not in entered and covered[k] < SOME and below[k] > MOST}
    fenced = {k for k, room in enumerate(rooms) if k not in entered and (_along(room, fences) > MOST or k in railed)}
    outdoors |= fenced | _porches(rooms, candidates, edge) | _solids(rooms, covered, candidates, level)
    outdoors |= filled | _boxes_seen_from_outside(rooms, candidates, planes, evidence, level)
    kept = []
    passable = {side for c in candidates if c.is_strip for side in c.sides}
    leading = [c for c in candidates if c.closed_by == "door"] or ways
    into = np.bincount(
        [side for c in leading if c.is_strip for side in c.sides if side != OUTSIDE], minlength=len(rooms)
    )
    if leading is ways:
        into[area < SMALLEST_ROOM_M2] = 0  # a doorway through a thick wall
    for k, (room, share) in enumerate(zip(rooms, covered, strict=True)):
        is_corridor = into[k] > 1 or (into[k] == 1 and _alone_joins_rooms(k, candidates))
        around = over if is_corridor else walls
        floored = not known or share >= SOME or (_along(room, around()) > MOSTLY and not _is_shaft(room))
        is_cell = all_closed and k not in passable and _along(room, walls()) > NEARLY_ALL
        if (floored and low[k] <= LARGELY and k not in outdoors) or is_cell or _is_named(room, level):
            kept.append(room)
    return kept


def _is_way_inside(candidate: Opening) -> bool:
    """Return whether a gap or a lintel, no wider than a door, leads from one space to another."""
    if not candidate.is_strip or candidate.closed_by not in {"gap", "lintel"} or candidate.leads_outside:
        return False
    return candidate.sides[0] != candidate.sides[1] and PASSABLE_M <= candidate.width <= DOORWAY_M[1]


def _solids(
    rooms: list[Polygon], floored: npt.NDArray[np.float64], candidates: list[Opening], level: Level
) -> set[int]:
    """Return which spaces have no floor, nothing above and no way in, where most of the others have all three."""
    ways = {side for c in candidates if c.is_strip for side in c.sides}
    shut = {k for k in range(len(rooms)) if floored[k] < SOME and k not in ways}
    others = [k for k in ways - {OUTSIDE} if floored[k] > MOST]
    if level.only_walls or not shut or len(others) < 2:
        return set()
    roofed = sum(intersect(rooms[k], part_under_cover(rooms[k], level)).area for k in others)
    if roofed < MOST * sum(rooms[k].area for k in others):
        return set()
    return {k for k in shut if shares_inside([rooms[k]], part_under_cover(rooms[k], level))[0] < SOME}


def filled_spaces(rooms: list[Polygon], candidates: list[Opening], evidence: Evidence, level: Level) -> set[int]:
    """Return the spaces without a known door that are full of what stands in them: pillars, blocks under a ceiling.

    If the source names furniture, no space counts as full: a shower cabin is furniture that fills a room.
    """
    if level.furniture:
        return set()
    known = {side for c in candidates if c.closed_by in KNOWN and c.is_strip for side in c.sides}
    filled = shares_inside(rooms, evidence.furniture)
    return {k for k in range(len(rooms)) if filled[k] > NEARLY_ALL and k not in known}


def _boxes_seen_from_outside(
    rooms: list[Polygon], candidates: list[Opening], planes: Planes, evidence: Evidence, level: Level
) -> set[int]:
    """Return the spaces without a way in into which hardly any face looks, where faces look into the others.

    The faces of a plinth or a pillar of sheets look into the room around it. Where the source does not wind its faces
    consistently, the result is empty.
    """
    ways = {side for c in candidates if c.is_strip for side in c.sides}
    shut = [k for k in range(len(rooms)) if k not in ways]
    height = evidence.heights.get("breast")
    if isinstance(level.walls, Prisms) or not isinstance(height, float) or not shut or len(rooms) < 2:
        return set()
    into, away = lengths_of_faces(level.walls, height, rooms, planes.door)
    boxes = {k for k in shut if into[k] < LARGELY * away[k]}
    others = [k for k in range(len(rooms)) if k not in boxes]
    return boxes if into[others].sum() > LARGELY * (into[others] + away[others]).sum() else set()


def _porches(rooms: list[Polygon], candidates: list[Opening], edge: BaseGeometry) -> set[int]:
    """Return which spaces lie open for ``THIRD`` of their edge to the outside or each other.

    The edge is open under a wide lintel and at the ``edge`` of the floor. If a space has a single opening, no wider
    than a door with two leaves, that is its doorway and does not count. If the result would be all spaces, it is empty:
    the house has glass fronts that nobody drew.
    """
    wide = [c for c in candidates if c.closed_by == "lintel" and c.width > SINGLE_DOOR_M[1]]
    area, length = shapely.area(rooms), shapely.length(rooms)
    at_edge = length * [_along(room, edge) for room in rooms]
    if area[at_edge > HARDLY * length].sum() > MOST * area.sum():
        at_edge = np.zeros(len(rooms))
    outside = {OUTSIDE}
    while True:
        widths: dict[int, list[float]] = {k: [] for k in range(len(rooms))}
        for opening in wide:
            one, other = opening.sides
            if one != other and (one in outside) != (other in outside):
                widths[one if other in outside else other].append(opening.width)
        open_m = [
            sum(each) if len(each) > 1 or max(each, default=0.0) > DOORWAY_M[1] else 0.0 for each in widths.values()
        ]
        found = {k for k in range(len(rooms)) if at_edge[k] + open_m[k] > THIRD * length[k]} - outside
        if not found:
            break
        outside |= found
    found = outside - {OUTSIDE}
    return {k for k in found if not _joins_rooms(k, rooms, candidates, found)} if len(found) < len(rooms) else set()


def _joins_rooms(place: int, rooms: list[Polygon], candidates: list[Opening], outside: set[int]) -> bool:
    """Return whether two rooms or more open wide to a place, and nothing but it joins them."""
    joined, open_to = Groups(len(rooms)), set[int]()
    for opening in (c for c in candidates if c.is_strip):
        if not {OUTSIDE, *outside} & set(opening.sides):
            joined.join(*opening.sides)
        elif place in opening.sides and opening.width > SINGLE_DOOR_M[1]:
            open_to |= set(opening.sides) - {OUTSIDE, *outside}
    return len({joined.of(room) for room in open_to}) > 1


def _alone_joins_rooms(place: int, candidates: list[Opening]) -> bool:
    """Return whether a place has ways to two other spaces or more that nothing inside but it joins."""
    inner = [c.sides for c in candidates if c.is_strip and OUTSIDE not in c.sides]
    joined = Groups(1 + max((side for sides in inner for side in sides), default=0))
    for sides in inner:
        if place not in sides:
            joined.join(*sides)
    around = {side for sides in inner if place in sides for side in sides} - {place}
    return len({joined.of(side) for side in around}) > 1


def _under_the_sky(rooms: list[Polygon], railed: set[int], level: Level) -> set[int]:
    """Return those of the ``railed`` spaces without a cover above them, if most of the other spaces have a cover."""
    others = [room for k, room in enumerate(rooms) if k not in railed]
    if not (railed and others):
        return set()
    roofed = sum(intersect(room, part_under_cover(room, level)).area for room in others)
    if roofed < MOST * sum(room.area for room in others):
        return set()
    return {k for k in railed if shares_inside([rooms[k]], part_under_cover(rooms[k], level))[0] < MOST}


def _courts(rooms: list[Polygon], area: npt.NDArray[np.float64], level: Level) -> set[int]:
    """Return the large spaces under the open sky and away from the outer wall, if most of the house has a cover."""
    under = shares_inside(rooms, level.cover)
    sheltered = under > MOST
    if area[sheltered].sum() <= area.sum() / 2:
        return set()
    large = {k for k in np.flatnonzero(under < SOME).tolist() if area[k] > 2 * np.median(area[sheltered])}
    edge = shapely.buffer(fill_enclosed(unite(buffer_mitred(r, WALL_M / 2) for r in rooms)).boundary, WALL_M)
    return {k for k in large if not rooms[k].intersects(edge)}


def part_under_cover(room: Polygon, level: Level) -> BaseGeometry:
    """Return the part of the plan around a space that lies under faces above head height, or under a slab."""
    if level.cover is not None:
        return level.cover
    corners = level.walls.vertices[level.walls.faces]
    corners = corners[corners[:, :, 2].min(axis=1) > HEAD_M][:, :, :2]
    x1, y1, x2, y2 = room.bounds
    near = (corners.min(axis=1) < (x2, y2)).all(axis=1) & (corners.max(axis=1) > (x1, y1)).all(axis=1)
    triangles = shapely.polygons(corners[near])
    return shapely.union_all(triangles[shapely.area(triangles) > TINY_M2], grid_size=MM_M)


def _is_shaft(room: Polygon) -> bool:
    return bool(are_too_narrow([room], SHOULDERS_M)[0])


def _along(room: Polygon, band: BaseGeometry) -> float:
    """Return the share of a room's edge that lies in a band along walls or fences."""
    return 0.0 if band.is_empty else float(shapely.intersection(room.exterior, band).length / room.length)


def clip_rooms_to_floor(rooms: list[Polygon], level: Level) -> list[Polygon]:
    """Return the rooms without the voids in their floors, if the source draws most of the floors (R2)."""
    if level.below is None or level.floor is None:
        return rooms
    covered = sum(intersect(room, level.floor).area for room in rooms)
    if covered < MOST * _floorable_m2(rooms, level):
        return rooms
    named = unite([room.polygon for room in level.rooms if room.polygon is not None])
    stairless = level.below if level.stairs is None else subtract(level.below, level.stairs)
    found = []
    for room in rooms:
        landings = subtract_floor_voids(room, level.floor, level.below, named)
        found += landings or subtract_floor_voids(room, level.floor, stairless, named)
    return found


def _floorable_m2(rooms: list[Polygon], level: Level) -> float:
    """Return the area, m2, of the rooms that is not over a void: it has a floor if the source draws floors.

    If the source names its walls, voids count as floor: a void may be a slab that nobody drew.
    """
    void = EMPTY if level.below is None or level.only_walls else level.below
    return float(sum(subtract(room, void).area for room in rooms))


def _is_named(room: Polygon, level: Level) -> bool:
    return any(intersect(room, each.polygon).area > 0.5 * room.area for each in level.rooms if each.polygon is not None)
