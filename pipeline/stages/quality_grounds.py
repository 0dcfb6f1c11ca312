"""Measure the grounds against a plan: signs of faults, each 0 (none) to 1, on which its quality and confidences rest.

R1  ``cut_share``: inner doors that are cuts, of all inner doors. ``cut_off_share``: rooms that only cuts lead into.
R2  ``patch_share``: candidates that are not ways, of all: guesses that mend walls with holes. ``given_edge``: 1 if the
    house is open, so that its edge was taken from its floor or from the ends of its walls, or (``EDGE`` among the
    guesses) from the border of a map. The edge of an open room that the source draws is not a guess.
R3  ``guesses``: things that the reader had to guess (levels, units, scale, axis), of ``MAX_GUESSES``.
R4  ``floorless_room``: the largest share of a room with neither the source's floor nor a room of the source under it; 0
    if the source has no floor, or only scraps of floor.
R5  ``roomless_floor_share``: floor between the rooms that is neither room nor wall. ``roomless_wall_share``: walls
    that stand beside no room and no stair that leads up to the storey, of all. Either speaks of rooms that were lost.
R6  ``idle_lintel_share``: lintels as wide as doors that the plan has no use for, of all such.
R7  ``twin_door_share``: doors between two rooms that another door joins already, of all inner doors.
    ``odd_doors``: how far the middle width of the doors is from that of doors.
R8  ``odd_room_share``: rooms too small, too narrow, too large or too ragged for a room. ``loose_end_share``: rooms in
    the middle of which a wall ends.
R9  ``left_out``: parts, cells and pockets that were left out or filled, of three.
R10 ``unlike_spaces``: how far the rooms are from those that the source draws, or from as many as it counts.
R11 ``sealed``: 1 if the plan has no door, opening or entrance at all, and the source names no room. Such boxes are
    facades, plinths and voids more often than rooms.
R12 Floor and walls beside no room do not count where a person has said what is not a room.
R13 ``tall``: how far the source reaches above a storey (``STOREY_M``): a roof, a tower, a hall or two storeys in one,
    of which the plan may be a wrong section. A scan is never tall: it has points at any height.
R14 ``rail_share``: railings and low walls beside the rooms, of all walls: terraces, galleries and counters are often
    taken for rooms, or for what divides them.
R15 ``small``: how far all rooms together are from the size of a home: a closet, a niche, a part of a house.
R16 R13 to R15, R17 and R19 are left out if the source marks each door (``Level.sills``): that is a storey for certain.
R17 ``open_border``: 1 if a map's border or unseen space, not wall, bounds most of it (``EDGE`` among the guesses), or
    if only guesses close more than ``THIRD`` of the edges of all rooms together, and no room has a name: a house on
    posts or with two walls, or a stage. The ends of a scan do not count: it is not seen whole.
R18 ``doubtful_space``: the doubt that the most doubtful room is a room of the house (``stages.room_doubt``).
R19 ``bare``: 1 if a sealed plan (R11) has nothing that shows its use: the source names neither walls, furniture nor
    doors, and nothing stands in the rooms. Bodies of vehicles, blocks and arenas are such boxes, and few rooms are.
R20 What the reader of a robot's map measured on its cells (``Level.signs``, ``sources/occupancy_map/signs.py``).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    EMPTY,
    OUTSIDE,
    buffer_mitred,
    intersect,
    overlaps,
    polygons_of,
    shares_inside,
    shares_of_places,
    subtract,
    unite,
)
from pipeline.geometry.meshes import boxes_around_polygons
from pipeline.geometry.room_shapes import are_rooms_misshapen, have_jutting_walls
from pipeline.stages.room_doubt import doubt_spaces, of_rooms
from pipeline.tolerances import BESIDE_M, CRACK_M, HAND_M, MOST, SHOULDERS_M, SOME, SPECK, THICK_WALL_M, THIRD
from pipeline.values import EDGE, Evidence, Layout, Level, Opening, Spaces

Floats = npt.NDArray[np.float64]
MAX_GUESSES: Final = 2
LEFT_OUT: Final = ("erased_parts", "filled_cells", "filled_pockets", "left_out", "closed_spaces")
USUAL_WIDTH_M: Final = (0.7, 1.15)
MUCH_TOO_WIDE_M: Final = 0.35
STOREY_M: Final = (4.0, 6.0)
"""A ramp: above the first height a source is tall, and wholly so if higher by the second. The same form below for
m2."""
SMALL_PLAN_M2: Final = (12.0, 9.0)


def measure_quality_grounds(
    level: Level,
    evidence: Evidence,
    layout: Layout,
    spaces: Spaces,
    *,
    far_walls: BaseGeometry | None = None,
    doubts: Floats | None = None,
) -> dict[str, float]:
    """Return the grounds by name, each 0 to 1. ``spaces`` are the final ones, from which the plan is made.

    ``far_walls`` (``walls_far_from_rooms``) and ``doubts`` (``doubt_spaces``) are computed if not given; the buildings
    of one level share them.
    """
    doubts = doubt_spaces(level, evidence, layout) if doubts is None else doubts
    rooms, inner = unite(spaces.rooms), [p for p in spaces.passages if not p.leads_outside]
    left_out = sum(int(spaces.notes.get(name, 0)) for name in LEFT_OUT)
    return {
        "cut_share": _share(sum(p.kind == "cut" for p in inner), len(inner)),
        "cut_off_share": _cut_off(spaces),
        "patch_share": _share(sum(not c.is_strip for c in layout.candidates), len(layout.candidates)),
        "given_edge": float(spaces.notes.get("boundary", "room_edge") != "room_edge" or EDGE in level.guesses),
        "guesses": _share(len(level.guesses), MAX_GUESSES),
        **_floors(level, rooms, layout.ground, spaces.rooms),
        "roomless_wall_share": 0.0
        if level.has_no_rooms
        else _roomless_share(
            evidence.walls, rooms if level.stairs is None else unite([rooms, level.stairs]), layout, far_walls
        ),
        "idle_lintel_share": _idle(evidence.lintels, layout, rooms),
        "twin_door_share": _share(len(inner) - len({frozenset(p.sides) for p in inner}), len(inner)),
        "odd_doors": _odd_doors(spaces.passages),
        "odd_room_share": float(are_rooms_misshapen(spaces.rooms).mean()),
        "loose_end_share": float(have_jutting_walls(spaces.rooms).mean()),
        "left_out": _share(left_out, 3),  # R9: more say no more
        "unlike_spaces": _unlike(level, spaces.rooms),
        "sealed": float(_is_sealed(level, spaces)),
        "doubtful_space": doubt_most_doubtful_room(layout, doubts, spaces),
        **({} if level.sills else _as_a_storey(level, evidence, layout, spaces, rooms)),
        **level.signs,
    }


def doubt_most_doubtful_room(layout: Layout, doubts: Floats, spaces: Spaces) -> float:
    """Return the largest doubt of a room, from the ``doubts`` (n,) of the layout's spaces (R18)."""
    return float(of_rooms(layout, doubts, spaces.rooms).max(initial=0.0))


