"""Apply what a person says of a storey (``Level.corrections``) to its finished plan, and rate the plan again.

A word is one correction by a person.

R1  The search does not use a person's words. The plan is first made without them, and they change the finished plan
    (``houseexpo.corrections.apply``). The exception is a storey that the search rejects (``stages.said_walls``).
R2  A word that is said under the id of a building belongs to this building, wherever it lies: the page Review shows it
    in that plan. A word of the storey, or under an id that no building has, belongs to the nearest building.
R3  Words can name spaces that are no rooms as rooms. A room that was left out because nothing led into it comes back
    with a door. A new wall may close a space together with the walls that stand. Merged rooms keep only the walls that
    the source shows.
R4  The quality is that of the corrected plan. A space that a person calls a room, or draws a door of, is not doubted. A
    room that the source draws, and that words contradict, does not count against the plan; nor does the source's count
    of rooms. A robot's map is compared with the corrected rooms and doorways.
R5  The plan's provenance lists each word and its effect, even if it had none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final, TypeVar

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections import Correction
from houseexpo.corrections.apply import Corrected, correct_plan
from houseexpo.corrections.draft import Draft, Space
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_points_from_source, source_points_from_plan
from houseexpo.plan import Door
from pipeline.geometry.areas import OUTSIDE, Floats, overlaps, polygons_of, unite
from pipeline.geometry.openings import ClosedBy, Opening
from pipeline.tolerances import HALF_CM_M, MOST, SHEET_M, STAND_M
from pipeline.values import Evidence, Layout, Level, Spaces

_Shape = TypeVar("_Shape", bound=BaseGeometry)
_RECORDED_DIGITS: Final = 4
"""Decimals of metres in the record of a source (``source_record``): a preview from it gives the plan of the build."""


def corrections_by_building(level: Level, buildings: Sequence[tuple[Level, Spaces]]) -> list[tuple[Level, Spaces]]:
    """Return the buildings of a level, each with the words that belong to it (R2)."""
    if len(buildings) < 2 or not level.corrections:
        return list(buildings)
    places = [shapely.MultiPoint(plan_points_from_source(level.frame, np.array(c.points))) for c in level.corrections]
    ids = {building.id for building, _ in buildings}
    homes = []
    for word, place in zip(level.corrections, places, strict=True):
        far = [min((place.distance(o) for o in spaces.outlines), default=np.inf) for _, spaces in buildings]
        nearest = buildings[int(np.argmin(far))][0].id
        homes.append({name if name in ids else nearest for name in word.said_of or (level.id,)})
    found = []
    for building, spaces in buildings:
        own = tuple(word for word, home in zip(level.corrections, homes, strict=True) if building.id in home)
        found.append((replace(building, corrections=own), spaces))
    return found


def correct(
    level: Level,
    said: Sequence[Correction],
    found: tuple[Evidence, Layout],
    unreached: Sequence[Polygon],
    plan: FloorPlan,
) -> Corrected[FloorPlan]:
    """Return the plan with the corrections ``said`` applied (R1), and the effect of each.

    ``found`` is the evidence and layout of the level. ``unreached`` are all rooms found before the ones that nothing
    leads into were left out (R3).
    """
    (evidence, layout), shift = found, -_origin(level, plan)
    spaces = [Space(_move_shape(room, shift), reachable=False) for room in unreached]
    spaces += [Space(_move_shape(space, shift)) for space in layout.spaces]
    standing = [_move_shape(wall, shift) for wall in standing_walls(evidence, layout)]
    walls = [_move_shape(wall, shift) for wall in shown_walls(level, evidence)]
    lines = (
        [_move_shape(line, shift) for line in lines_of_drawing(level)] if any(c.word == "no_wall" for c in said) else []
    )
    corrected = correct_plan(plan, said, spaces, standing, walls=walls, lines=lines)
    told: dict[str, Any] = {"corrections": [effect.as_record() for effect in corrected.effects]}
    if corrected.followed:
        told["followed"] = list(corrected.followed)
    return replace(corrected, plan=replace(corrected.plan, provenance={**(corrected.plan.provenance or {}), **told}))


def without_cuts(level: Level, plan: FloorPlan) -> FloorPlan:
    """Return a plan without its cuts if the source states each way (``Level.all_ways``); all rooms stay."""
    if not level.all_ways or all(door.kind != "cut" for door in plan.doors):
        return plan
    draft = Draft(plan)
    draft.doors = [door for door in draft.doors if door.kind != "cut"]
    found: FloorPlan = draft.made(measure=False)
    told = dict(found.provenance or {})
    notes = {name: count for name, count in told.get("notes", {}).items() if name not in {"cuts", "doors_unknown"}}
    return replace(found, provenance={**told, "notes": notes})


def standing_walls(evidence: Evidence, layout: Layout) -> list[Polygon]:
    """Return the walls of a level and what may close their gaps: what a person's wall may close a space with (R3)."""
    gaps = (*evidence.doorways, *layout.candidates, *layout.ways)
    closed = unite([layout.door, *(each.polygon for each in gaps)])
    # walls of scans have many corners
    return [part for part in polygons_of(shapely.simplify(closed, HALF_CM_M)) if part.is_valid]


