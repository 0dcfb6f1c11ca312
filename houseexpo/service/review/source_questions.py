"""Ask about what a source shows and the plan does not, and about what was guessed of the source.

R1  Three things are asked about: a space between walls that was left out and may be a room of this building; a
    room that takes only a part of the space between its walls; and a door or a gap in the source, in a wall of a room,
    where the plan has no passage; a narrow one only between rooms that no passage joins. What hangs before a wall, as
    the eaves, is no place.
R2  A room is asked about if the source shows no wall along much of its edge: a porch, or what rays saw.
R3  In a robot's map, a part of a room behind a narrow place is asked about if the map shows no wall along much of its
    edge: rays went through a gap.
R4  A front is a line of a room's edge towards the outside that is wider than a door, and where the source shows no
    wall, or a lintel or a sill: it may be a garage's mouth or an open porch. A robot's map shows none: there R2 asks.
R5  Facts about the whole file that the reader guessed (its unit, its axis) are asked once for the file. Its size is
    also asked about if the sizes of its doors and storeys make another one clearly likelier, and its floors if another
    level surface may be one, or a storey of several is doubtful or gave no plan. What somebody has said is not asked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from houseexpo.corrections.joining import CUT_M
from houseexpo.corrections.rooms import is_enclosed
from houseexpo.corrections.vocabulary import UNITS_M, Word
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Room
from houseexpo.service.review.plan_questions import free_places, rooms_beside, way_to_largest
from houseexpo.service.review.question import (
    FREE,
    MOST_POINTS,
    NAMED,
    PASSAGE_M,
    SEVERAL,
    SHOWN,
    WIDEST_WALL_M,
    Answer,
    Further,
    Question,
    an,
    doubt_of,
    key_of,
    middle_of,
    name_of,
    none_of,
    point_in,
)
from houseexpo.service.review.sources import OF_EDGE_M, SourceView
from houseexpo.tolerances import GRID_M, SMALLEST_ROOM_M2

_SEEN: Final = 0.75
"""The least share of a room's edge beside which the source shows a wall or the plan has a passage. In right plans of
robots' maps, all rooms have 0.83 or more; what only rays saw through glass or doors has 0.5 to 0.7."""
_PORCH: Final = 0.5
"""The same of other sources: a garage or a shop lacks one wall of four, and its front is asked about; a porch two."""
_UNSEEN: Final = 0.5
"""Doubt of a room of which the source shows less."""
_LEFT_OUT: Final = 0.6
"""Doubt of a left-out space: some are shafts, courts and hollow walls."""
_LARGER: Final = 0.3
"""Doubt of a room that takes a part of the space between its walls."""
_FRONT_M: Final = (1.5, 15.0)
"""The least and the greatest width of a front, metres. People drew 1.7 to 12.6 m."""
_CORRIDOR_M: Final = 1.0
"""The width of a narrow corridor, metres: what is narrower and has neither a lintel nor jambs is no mouth."""
_FRONTS: Final = {*SHOWN, "gate", "mouth", "floor_edge"}
"""Kinds of evidence in the source that may be a front."""
_FRONT: Final = 0.3
"""Doubt of a front, as of a place that the source names."""
_MOST_FRONTS: Final = 6
_BAY_NECK_M: Final = 2 * PASSAGE_M[0]
"""The widest place behind which a part of a room in a map is a bay, metres: rays went through a door or a gap."""
_MOST_BAYS: Final = 6
_SIZES: Final = {"units", "scale", "storey_height"}
_TOLD_BY: Final = {"units": _SIZES, "scale": _SIZES, "up": {"up"}, "levels": {"floors", "storey_height"}}
"""Options of a reader that state what it would guess; a known distance is given to it as the unit."""
GUESS: Final = "guess of the file"
FLOORS: Final = "floors of the file"
"""The keys of the questions about a file: one for all its storeys."""
_MOST_SIZES: Final = 3
_MOST_LEFT_OUT: Final = 3
"""Storeys that may be none, and sizes that are offered: each answer needs a key."""
_GUESSED: Final = {"units": "the unit", "scale": "the scale", "up": "the upward axis"}