def _as_a_storey(
    level: Level, evidence: Evidence, layout: Layout, spaces: Spaces, rooms: BaseGeometry
) -> dict[str, float]:
    """Return the grounds against this being a whole storey (R13 to R17, R19)."""
    return {
        "tall": 0.0 if evidence.scanned else _tall(level),
        "rail_share": _rails(evidence.rails, rooms, layout.ground),
        "small": _share(max(SMALL_PLAN_M2[0] - rooms.area, 0.0), SMALL_PLAN_M2[1]),
        "open_border": float(EDGE in level.guesses or _open_share(level, evidence, layout) > THIRD),
        "bare": float(_is_sealed(level, spaces) and not _shows_its_use(level, evidence, rooms)),
    }


def _open_share(level: Level, evidence: Evidence, layout: Layout) -> float:
    """Return the share of the edges of all rooms that only guesses close (R17)."""
    guessed = unite([c.polygon for c in layout.candidates if c.closed_by in {"floor_edge", "wall_ends"}])
    guessed = guessed if evidence.open_edge.is_empty else subtract(guessed, evidence.open_edge)
    is_named = any(room.polygon is not None for room in level.rooms)
    if guessed.is_empty or is_named or level.walls.is_cloud:
        return 0.0
    near = shapely.buffer(guessed, CRACK_M, quad_segs=2)
    bare = shapely.difference(near, shapely.buffer(layout.door, 2 * HAND_M, quad_segs=2))
    edges = [room.exterior for room in layout.rooms]
    return float(shapely.length(shapely.intersection(edges, bare)).sum() / shapely.length(edges).sum())


def _is_sealed(level: Level, spaces: Spaces) -> bool:
    """Return whether a plan has no way at all, and the source names no room."""
    return not spaces.passages and not level.rooms


def _shows_its_use(level: Level, evidence: Evidence, rooms: BaseGeometry) -> bool:
    """Return whether the source names walls, furniture or doors, or anything stands in the rooms."""
    if level.only_walls or level.furniture or evidence.doorways or evidence.leaves:
        return True
    return bool(intersect(evidence.furniture, rooms).area > SPECK * rooms.area)


def _share(part: float, whole: float) -> float:
    return min(part / whole, 1.0) if whole > 0 else 0.0


def _cut_off(spaces: Spaces) -> float:
    """Return the share of rooms that only cuts lead into."""
    by_evidence = {side for p in spaces.passages if p.kind != "cut" for side in p.sides}
    by_evidence |= {room for pair in spaces.open_pairs for room in pair}
    by_cut = {side for p in spaces.passages if p.kind == "cut" for side in p.sides} - by_evidence - {OUTSIDE}
    return _share(len(by_cut), len(spaces.rooms))


def _floors(level: Level, rooms: BaseGeometry, walls: BaseGeometry, each: tuple[Polygon, ...]) -> dict[str, float]:
    """Return the largest share of a room without a floor, and the floor that is neither room nor wall."""
    floor = level.floor_with_rooms
    if floor is None:
        return {"floorless_room": 0.0, "roomless_floor_share": 0.0}
    between = EMPTY if level.has_no_rooms else _floor_between(floor, rooms, walls)
    return {
        "floorless_room": _floorless(level, each),
        "roomless_floor_share": _share(between.area, rooms.area),
    }


