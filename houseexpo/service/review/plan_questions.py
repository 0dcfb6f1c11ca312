"""Ask about the parts of a plan as it is: its passages, its rooms, and rooms that may be one.

R1  A cut was made because nothing, or hardly anything, showed a way between two parts of the plan: either a door is
    there, or no door, or the door is where the source shows one beside it, or else in the wall to a larger room beside
    the smaller one: a room of a row opens to the hall before all of them. Between parts that each have an entrance, no
    way may be needed: these may be houses of their own, and one answer says so of all such cuts.
R2  A passage or a room that is doubtful is asked about, and every entrance: a window may be one. If a person says that
    a room is several, the places where it may part are asked about (``line_questions``).
R3  Rooms that meet without a wall are one room, or they stay two; only where nobody has drawn a wall.
R4  If the source is known, the same is asked of rooms that several passages join, or one that is as wide as what lies
    at its sides: there, one space may have been parted. Passages in which the source shows a door or a lintel do not
    count.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise
from typing import Final

import numpy as np
import shapely
from shapely import LineString, Polygon

from houseexpo.corrections.draft import Draft
from houseexpo.corrections.openings import ALONG, dot
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, Room
from houseexpo.service.review.question import (
    CUT,
    PASSAGE_M,
    SEVERAL,
    SHOWN,
    WIDEST_WALL_M,
    Answer,
    Question,
    an,
    doubt_of,
    key_of,
    middle_of,
    name_of,
    names_of,
    none_of,
    point_in,
)
from houseexpo.tolerances import GRID_M, MIN_DOOR_M

_CUT_OF_WORDS: Final = 0.2
"""Doubt of a cut that was not rated: a person's words made it, and the same person may be about to draw the door."""
_WAY_OUT: Final = 0.3
"""The least doubt of an entrance: in marked plans that are not right, 23 of 65 with a confidence of 0.7 or more are
windows, or nothing."""
_MEET_OPEN: Final = 0.35
"""Doubt of rooms that meet without a wall: most sources that name both rooms mean two rooms."""
_NARROW: Final = {"several": 0.4, "wide": 0.3}
"""Doubt of rooms that passages join. In maps that people judged, 4 of 15 pairs with several passages were one room, and
3 of 36 with a wide one; an answer is seen at a glance, so the doubts are higher than these shares."""
_MOST_WAYS: Final = 4
"""Ways between two rooms of which one may be the only one: each needs a key."""
_WIDE: Final = 0.6
"""A passage that takes this share of the edges at which two rooms face each other has no wall beside it: the rest lies
before the ends of the walls that it meets."""
_FACING_M: Final = 0.4
"""Rooms that are nearer to each other face each other, metres: across the walls of homes."""
_MEETING_M: Final = 1.0
"""Rooms whose common border is shorter have a passage between them, metres."""