def guess_questions(plan: FloorPlan, source: SourceView) -> Iterator[Question]:
    """R5."""
    told, record = _told(source), source.record
    guesses = [name for name in source.level.guesses if name in _GUESSED and told.isdisjoint(_TOLD_BY[name])]
    x1, y1, x2, y2 = plan.bbox
    at = round((x1 + x2) / 2, 3), round((y1 + y2) / 2, 3)
    answers = [Answer("Right")]
    is_size_open = "units" in record.takes and told.isdisjoint(_SIZES)
    if (is_size_open and record.is_odd) or (guesses and {"units", "up"} & set(record.takes)):
        names = " and ".join(_GUESSED[name] for name in guesses)
        why = f"The file does not say {names}" if names else "The sizes in this file are unusual"
        high = f" and {source.level.ceiling_m:.1f} m high" if source.level.ceiling_m else ""
        widths = sorted(door.width for door in plan.doors if door.kind != "cut")
        doors = f", its doors are {widths[len(widths) // 2]:.2f} m wide" if widths else ""
        says = f"{why}; this storey is {x2 - x1:.1f} m x {y2 - y1:.1f} m{high} so{doors}. Is that right?"
        if "up" in guesses and "up" in record.takes and plan.frame is not None:
            other = "y" if plan.frame.up == "z" else "z"
            answers.append(Answer(f"{other} is up", "up", text=other))
        if is_size_open and record.unit_m and (record.is_odd or {"units", "scale"} & set(guesses)):
            for unit_m in record.other_units_m[:_MOST_SIZES]:
                by = unit_m / record.unit_m
                sized = f"{(x2 - x1) * by:.1f} m x {(y2 - y1) * by:.1f} m"
                wide = f", doors {widths[len(widths) // 2] * by:.2f} m" if widths else ""
                name = next((name for name, unit in UNITS_M.items() if math.isclose(unit, unit_m)), f"{unit_m:g}")
                answers.append(Answer(f"{sized}{wide}", "units", text=name))
        yield Question(GUESS, at, says, (*answers, Answer("Another", "file")), 1.0, plan.area)


def _told(source: SourceView) -> set[str]:
    """Return the options of the reader that somebody has stated."""
    return {key for key, value in source.record.options if value not in {"", "auto"} and (key, value) != ("scale", "1")}


def floor_questions(plan: FloorPlan, source: SourceView) -> Iterator[Question]:
    """R5."""
    record = source.record
    levels = [level for level in record.levels if min(level.extent) > 0]
    is_unsure = any(level.rejected for level in levels) or (plan.quality is not None and plan.quality.is_doubtful)
    is_open = "floors" in record.takes and _told(source).isdisjoint(_TOLD_BY["levels"])
    if not is_open or not (record.other_floors or "levels" in source.level.guesses or (len(levels) > 1 and is_unsure)):
        return
    heights = sorted({round(level.frame.floor, 2) + 0.0 for level in levels})  # not -0

    def answer(title: str, floors: Sequence[float]) -> Answer:
        return Answer(title, "floors", text=", ".join(f"{height:g}" for height in sorted(floors)))

    more = [answer(f"Also {height:.2f} m", [*heights, height]) for height in record.other_floors]
    fewer = [answer(f"None at {height:.2f} m", [each for each in heights if each != height]) for height in heights]
    x1, y1, x2, y2 = plan.bbox
    found = " and ".join(f"{height:.2f} m" for height in heights)
    others = " and ".join(f"{height:.2f} m" for height in record.other_floors)
    says = f"Floors were found at {found}{f', and level surfaces with walls on them at {others}' if others else ''}. "
    answers = Answer("Right"), *more, *(fewer[:_MOST_LEFT_OUT] if len(heights) > 1 else ()), Answer("Others", "file")
    at = round((x1 + x2) / 2, 3), round((y1 + y2) / 2, 3)
    yield Question(FLOORS, at, f"{says}Is that right?", answers, 1.0)


def _moved_spaces(source: SourceView, shift: tuple[float, float]) -> list[Polygon]:
    """Return the spaces of a source (``SourceView.spaces``), moved to a plan."""
    return _moved([space.shape for space in source.spaces], shift)