def _floorless(level: Level, rooms: tuple[Polygon, ...]) -> float:
    """Return the largest share of a room with neither a floor nor a room of the source under it; 0 for scraps."""
    shares, area = shares_without_floor(level, rooms), shapely.area(rooms)
    return float(shares.max()) if (shares * area).sum() < (1 - MOST) * area.sum() else 0.0


def shares_without_floor(level: Level, rooms: Sequence[Polygon]) -> Floats:
    """Return the share of each room (n,) without floor: 0 if the source has no floor, or draws just this room."""
    found, floor = np.zeros(len(rooms)), level.floor_with_rooms
    drawn = {id(room.polygon) for room in level.rooms}
    rest = [k for k, room in enumerate(rooms) if id(room) not in drawn]
    if floor is not None and rest:
        found[rest] = _shares_off(floor, tuple(rooms[k] for k in rest))
    return found


@lru_cache(maxsize=1)  # grounds and confidences ask for the same rooms
def _shares_off(floor: BaseGeometry, rooms: tuple[Polygon, ...]) -> Floats:
    return 1.0 - shares_of_places(np.array(rooms, np.object_), floor)


def _floor_between(floor: BaseGeometry, rooms: BaseGeometry, walls: BaseGeometry) -> BaseGeometry:
    """Return the floor between the rooms that is neither room nor wall (R5)."""
    rest = subtract(floor, rooms)
    if shapely.covers(walls, rest):  # the floor of doorways
        return EMPTY
    return intersect(subtract(subtract(floor, buffer_mitred(rooms, CRACK_M)), walls), shapely.convex_hull(rooms))


def walls_far_from_rooms(walls: BaseGeometry, rooms: Sequence[BaseGeometry]) -> BaseGeometry:
    """Return the walls that stand beside none of the rooms (R5). A wall is at most ``THICK_WALL_M`` thick."""
    return subtract(walls, buffer_mitred(unite(rooms), THICK_WALL_M))


def _roomless_share(walls: BaseGeometry, rooms: BaseGeometry, layout: Layout, far_walls: BaseGeometry | None) -> float:
    """Return the share of the walls that stand beside no room (R5)."""
    if walls.is_empty:
        return 0.0
    if far_walls is None:
        if shapely.covers(buffer_mitred(rooms, THICK_WALL_M), walls):
            return 0.0
        return _share(walls_far_from_rooms(walls, [rooms, *layout.rooms]).area, walls.area)
    return 0.0 if far_walls.is_empty else _share(walls_far_from_rooms(far_walls, [rooms]).area, walls.area)


def _idle(lintels: BaseGeometry, layout: Layout, rooms: BaseGeometry) -> float:
    """Return the share of lintels as wide as doors that the plan has no use for."""
    x1, y1, x2, y2 = rooms.bounds
    here = shapely.box(x1 - HAND_M, y1 - HAND_M, x2 + HAND_M, y2 + HAND_M)
    near = [p for p in polygons_of(lintels) if p.length > 2 * SHOULDERS_M and p.intersects(here)]
    wide = [p for p, box in zip(near, boxes_around_polygons(near), strict=True) if box.width > SHOULDERS_M]
    if not wide:
        return 0.0
    candidates = np.array([candidate.polygon for candidate in layout.candidates], dtype=np.object_)
    used = unite(candidates[np.unique(shapely.STRtree(candidates).query(wide, predicate="intersects")[1])])
    return _share(float((shares_inside(wide, used) < SOME).sum()), len(wide))


def _tall(level: Level) -> float:
    """Return how far the source reaches above a storey."""
    return _share(max(level.walls.highest_m - STOREY_M[0], 0.0), STOREY_M[1])


def _rails(rails: BaseGeometry, rooms: BaseGeometry, walls: BaseGeometry) -> float:
    """Return the share of railings and low walls beside the rooms, of all walls."""
    if rails.is_empty:
        return 0.0
    beside = intersect(rails, buffer_mitred(rooms, BESIDE_M))
    return _share(beside.area, SOME * walls.area)


def _odd_doors(passages: tuple[Opening, ...]) -> float:
    """Return how far the middle width of the doors is from that of doors."""
    widths = [p.width for p in passages if p.kind in {"door", "entrance"}]
    if not widths:
        return 0.0
    middle = float(np.median(widths))
    return _share(max(USUAL_WIDTH_M[0] - middle, middle - USUAL_WIDTH_M[1], 0.0), MUCH_TOO_WIDE_M)


def _unlike(level: Level, rooms: tuple[Polygon, ...]) -> float:
    """Return how far the rooms are from those that the source draws, or from as many as it counts."""
    drawn = [room.polygon for room in level.rooms if room.polygon is not None]
    if drawn:
        return 1.0 - float(overlaps(rooms, tuple(drawn)).max(axis=0).sum()) / len(drawn)
    if not level.room_count:
        return 0.0
    return _share(abs(len(rooms) - level.room_count), max(len(rooms), level.room_count))