def passage_questions(
    plan: FloorPlan, shown: Sequence[tuple[str, LineString]] = (), closed: Sequence[tuple[float, float]] = ()
) -> Iterator[Question]:
    """R1, R2. ``shown`` are the places where the source shows a door, a lintel or a gap; ``closed`` are no ways."""
    shut = shapely.multipoints(np.reshape(closed, (-1, 2)))
    free = [each for each in free_places(plan, shown) if not shapely.dwithin(shut, each[1], WIDEST_WALL_M)]
    needless = _cuts_between_houses(plan)
    for door in plan.doors:
        doubt = doubt_of(door.confidence)
        if door.kind == "cut":  # R1
            doubt = _CUT_OF_WORDS if door.confidence is None else CUT
        elif door.kind == "entrance" and door.confidence not in {None, 1.0}:
            doubt = max(doubt or 0.0, _WAY_OUT)
        if doubt is None:
            continue
        at = middle_of(door)
        ends = tuple(door.segment)
        sides = sorted((plan.rooms[side] for side in door.rooms if side is not None), key=lambda room: room.area)
        places = tuple(map(point_in, sides))
        between = names_of(sides[::-1])
        area, answers = 0.0, tuple[Answer, ...]()
        if door.kind == "cut":
            says = f"{_shown_at(door, shown)} a way between {between}, so a cut of {door.width:.2f} m was made. "
            says += "Is a door there?"
            area = sides[0].area
            answers = (
                Answer("A door", "door", ends),
                Answer("None", "no_door", (at,)),
                Answer("An opening", "opening", ends),
                Answer("They are one room", "one_room", places),
                Answer(f"{area:.1f} m² are no room", "no_room", places[:1]),
                Answer(f"{sides[-1].area:.1f} m² are outside", "outside", places[1:]),
                *(
                    list(_ways_beside(plan, door, free))
                    or list(_no_cuts(door, needless))
                    or list(_way_to_larger(plan, door, sides, shut))
                ),
            )
        elif door.kind == "entrance" and door.confidence is not None:
            says = f"Does one walk in here, an entrance of {door.width:.2f} m?"
            answers = (
                Answer("An entrance", "entrance", ends),
                Answer("A window", "window", (at,)),
                Answer("No way", "no_door", (at,)),
            )
        else:
            says = f"Is there {an(door.kind)} of {door.width:.2f} m between {between}?"
            answers = (
                Answer("Yes", door.kind, ends),
                Answer("None", "no_door", (at,)),
                Answer("They are one room", "one_room", places),
            )
        yield Question(
            key_of(plan, door.kind, at), at, says, answers, doubt, area, door.width if not area else area**0.5
        )


def _cuts_between_houses(plan: FloorPlan) -> list[Door]:
    """R1. Return the cuts that join two parts of a plan of which each has an entrance."""
    cuts = [door for door in plan.doors if door.kind == "cut"]
    if len(cuts) < 2:  # of a single one, "None" says the same
        return []
    draft = Draft(plan)
    draft.doors = [door for door in draft.doors if door.kind != "cut"]
    part = {room.before.id: k for k, rooms in enumerate(draft.pieces()) for room in rooms if room.before}
    entered = {part[side] for door in plan.doors if None in door.rooms for side in door.rooms if side is not None}
    sides = [{part[side] for side in cut.rooms if side is not None} for cut in cuts]
    found = [cut for cut, parts in zip(cuts, sides, strict=True) if len(parts) > 1 and parts <= entered]
    return found if len(found) > 1 else []


def _no_cuts(cut: Door, needless: Sequence[Door]) -> Iterator[Answer]:
    """R1. Yield the answer that none of the cuts between houses of their own is a way."""
    others = tuple((middle_of(other),) for other in needless if other is not cut)
    if len(others) < len(needless):
        title = f"None of the {len(needless)} cuts between houses of their own"
        yield Answer(title, "no_door", (middle_of(cut),), more=others)


def _shown_at(cut: Door, shown: Sequence[tuple[str, LineString]]) -> str:
    """R1. Return who shows a way where a cut is."""
    kind = next((kind for kind, line in shown if kind in SHOWN and cut.polygon.distance(line.centroid) < GRID_M), "")
    return f"Only {an(kind)} here shows" if kind else "Nothing shows"


def _ways_beside(plan: FloorPlan, cut: Door, free: Sequence[tuple[str, LineString]]) -> Iterator[Answer]:
    """R1. Yield the nearest free place at a cut's smaller room, first those to the larger; see ``free_places``."""
    rooms = [room.polygon for room in plan.rooms]
    small, large = sorted((number for number in cut.rooms if number is not None), key=lambda number: rooms[number].area)
    near = []
    for kind, line in free:
        sides = rooms_beside(line, rooms)
        if small in sides and None not in sides and sides[0] != sides[1] and line.distance(cut.polygon) > 0:
            near.append((large not in sides, line.distance(cut.polygon), kind, line))
    for _, _, kind, line in sorted(near, key=lambda each: each[:2])[:1]:
        (ax, ay), (bx, by) = line.coords
        yield Answer(f"A door where the {kind} is", "door", ((ax, ay), (bx, by)))