def _moved(shapes: Sequence[Polygon], shift: tuple[float, float]) -> list[Polygon]:
    return [shapely.transform(shape, lambda points: points + np.array(shift)) for shape in shapes]


class _Taken:
    """What takes the ground of a plan: its rooms and its passages."""

    def __init__(self, plan: FloorPlan) -> None:
        self.parts = [*(room.polygon for room in plan.rooms), *(door.polygon for door in plan.doors)]
        self._tree, self._rooms = shapely.STRtree(self.parts), len(plan.rooms)

    def near(self, shape: Polygon, but: int = -1, *, rooms_only: bool = False) -> shapely.Geometry:
        """Return what lies at a shape, without the room of this number."""
        found = sorted(self._tree.query(shape, predicate="intersects").tolist())
        return shapely.union_all([self.parts[k] for k in found if k != but and (k < self._rooms or not rooms_only)])


def left_out_questions(
    plan: FloorPlan,
    source: SourceView,
    places: Sequence[tuple[str, LineString]],
    shift: tuple[float, float],
    closed: Sequence[tuple[float, float]],
) -> Iterator[Question]:
    """R1."""
    taken, ways = _Taken(plan), free_places(plan, places)
    asked: list[Polygon] = []
    enclosed, elsewhere = _moved(source.enclosed, shift), _moved(source.rooms_elsewhere, shift)
    rooms = [room.polygon for room in plan.rooms]
    reachable = [*(space.reachable for space in source.spaces), *(False for _ in enclosed)]
    spaces = [*_moved_spaces(source, shift), *enclosed]
    for shape, is_reachable in zip(spaces, reachable, strict=True):
        if shape.area < SMALLEST_ROOM_M2:
            continue
        if min(shapely.distance(elsewhere, shape), default=np.inf) < min(
            shapely.distance(rooms, shape), default=np.inf
        ):
            continue
        others = [other for other in asked if other.intersects(shape)]
        free = shapely.difference(shape, shapely.union_all([taken.near(shape), *others]))
        if free.area < SMALLEST_ROOM_M2 or free.area < FREE * shape.area:
            continue
        if any(shapely.contains_xy(shape, *place) for place in closed):
            continue
        asked.append(shape)
        point = shape.representative_point()
        at = round(point.x, 3), round(point.y, 3)
        why = "nothing leads into it" if not is_reachable else "it was taken for no room"
        share = _seen_share(shape.exterior, source, shift, Polygon()) if source.walls else 1.0
        where = "between walls" if share >= _SEEN else f"with walls along {share:.0%} of its edge"
        says = f"This space of {shape.area:.1f} m² {where} was left out: {why}. Is it a room?"
        answers = Answer("A room", "room", (at,)), Answer("No room"), *_room_with_door(plan, shape, at, ways, spaces)
        yield Question(key_of(plan, "space", at), at, says, answers, _LEFT_OUT, shape.area, shape.area**0.5)


def _room_with_door(
    plan: FloorPlan,
    space: Polygon,
    at: tuple[float, float],
    ways: Sequence[tuple[str, LineString]],
    others: Sequence[Polygon],
) -> Iterator[Answer]:
    """Yield the answer that a space is a room with a door where the source shows one, else to the largest room.

    ``others`` are all spaces of the source: no answer leads to one that was left out. An entrance that leads to the
    place of a new room leads into it.
    """
    if any(None in door.rooms and door.polygon.distance(space) < OF_EDGE_M for door in plan.doors):
        return
    rooms = [room.polygon for room in plan.rooms]
    shapes = [space, *rooms, *(other for other in others if not other.intersects(space))]
    near = [(kind, line) for kind, line in ways if space.distance(line) < WIDEST_WALL_M]
    found = [(kind, line, sides) for kind, line in near if (sides := rooms_beside(line, shapes)).count(0) == 1]
    inside = [each for each in found if max(side or 0 for side in each[2]) <= len(rooms)]
    for kind, line, sides in sorted(inside, key=lambda each: (None in each[2], -SHOWN[each[0]], -each[1].length))[:1]:
        (ax, ay), (bx, by) = line.coords
        word: Word = "entrance" if None in sides else "door"
        way = Further(word, ((ax, ay), (bx, by)))
        yield Answer(f"A room with {an(word)} where the {kind} is", "room", (at,), then=(way,))
    for ends in way_to_largest(space, plan.rooms, CUT_M) if not found else ():
        title = "A room with a door to the largest one beside it"
        yield Answer(title, "room", (at,), then=(Further("door", ends),))