def shown_walls(level: Level, evidence: Evidence) -> list[Polygon]:
    """Return the walls that a level's source shows: what remains between rooms that a person merges (R3)."""
    walls = unite([evidence.walls, evidence.rails]) if level.seen_walls is None else level.seen_walls()
    shown = shapely.transform(shapely.simplify(walls, HALF_CM_M), lambda points: points.round(_RECORDED_DIGITS))
    return [part for part in polygons_of(shown) if part.is_valid]


def lines_of_drawing(level: Level) -> list[LineString]:
    """Return the straight lines of a drawing: those that are no walls leave the walls that others draw (R3)."""
    pairs = [pair for _, points in (level.lines or tuple)() for pair in pairwise(points)]
    return list(shapely.linestrings(np.reshape(pairs, (-1, 2, 2))))


def spaces_of_plan(level: Level, plan: FloorPlan, spaces: Spaces) -> Spaces:
    """Return the rooms and passages of a plan in the level's frame, with the notes of ``spaces``."""
    origin = _origin(level, plan)
    rooms = tuple(_move_shape(room.polygon, origin) for room in plan.rooms)
    number = {room.id: k for k, room in enumerate(plan.rooms)}
    passages = tuple(_passage(door, number, rooms, origin) for door in plan.doors)
    return replace(spaces, rooms=rooms, passages=passages, open_pairs=())


def doubts_left(level: Level, layout: Layout, doubts: Floats, plan: FloorPlan) -> Floats:
    """Return the doubts (n,) of the layout's spaces: 0 where a person has confirmed the room or one of its doors."""
    settled = {room.id for room in plan.rooms if room.confidence == 1.0}
    settled |= {side for door in plan.doors if door.confidence == 1.0 for side in door.rooms if side is not None}
    origin = _origin(level, plan)
    places = [_move_shape(room.polygon, origin).representative_point() for room in plan.rooms if room.id in settled]
    held = shapely.STRtree(places).query(np.array(layout.spaces, np.object_), predicate="contains")[0]
    found = doubts.copy()
    found[held] = 0.0
    return found


def level_of_corrected(level: Level, before: FloorPlan, corrected: Corrected[FloorPlan]) -> Level:
    """Return a level with only the effective words, without the source's rooms that contradict them (R4)."""
    after = corrected.plan
    level = replace(level, corrections=tuple(e.correction for e in corrected.effects if e.outcome == "done"))
    if level.measure_signs is not None and has_other_parts(before, after):
        origin = _origin(level, after)
        rooms = [_move_shape(room.polygon, origin) for room in after.rooms]
        doorways = [_move_shape(door.polygon, origin) for door in after.doors]
        level = replace(level, signs=level.measure_signs(rooms, doorways))
    count = None if level.room_count is None else max(level.room_count + len(after.rooms) - len(before.rooms), 1)
    drawn = [room for room in level.rooms if room.polygon is not None]
    if not drawn:
        return replace(level, room_count=count)
    polygons = tuple(room.polygon for room in drawn if room.polygon is not None)

    def fit(plan: FloorPlan) -> Floats:
        origin = _origin(level, plan)
        return overlaps(tuple(_move_shape(room.polygon, origin) for room in plan.rooms), polygons).max(axis=0)  # type: ignore[no-any-return]

    worse = fit(after) < fit(before) - SHEET_M
    contradicted = {id(room) for room, is_worse in zip(drawn, worse, strict=True) if is_worse}
    return replace(level, rooms=tuple(r for r in level.rooms if id(r) not in contradicted), room_count=count)


def has_other_parts(before: FloorPlan, after: FloorPlan) -> bool:
    """Return whether a plan has other rooms or passages than it had; names and confidences do not count."""

    def parts(plan: FloorPlan) -> list[Any]:
        return [*(room.ring.tolist() for room in plan.rooms), *((door.ring.tolist(), door.kind) for door in plan.doors)]

    return parts(before) != parts(after)


def _origin(level: Level, plan: FloorPlan) -> Floats:
    """Return where the plan's origin lies in the level's frame (2,)."""
    assert plan.frame is not None  # noqa: S101  # vectorise gives each plan one
    source = source_points_from_plan(plan.frame, np.zeros((1, 2)))
    return np.asarray(np.round(plan_points_from_source(level.frame, source)[0], 4))


def _move_shape(shape: _Shape, by: Floats) -> _Shape:
    moved: _Shape = shapely.transform(shape, lambda points: points + by)
    return moved


def _passage(door: Door, number: dict[int, int], rooms: tuple[Polygon, ...], origin: Floats) -> Opening:
    a, b = np.array(door.segment) + origin
    width = max(float(np.hypot(*(b - a))), STAND_M)
    sides = tuple(OUTSIDE if room is None else number[room] for room in door.rooms)
    along = (b - a) / width
    depth = max(door.polygon.area / width, STAND_M)
    closed_by: ClosedBy = "door" if door.confidence is not None and door.confidence > MOST else ""
    found = Opening(
        (a + b) / 2,
        along,
        width,
        depth,
        (sides[0], sides[1]),
        door.kind,
        closed_by=closed_by,
        confidence=door.confidence,
    )
    before = shapely.Point(found.centre - found.across * (depth / 2 + STAND_M))
    behind = shapely.Point(found.centre + found.across * (depth / 2 + STAND_M))
    if rooms[sides[0]].distance(before) > rooms[sides[0]].distance(behind):  # ``across`` points to the second
        return replace(found, along=-along)
    return found