def _way_to_larger(plan: FloorPlan, cut: Door, sides: Sequence[Room], shut: shapely.Geometry) -> Iterator[Answer]:
    """R1. Yield a door from a cut's smaller room to the largest room beside it, if no passage joins the two yet.

    ``shut`` are places where no way is.
    """
    small, known = sides[0], sides[-1]
    joined = {side for door in plan.doors if small.id in door.rooms for side in door.rooms}
    larger = [room for room in plan.rooms if room.area > known.area and room.id not in joined]
    for ends in way_to_largest(small.polygon, larger, cut.width):
        if not shapely.dwithin(shut, LineString(ends), WIDEST_WALL_M):
            yield Answer("A door to the largest room beside it", "door", ends)


def way_to_largest(
    space: Polygon, rooms: Sequence[Room], width_m: float
) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Yield the ends of a door in the middle of the longest wall between a space and the largest room beside it."""
    reach = shapely.buffer(space, WIDEST_WALL_M)
    for room in sorted(rooms, key=lambda room: -room.area):
        if not reach.intersects(room.polygon):
            continue
        other = shapely.buffer(room.polygon, WIDEST_WALL_M)
        edges = shapely.get_parts(shapely.line_merge(shapely.intersection(space.boundary, other)))
        corners = [shapely.get_coordinates(edge) for edge in edges]
        straight = [LineString(pair) for line in corners for pair in pairwise(line)]
        wall = max(straight, key=lambda line: line.length, default=LineString())
        if wall.length > width_m:
            half = width_m / 2 / wall.length
            ends = [wall.interpolate(0.5 + side, normalized=True) for side in (-half, half)]
            (ax, ay), (bx, by) = ((round(end.x, 3), round(end.y, 3)) for end in ends)
            yield (ax, ay), (bx, by)
            return


def free_places(plan: FloorPlan, shown: Sequence[tuple[str, LineString]]) -> list[tuple[str, LineString]]:
    """Return the places as wide as a door where the source shows a way and the plan has none.

    A cut is a guess, and a passage in another wall, as round a corner, is another one: these take only their ground.
    """
    places = [(kind, line) for kind, line in shown if kind in SHOWN and MIN_DOOR_M <= line.length <= PASSAGE_M[1]]
    doors = [door for door in plan.doors if math.dist(*door.segment) > 0]
    tree = shapely.STRtree([door.polygon for door in doors])
    middles = shapely.centroid([line for _, line in places])

    def takes(number: int, place: int) -> bool:
        door, line = doors[number], places[place][1]
        ways = [np.subtract(*reversed(ends)) / math.dist(*ends) for ends in (line.coords, door.segment)]
        is_in_its_wall = door.kind != "cut" and abs(dot(*ways)) > ALONG
        return is_in_its_wall or bool(door.polygon.distance(middles[place]) < GRID_M)

    near = tree.query(middles, predicate="dwithin", distance=WIDEST_WALL_M).T.tolist()
    taken = {place for place, number in near if takes(number, place)}
    return [each for k, each in enumerate(places) if k not in taken]


def rooms_beside(line: LineString, rooms: Sequence[Polygon]) -> list[int | None]:
    """Return the numbers of the nearest rooms before both sides of a line, from its middle to ``WIDEST_WALL_M``."""
    (ax, ay), (bx, by) = line.coords
    middle, way = np.array([ax + bx, ay + by]) / 2, np.array([ay - by, bx - ax]) / line.length * WIDEST_WALL_M
    found: list[int | None] = []
    for sign in (1, -1):
        shares = shapely.intersection(LineString([middle, middle + sign * way]), rooms)
        far = np.where(shapely.is_empty(shares), np.inf, shapely.distance(shapely.Point(middle), shares))
        found.append(int(far.argmin()) if np.isfinite(far).any() else None)
    return found


def room_questions(plan: FloorPlan) -> Iterator[Question]:
    """R2."""
    for room in plan.rooms if len(plan.rooms) > 1 else ():  # the only room cannot be taken out
        doubt = doubt_of(room.confidence)
        if doubt is not None:
            at = point_in(room)
            says = f"Is this {name_of(room)} of {room.area:.1f} m² a room of the house?"
            answers = Answer("A room", "room", (at,)), *none_of(at), Answer(SEVERAL)
            yield Question(key_of(plan, "room", at), at, says, answers, doubt, room.area, room.area**0.5)


def meeting_questions(plan: FloorPlan) -> Iterator[Question]:
    """R3."""
    joined = {frozenset(door.rooms) for door in plan.doors}
    grown = {room.id: shapely.buffer(room.polygon, GRID_M) for room in plan.rooms}
    for one, other in combinations(plan.rooms, 2):
        if frozenset((one.id, other.id)) in joined or not grown[one.id].intersects(other.polygon):
            continue
        edge = shapely.intersection(grown[one.id], other.polygon.boundary)
        if edge.length < _MEETING_M:
            continue
        point = shapely.line_interpolate_point(
            max(shapely.get_parts(edge), key=lambda part: part.length), 0.5, normalized=True
        )
        at = (round(point.x, 3), round(point.y, 3))
        says = f"{names_of((one, other)).capitalize()} meet without a wall for {edge.length:.1f} m. Are they one room?"
        answers = Answer("One room", "one_room", (point_in(one), point_in(other))), Answer("Two rooms")
        yield Question(key_of(plan, "meet", at), at, says, answers, _MEET_OPEN, min(one.area, other.area))


def parted_questions(plan: FloorPlan, places: Sequence[tuple[str, LineString]]) -> Iterator[Question]:
    """R4."""
    shown = [line for kind, line in places if kind in {"door", "lintel"}]
    between: dict[tuple[int, int], list[Door]] = {}
    for door in plan.doors:
        one, other = door.rooms
        if one is not None and other is not None and all(line.distance(door.polygon) > GRID_M for line in shown):
            between.setdefault((min(one, other), max(one, other)), []).append(door)
    for (a, b), doors in between.items():
        first, second, widest = plan.rooms[a], plan.rooms[b], max(doors, key=lambda door: door.width)
        if any(door.confidence == 1.0 for door in doors):  # a person has said it, or nothing is surer
            continue
        if len(doors) > 1:
            why, doubt = f"{len(doors)} passages join them", _NARROW["several"]
        elif widest.kind != "cut" and widest.width >= _WIDE * _facing_m(first, second, widest):
            why, doubt = f"They are open to each other for {widest.width:.2f} m", _NARROW["wide"]
        else:
            continue
        at = middle_of(widest)
        says = f"Are {names_of((first, second))} one room? {why}."
        joined = Answer("One room", "one_room", (point_in(first), point_in(second)))
        answers = joined, Answer("Two rooms"), *(_only(door, doors) for door in doors if 1 < len(doors) <= _MOST_WAYS)
        yield Question(key_of(plan, "parted", at), at, says, answers, doubt, min(first.area, second.area))


def _only(door: Door, doors: Sequence[Door]) -> Answer:
    """Return the answer that one of several passages between two rooms is the only one."""
    others = [(middle_of(other),) for other in doors if other is not door]
    return Answer(f"Two rooms, and only the way of {door.width:.2f} m", "no_door", others[0], more=tuple(others[1:]))


def _facing_m(one: Room, other: Room, door: Door) -> float:
    """Return the length of the edge at which two rooms face each other across a wall, including the door in it."""
    near = max(door.polygon.area / max(door.width, GRID_M), _FACING_M)
    edges = [(one.polygon.boundary, other.polygon), (other.polygon.boundary, one.polygon)]
    return float(
        min(shapely.intersection(edge, shapely.buffer(room, near, quad_segs=1)).length for edge, room in edges)
    )