def larger_questions(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R1."""
    taken, spaces = _Taken(plan), _moved_spaces(source, shift)
    tree = shapely.STRtree(spaces)
    for k, room in enumerate(plan.rooms):
        if room.confidence == 1.0:
            continue
        for number in sorted(tree.query(room.polygon, predicate="intersects").tolist()):
            shape = spaces[number]
            more = shape.area - room.area
            if not SMALLEST_ROOM_M2 <= more <= room.area:
                continue
            if shape.intersection(room.polygon).area < FREE * room.area:
                continue
            if shape.intersection(taken.near(shape, but=k)).area > more / 2:
                continue
            ring = shapely.simplify(shapely.Polygon(shape.exterior), OF_EDGE_M / 3).exterior
            corners = tuple((round(x, 3), round(y, 3)) for x, y in ring.coords[:-1])
            if len(corners) > MOST_POINTS:
                continue
            at = point_in(room)
            says = f"The walls here enclose {shape.area:.1f} m², and this {name_of(room)} has {room.area:.1f} m². "
            says += "Is all of it this room?"
            answers = Answer("All of it", "room_outline", corners), Answer("A part of it")
            yield Question(key_of(plan, "larger", at), at, says, answers, _LARGER, room.area)
            break


def place_questions(
    plan: FloorPlan,
    source: SourceView,
    places: Sequence[tuple[str, LineString]],
    shift: tuple[float, float],
    closed: Sequence[tuple[float, float]],
) -> Iterator[Question]:
    """R1."""
    shut = shapely.multipoints(np.reshape(closed, (-1, 2)))
    rooms = [room.polygon for room in plan.rooms]
    nowhere = shapely.difference(shut, shapely.union_all(rooms))
    pockets = [each for each in _moved_spaces(source, shift) if each.intersects(nowhere) and is_enclosed(each, rooms)]
    joined = {frozenset(door.rooms) for door in plan.doors if door.kind != "cut"}
    for kind, line in free_places(plan, places):
        (ax, ay), (bx, by) = line.coords
        sides = rooms_beside(line, rooms)
        if sides[0] == sides[1] or (line.length < PASSAGE_M[0] and (None in sides or frozenset(sides) in joined)):
            continue
        if shapely.dwithin(shut, line, WIDEST_WALL_M):
            continue
        if None in sides and shapely.dwithin(pockets, line, WIDEST_WALL_M).any():  # nobody walks in there
            continue
        beside = [rooms[side] for side in sides if side is not None]
        if kind not in NAMED and not all(source.is_open(line, room, shift) for room in beside):
            continue
        at = round((ax + bx) / 2, 3), round((ay + by) / 2, 3)
        word = "entrance" if None in sides else "door"
        shows = {"lintel": "a lintel hangs", "gap": "the walls leave a gap"}.get(kind, f"the source names {an(kind)}")
        says = f"{shows.capitalize()} here, {line.length:.2f} m wide, and the plan has no way. Is there {an(word)}?"
        jambs = (ax, ay), (bx, by)
        answers = [Answer(an(word).capitalize(), word, jambs), Answer("None")]
        if word == "door":
            answers.append(Answer("An opening", "opening", jambs))
        yield Question(key_of(plan, "place", at), at, says, tuple(answers), SHOWN[kind], size=line.length)


def front_questions(
    plan: FloorPlan, source: SourceView, places: Sequence[tuple[str, LineString]], shift: tuple[float, float]
) -> Iterator[Question]:
    """R4."""
    if source.is_map or not source.walls:
        return

    def beyond(line: LineString) -> shapely.Geometry:
        """Return the part of a line that lies away from all walls."""
        there = shapely.transform(line, lambda points: points - np.array(shift))
        key = shapely.set_precision(there, GRID_M).wkb
        free = source.computed.get_or_make(key, lambda: shapely.difference(there, source.near_walls))
        return shapely.transform(free, lambda points: points + np.array(shift))

    def in_walls(line: LineString) -> float:
        there = shapely.transform(line, lambda points: points - np.array(shift))
        return float(shapely.intersection(there, source.all_walls).length)

    ways = shapely.points(np.reshape([middle_of(door) for door in plan.doors], (-1, 2)))
    fronts = [(kind, line) for kind, line in places if kind in _FRONTS and line.length > PASSAGE_M[1]]
    lines = [line for kind, line in fronts if kind in NAMED]
    lines += [part for kind, line in fronts if kind not in NAMED for part in shapely.get_parts(beyond(line))]
    mouths = [
        line for kind, line in places if kind in _FRONTS - set(SHOWN) and _CORRIDOR_M <= line.length <= PASSAGE_M[1]
    ]
    narrow = [line for kind, line in places if kind in SHOWN and line.length <= PASSAGE_M[1]]
    for room in plan.rooms:
        edge = shapely.simplify(room.polygon, OF_EDGE_M / 3).exterior.coords
        for side in pairwise(edge):
            if math.dist(*side) >= _FRONT_M[0]:
                lines += shapely.get_parts(beyond(LineString(side))).tolist()
    named = {line.wkb: kind for kind, line in fronts if kind in NAMED}
    found: list[tuple[Room, LineString]] = []
    lines = [line for line in lines if _FRONT_M[0] <= line.length <= _FRONT_M[1]]
    for line in (*lines, *mouths):
        if in_walls(line) > line.length / 2:
            continue
        (ax, ay), (bx, by) = line.coords
        way = np.array([ay - by, bx - ax]) / line.length * WIDEST_WALL_M
        sides = shapely.points([np.array([ax + bx, ay + by]) / 2 + sign * way for sign in (1, -1)])
        beside = [(room, shapely.intersects(room.polygon, sides)) for room in plan.rooms]
        beside = [each for each in beside if each[1].any()]
        if len(beside) != 1 or beside[0][1].all() or shapely.dwithin(ways, line, WIDEST_WALL_M).any():
            continue
        (room, _) = beside[0]
        if shapely.intersection(line, shapely.buffer(room.polygon, WIDEST_WALL_M)).length < FREE * line.length:
            continue
        if source.is_open(line, room.polygon, shift):
            found.append((room, line))
    chosen: list[LineString] = []

    def rank(front: tuple[Room, LineString]) -> tuple[Any, ...]:
        room, line = front
        return -room.area, line.wkb not in named, -line.length, line.bounds

    for room, line in sorted(found, key=rank):
        is_asked = any(line.distance(other) < WIDEST_WALL_M for other in chosen) or any(
            line.distance(each.centroid) < WIDEST_WALL_M and each.length > line.length / 2 for each in narrow
        )
        if is_asked or len(chosen) == _MOST_FRONTS:
            continue
        chosen.append(line)
        (ax, ay), (bx, by) = shapely.get_coordinates(line).round(3).tolist()
        at = round((ax + bx) / 2, 3), round((ay + by) / 2, 3)
        shows = f"The source names {an(named[line.wkb])} here" if line.wkb in named else "No wall is seen here"
        says = f"{shows}, {line.length:.2f} m wide. Is it open to the outside: does one walk in?"
        answers = Answer("An entrance", "entrance", ((ax, ay), (bx, by))), Answer("A wall or a window")
        yield Question(key_of(plan, "front", at), at, says, answers, _FRONT, room.area, room.area**0.5)


def seen_in_part_questions(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R2."""
    if not source.walls or len(plan.rooms) < 2:
        return
    taken = _Taken(plan)
    for k, room in enumerate(plan.rooms):
        if room.confidence == 1.0 or doubt_of(room.confidence) is not None:
            continue
        beside = shapely.union_all([door.polygon for door in plan.doors if room.id in door.rooms])
        if not source.is_map:  # where rooms meet without a wall, another question is asked
            around = taken.near(shapely.box(*room.polygon.bounds).buffer(OF_EDGE_M), but=k, rooms_only=True)
            beside = shapely.union(beside, around)
        share = _seen_share(room.polygon.exterior, source, shift, beside)
        if share >= (_SEEN if source.is_map else _PORCH):
            continue
        point = point_in(room)
        says = f"The {'map' if source.is_map else 'source'} shows no wall along {1 - share:.0%} of the edge of this "
        says += f"{name_of(room)} of {room.area:.1f} m². Is it a room of the house?"
        answers = Answer("A room"), *none_of(point), Answer(SEVERAL), *_next_room(plan, room)
        yield Question(key_of(plan, "seen", point), point, says, answers, _UNSEEN, room.area, room.area**0.5)


def _next_room(plan: FloorPlan, room: Room) -> Iterator[Answer]:
    """Yield the answer that a room is a part of the one to which its widest passage leads."""
    ways = [door for door in plan.doors if room.id in door.rooms and None not in door.rooms]
    for way in sorted(ways, key=lambda door: -door.width)[:1]:
        (other,) = (plan.rooms[side] for side in way.rooms if side is not None and side != room.id)
        yield Answer(
            f"A part of the {name_of(other)} of {other.area:.1f} m²", "one_room", (point_in(room), point_in(other))
        )


def _seen_share(ring: LineString, source: SourceView, shift: tuple[float, float], ways: shapely.Geometry) -> float:
    """Return the share of a line beside which the source shows a wall, or one of the ways lies."""
    there = shapely.transform(ring, lambda points: points - np.array(shift))

    def share() -> float:
        at = shapely.line_interpolate_point(ring, np.arange(OF_EDGE_M / 2, max(ring.length, OF_EDGE_M), OF_EDGE_M))
        moved = shapely.transform(at, lambda points: points - np.array(shift))
        return float((shapely.intersects(source.near_walls, moved) | shapely.dwithin(at, ways, OF_EDGE_M)).mean())

    return float(source.computed.get_or_make((shapely.set_precision(there, GRID_M).wkb, ways.wkb), share))


def bay_questions(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R3."""
    if not (source.is_map and source.walls):
        return
    ways = shapely.union_all([door.polygon for door in plan.doors])
    found = [
        (area, line, point)
        for room in plan.rooms
        for area, line, point, edge in _narrow_bays(room.polygon.wkb)
        if _seen_share(edge, source, shift, ways) < _SEEN
    ]
    for area, line, point in sorted(found, key=lambda each: (-each[0], each[1].bounds))[:_MOST_BAYS]:
        (ax, ay), (bx, by) = shapely.get_coordinates(line).round(3).tolist()
        at = round(point.x, 3), round(point.y, 3)
        says = (
            f"The map shows hardly any wall around this part of {area:.1f} m², behind a place of {line.length:.2f} m. "
        )
        answers = (
            Answer("A wall shuts it off", "wall", ((ax, ay), (bx, by)), then=(Further("no_room", (at,)),)),
            Answer("It is of the room"),
            Answer("An opening to it", "opening", ((ax, ay), (bx, by))),
            Answer("A door to it", "door", ((ax, ay), (bx, by))),
        )
        yield Question(key_of(plan, "bay", at), at, f"{says}Is it of the room?", answers, _UNSEEN, area, area**0.5)


@lru_cache(maxsize=256)
def _narrow_bays(room: bytes) -> list[tuple[float, LineString, Point, LineString]]:
    """Return the bays of a room (WKB): the area of each, its narrow place, a point in it, and the rest of its edge."""
    shape, half, found = shapely.from_wkb(room), _BAY_NECK_M / 2, []
    wide = max(shapely.get_parts(shapely.buffer(shape, -half)), key=lambda part: part.area, default=shape)
    main = shapely.buffer(wide, half + GRID_M)
    for bay in shapely.get_parts(shapely.difference(shape, main)):
        if not SMALLEST_ROOM_M2 <= bay.area <= shape.area / 2:
            continue
        neck = shapely.intersection(bay.boundary, shapely.buffer(main, GRID_M))
        ends = shapely.get_coordinates(neck)
        apart = np.hypot(*(ends[:, None] - ends[None]).transpose(2, 0, 1))
        line = LineString(ends[list(np.unravel_index(int(apart.argmax()), apart.shape))])
        edge = shapely.difference(bay.boundary, shapely.buffer(neck, OF_EDGE_M))
        if OF_EDGE_M <= line.length <= edge.length:
            found.append((bay.area, line, bay.representative_point(), edge))
    return found
