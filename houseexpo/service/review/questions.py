"""Ask a person about the doubtful places of a plan: one sentence, two opposite answers, the most valuable first.

R1  A cut was made because nothing showed a way between two parts of the plan: either a door is there, or no door, or
    the door is where the source shows one beside it.
R2  A passage or a room that is rated below ``ASKED_BELOW`` is asked about, and every entrance: a window may be one.
    If a person says that a room is several, the places where it may part are asked about (R6).
    A room is also asked about if the source shows no wall along much of its edge: a porch, or what rays saw.
R3  Rooms that meet without a wall are one room, or they stay two; only where nobody has drawn a wall. If the source is
    known, the same is asked of rooms that several passages join, or one that is as wide as what lies at its sides:
    there, one space may have been parted. Passages in which the source shows a door or a lintel do not count.
R4  A question that a person has answered or skipped is not asked again. Answers are words of the storey, as if drawn.
    A line that would part what a person has said to be one room, or has outlined, is not asked about, nor one in whose
    place such a question was answered, nor what the source shows along a line where a person has said no wall.
R5  If the source is known, three more things are asked about: a space between walls that the plan left out and that is
    large enough for a room; a room that takes only a part of the space between its walls; and a door or a gap in the
    source, in a wall of a room, where the plan has no passage.
R6  If a corner juts into a room, the lines that extend its two edges to the opposite wall may be openings between two
    rooms, as may a door or a gap that the source shows in a room. A line is asked about if it parts off a space that
    could be a room, and is as narrow as an opening, or narrower than this space is wide. Lines between two corners
    come first: these are the jambs of a doorway.
R7  Facts about the whole file that the reader guessed (its unit, its axis) are asked first, once for the file: all else
    depends on them. Its size is also asked about if the sizes of its doors and storeys make another one clearly
    likelier, and its floors if another level surface may be one, or a storey of several is doubtful or gave no plan.
    What somebody has said is not asked.
R8  An answer's value is the question's doubt times (``_LEAST`` + the share of the plan's area that it concerns).
    Questions of one kind about parts of a similar size are grouped, as one answer is often true of all of them. The
    group with the most valuable question comes first.
R9  The answers to a question are all that is usually true of such a place, the two most usual first.
R10 If the source shows something in a room that is higher than a person and that would part it, it may be a wall.
    Pieces in a row are one wall.
R11 A shape whose ring crosses itself counts as its largest part. A rule that meets a fault of geometry asks no further
    questions; those of the other rules stay.
R12 A front is a line of a room's edge towards the outside that is wider than a door, and where the source shows no
    wall, or a lintel or a sill: it may be a garage's mouth or an open porch. A robot's map shows none: there R2 asks.
R13 In a robot's map, a part of a room behind a narrow place is asked about if the map shows no wall along much of its
    edge: rays went through a gap. A wall that stands free in a room may part it, with an opening at each of its ends.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence, Set
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from itertools import combinations, pairwise
from typing import Annotated, Any, Final

import msgspec
import numpy as np
import shapely
from msgspec import Meta
from shapely import GEOSException, LineString, Point, Polygon
from shapely.ops import split

from houseexpo.corrections import Correction
from houseexpo.corrections.apply import Trial
from houseexpo.corrections.draft import largest_valid_part
from houseexpo.corrections.openings import ONWARD_M
from houseexpo.corrections.rooms import OF_NO_ROOM
from houseexpo.corrections.vocabulary import UNITS_M, Word, checked_values
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Door, Room
from houseexpo.service.review.sources import OF_EDGE_M, SourceView
from houseexpo.tolerances import SMALLEST_ROOM_M2

ASKED_BELOW: Final = 0.9
"""Confidence. In marked plans that are not right, 26 of 244 rooms and 18 of 33 doors and openings rated 0.7 to 0.9 are
wrong; of those above, 12 of 373 and none of 435."""
_WAY_OUT: Final = 0.3
"""The least doubt of an entrance: in such plans, 23 of 65 with a confidence of 0.7 or more are windows, or nothing."""
_LIKE: Final = 1.2
"""Parts whose sizes in metres differ by a smaller factor look alike."""
_CUT: Final = 0.95
"""Doubt of a cut that is not rated: its place is a guess."""
_OPEN: Final = 0.35
"""Doubt of rooms that meet without a wall: most sources that name both rooms mean two rooms."""
_SEEN: Final = 0.75
"""The least share of a room's edge beside which the source shows a wall or the plan has a passage. In right plans of
robots' maps, all rooms have 0.83 or more; what only rays saw through glass or doors has 0.5 to 0.7."""
_PORCH: Final = 0.5
"""The same of other sources: a garage or a shop lacks one wall of four, and its front is asked about; a porch two."""
_UNSEEN: Final = 0.5
"""Doubt of a room of which the source shows less."""
_NARROW: Final = {"several": 0.4, "wide": 0.3}
"""Doubt of rooms that passages join. In maps that people judged, 4 of 15 pairs with several passages were one room, and
3 of 36 with a wide one; an answer is seen at a glance, so the doubts are higher than these shares."""
_MOST_NARROW: Final = 6
_MOST_WAYS: Final = 4
"""Ways between two rooms of which one may be the only one: each needs a key."""
_WIDE: Final = 0.6
"""A passage that takes this share of the edges at which two rooms face each other has no wall beside it: the rest lies
before the ends of the walls that it meets."""
_FACING_M: Final = 0.4
"""Rooms that are nearer to each other face each other, metres: across the walls of homes."""
_MEETING_M: Final = 1.0
"""Rooms whose common border is shorter have a passage between them, metres."""
_TOUCH_M: Final = 0.01
"""Rooms within this distance share an edge, metres: the grid of a plan."""
_LEFT_OUT: Final = 0.6
"""Doubt of a left-out space: some are shafts, courts and hollow walls."""
_SHOWN: Final = {"door": 0.3, "opening": 0.3, "lintel": 0.25, "gap": 0.2}
"""Doubt of a place without a passage, by the kind of evidence in the source. Of 14 groups, no mark wants any."""
_FRONT_M: Final = (1.5, 15.0)
"""The least and the greatest width of a front, metres. People drew 1.7 to 12.6 m."""
_FRONTS: Final = {*_SHOWN, "gate", "mouth", "floor_edge"}
"""Kinds of evidence in the source that may be a front."""
_FRONT: Final = 0.3
"""Doubt of a front, as of a place that the source names."""
_MOST_FRONTS: Final = 6
_FREE: Final = 0.8
"""A left-out space has at least this share of its area outside all rooms."""
_WIDEST_WALL_M: Final = 0.6
"""A place in a wall of a room is at most this far from the room, metres: half of the thickest wall."""
_PASSAGE_M: Final = (0.6, 2.5)
"""The least and the greatest width of an opening, metres."""
_BAY_NECK_M: Final = 2 * _PASSAGE_M[0]
"""The widest place behind which a part of a room in a map is a bay, metres: rays went through a door or a gap."""
_MOST_BAYS: Final = 6
_CORNER: Final = 0.4
"""Doubt of an opening at a corner that juts into a room: of 19 groups of them, 7 part a room that is several."""
_MOST_CORNERS: Final = 6
_MOST_OF_SEVERAL: Final = 12
"""Places asked about besides in rooms of which a person said that they are several."""
_MOST_WIDE: Final = 3
"""Places wider than an opening that are asked about too."""
_LARGER: Final = 0.3
"""Doubt of a room that takes a part of the space between its walls."""
MOST_POINTS: Final = 400
"""The most points of an outline, or rooms to merge."""
_SEEN_WALL: Final = 0.4
"""Doubt of a wall that the source shows and the plan lacks: some are cupboards."""
_SHORTEST_WALL_M: Final = 0.5
"""What is seen of such a wall away from the walls beside it, metres."""
_MOST_WALLS_ASKED: Final = 6
_LEAST: Final = 0.25
"""The value of a passage itself: as if it concerned a quarter of the plan."""
_SIZES: Final = {"units", "scale", "storey_height"}
_TOLD_BY: Final = {"units": _SIZES, "scale": _SIZES, "up": {"up"}, "levels": {"floors", "storey_height"}}
"""Options of a reader that state what it would guess; a known distance is given to it as the unit."""
SEVERAL: Final = "Several rooms"
"""The answer after which the places are asked about at which the room may part."""
GUESS: Final = "guess of the file"
FLOORS: Final = "floors of the file"
"""The keys of the questions about a file: one for all its storeys."""
_MOST_SIZES: Final = 3
_MOST_LEFT_OUT: Final = 3
"""Storeys that may be none, and sizes that are offered: each answer needs a key."""
_GUESSED: Final = {"units": "the unit", "scale": "the scale", "up": "the upward axis"}


_DENIED: Final = frozenset({"no_door", "window", "no_room", "outside"})
"""Words that deny a part at a place: questions about this place are not asked again."""
_PARTING: Final = ("corner", "wall", "bay", "free")
"""Questions about lines that may part a room."""
Places = Sequence[tuple[float, float]]


class Further(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A further word of an answer or a decision, with its points in plan metres."""

    action: Word
    points: Annotated[tuple[tuple[float, float], ...], Meta(max_length=MOST_POINTS)]


class Answer(msgspec.Struct, frozen=True):
    """An answer: the text of its button, and its word; no word if the plan is right as it is.

    The action "file" opens the statements about the file; a key of ``FILE_WORDS`` states ``text``. ``more`` are the
    points of further places for the same word, ``then`` are further words.
    """

    title: str
    action: str = "leave"
    points: tuple[tuple[float, float], ...] = ()
    text: str = ""
    more: tuple[tuple[tuple[float, float], ...], ...] = ()
    then: tuple[Further, ...] = ()


class Question(msgspec.Struct, frozen=True):
    """A question about a place ``at`` of a plan, metres; ``key`` names it in the log, ``doubt`` is from 0 to 1.

    ``area`` is the area of the rooms or the space that an answer concerns, m2. ``size`` is the size of the part in
    metres, and ``like`` the sizes of all parts of its group, in words; "" if all parts of the kind look alike.
    """

    key: str
    at: tuple[float, float]
    says: str
    answers: tuple[Answer, ...]
    doubt: float
    area: float = 0.0
    size: float = 0.0
    like: str = ""

    @property
    def group(self) -> tuple[str, ...]:
        """Questions of one group doubt the same thing of parts of one size, and have the same answers."""
        return (self.key.split(" at ")[0], self.like, *(each.action for each in self.answers))


def questions(
    plan: FloorPlan,
    left: Collection[str] = (),
    source: SourceView | None = None,
    said: Sequence[tuple[str, Places]] = (),
    several: Set[str] = frozenset(),
) -> list[Question]:
    """Return the questions about a plan, the most valuable first (R1 to R8).

    ``left`` are the keys of skipped questions. ``said`` are words of the storey with their points (x, y) in the plan,
    metres. ``several`` are the keys of questions about rooms that were answered by ``SEVERAL``.
    """
    if plan.frame is None:
        return []
    plan, places = _mended(plan), list[tuple[str, LineString]]()
    closed = [points[0] for word, points in said if word in _DENIED]
    rules = [_rooms(plan), _meetings(plan)]
    if source is not None and source.plan is not None:
        dx, dy = np.subtract(source.origin, source.origin_of(plan)).round(3).tolist()
        places = [(kind, LineString(np.add(ends, (dx, dy)).round(3))) for kind, ends in source.places]
        rules += [
            _guesses(plan, source),
            _floors(plan, source),
            _parted(plan, places),
            _seen_in_part(plan, source, (dx, dy)),
            _spaces_left_out(plan, source, (dx, dy), closed),
            _larger(plan, source, (dx, dy)),
            _places(plan, places, closed),
            _fronts(plan, source, places, (dx, dy)),
            _walls_seen(plan, source, (dx, dy), closed),
            _bays(plan, source, (dx, dy)),
            _free_walls(plan, source, (dx, dy)),
        ]
    rules.append(_passages(plan, places))
    rules.append(_corners(plan, [line for kind, line in places if kind in _SHOWN], several))
    found = [each for rule in rules for each in _without_fault(rule)]
    bays = [LineString(each.answers[0].points) for each in found if each.key.startswith("bay")]
    found = [each for each in found if not each.key.startswith("corner") or not _is_at(each, bays)]
    found = [each for each in found if each.key not in left and not _is_told(plan, each, left, said)]
    return _in_order(found, plan.area)


def _is_told(plan: FloorPlan, asked: Question, left: Collection[str], said: Sequence[tuple[str, Places]]) -> bool:
    """R4."""
    if not asked.key.startswith(_PARTING):
        return False
    frame: Any = plan.frame
    there = source_points_from_plan(frame, [asked.at])[0]
    if any(math.dist(there, _place_of(key)) < OF_EDGE_M for key in left if key.startswith(_PARTING)):
        return True
    pieces = [LineString(points) for points in (asked.answers[0].points, *asked.answers[0].more)]
    gone = [LineString(points) for word, points in said if word == "no_wall"]
    is_wall = asked.key.startswith("wall")
    if is_wall and gone:
        taken = shapely.intersection(shapely.multilinestrings(pieces), shapely.union_all(gone).buffer(OF_EDGE_M))
        if taken.length >= sum(piece.length for piece in pieces) / 2:
            return True
    whole = _longer(LineString([pieces[0].coords[0], pieces[-1].coords[-1]]), _PASSAGE_M[1] if is_wall else OF_EDGE_M)
    return any(_parts(plan, word, points, whole) for word, points in said)


def _parts(plan: FloorPlan, word: str, points: Places, line: LineString) -> bool:
    """Return whether a line parts a room that a person has said to be one, or has outlined (R4)."""
    if word == "room_outline":
        outline = Polygon(points)
        return outline.is_valid and _parted_m2(outline, line) >= SMALLEST_ROOM_M2
    xs, ys = np.transpose(points)
    rooms = [room.polygon for room in plan.rooms if shapely.contains_xy(room.polygon, xs, ys).all()]
    if word != "one_room" or not rooms:
        return False
    return bool(sum(shapely.contains_xy(part, xs, ys).any() for part in split(rooms[0], line).geoms) > 1)


def _place_of(key: str) -> tuple[float, float]:
    """Return the place in a question's key (``_key``)."""
    x, y = key.split(" at ")[1].split(", ")
    return float(x), float(y)


def _is_at(question: Question, lines: Sequence[LineString]) -> bool:
    """Return whether a question's line is one of those."""
    line = LineString(question.answers[0].points)
    return any(line.distance(other) < OF_EDGE_M for other in lines)


def _mended(plan: FloorPlan) -> FloorPlan:
    """R11."""

    def ring(part: shapely.Geometry) -> Any:
        return shapely.get_coordinates(part)[:-1]

    rooms, doors = list(plan.rooms), list(plan.doors)
    for k, room in enumerate(rooms):
        if not room.polygon.is_valid and (whole := largest_valid_part(room.polygon)):
            rooms[k] = replace(room, ring=ring(whole.exterior), holes=tuple(map(ring, whole.interiors)))
    for k, door in enumerate(doors):
        if not door.polygon.is_valid and (whole := largest_valid_part(door.polygon)):
            doors[k] = replace(door, ring=ring(whole))
    return replace(plan, rooms=tuple(rooms), doors=tuple(doors))


def _without_fault(rule: Iterable[Question]) -> Iterator[Question]:
    """R11."""
    with suppress(GEOSException):
        yield from rule


def gap_question(ends: tuple[tuple[float, float], tuple[float, float]]) -> Question:
    """Return the question about the gap (two ends) by which a space stays open after a word (``corrections.leaks``)."""
    (ax, ay), (bx, by) = ends
    at = round((ax + bx) / 2, 3), round((ay + by) / 2, 3)
    says = (
        f"The space is still open here: a gap of {math.dist(*ends):.2f} m leads on. Does a wall shut it? Click it, or "
        "answer."
    )
    answers = Answer("A wall", "wall", ends), Answer("It stays open")
    return Question(f"gap at {at[0]}, {at[1]}", at, says, answers, 1.0)


def _in_order(asked: Sequence[Question], area: float) -> list[Question]:
    """R7, R8."""
    asked = _grouped(asked)
    worth = {each.key: each.doubt * (_LEAST + min(each.area / area, 1.0)) for each in asked}
    best: dict[tuple[str, ...], float] = {}
    for each in asked:
        best[each.group] = max(best.get(each.group, 0.0), worth[each.key])
    return sorted(asked, key=lambda each: (each.doubt < 1.0, -best[each.group], each.group, -worth[each.key], each.key))


def _grouped(asked: Sequence[Question]) -> list[Question]:
    """R8."""
    groups: dict[tuple[str, ...], list[list[Question]]] = {}
    for each in sorted(asked, key=lambda each: (each.size, each.key)):
        found = groups.setdefault(each.group, [])
        if not found or each.size > _LIKE * found[-1][-1].size:
            found.append([])
        found[-1].append(each)
    return [
        msgspec.structs.replace(each, like=_sizes(group) if len(found) > 1 else "")
        for found in groups.values()
        for group in found
        for each in group
    ]


def _sizes(group: Sequence[Question]) -> str:
    low, high = (f"{each.area if each.area else each.size:.1f}" for each in (group[0], group[-1]))
    return f"{low if low == high else f'{low} to {high}'} {'m²' if group[0].area else 'm'}"


def _passages(plan: FloorPlan, shown: Sequence[tuple[str, LineString]] = ()) -> Iterator[Question]:
    """R1, R2. ``shown`` are the places where the source shows a door, a lintel or a gap."""
    free = _free_places(plan, shown)
    for door in plan.doors:
        doubt = _doubt(door.confidence)
        if door.kind == "cut":  # R1
            doubt = max(doubt or _CUT, _CUT)
        elif door.kind == "entrance" and door.confidence not in {None, 1.0}:
            doubt = max(doubt or 0.0, _WAY_OUT)
        if doubt is None:
            continue
        at = _middle(door)
        ends = tuple(door.segment)
        sides = sorted((plan.rooms[side] for side in door.rooms if side is not None), key=lambda room: room.area)
        places = tuple(map(_inside, sides))
        between = _names(sides[::-1])
        area, answers = 0.0, tuple[Answer, ...]()
        if door.kind == "cut":
            says = f"Nothing shows a way between {between}, so a cut of {door.width:.2f} m was made. Is a door there?"
            area = sides[0].area
            answers = (
                Answer("A door", "door", ends),
                Answer("None", "no_door", (at,)),
                Answer("An opening", "opening", ends),
                Answer("They are one room", "one_room", places),
                Answer(f"{area:.1f} m² are no room", "no_room", places[:1]),
                Answer(f"{sides[-1].area:.1f} m² are outside", "outside", places[1:]),
                *_ways_beside(door, sides, free),
            )
        elif door.kind == "entrance" and door.confidence is not None:
            says = f"Does one walk in here, an entrance of {door.width:.2f} m?"
            none, window = Answer("No way", "no_door", (at,)), Answer("A window", "window", (at,))
            way = Answer("An entrance", "entrance", ends)
            answers = (none, way, window) if door.confidence <= OF_NO_ROOM else (way, window, none)  # R9
        else:
            says = f"Is there {_a(door.kind)} of {door.width:.2f} m between {between}?"
            answers = (
                Answer("Yes", door.kind, ends),
                Answer("None", "no_door", (at,)),
                Answer("They are one room", "one_room", places),
            )
        yield Question(_key(plan, door.kind, at), at, says, answers, doubt, area, door.width if not area else area**0.5)


def _ways_beside(cut: Door, sides: Sequence[Room], free: Sequence[tuple[str, LineString]]) -> Iterator[Answer]:
    """R1. Yield the nearest free place at a cut's smaller room, first those to the larger; see ``_free_places``."""
    small, large = (shapely.buffer(room.polygon, _WIDEST_WALL_M) for room in sides)
    near = [
        (not large.contains(line.centroid), line.distance(cut.polygon), kind, line)
        for kind, line in free
        if small.contains(line.centroid) and line.distance(cut.polygon) > 0
    ]
    for _, _, kind, line in sorted(near, key=lambda each: each[:2])[:1]:
        (ax, ay), (bx, by) = line.coords
        yield Answer(f"A door where the {kind} is", "door", ((ax, ay), (bx, by)))


def _free_places(plan: FloorPlan, shown: Sequence[tuple[str, LineString]]) -> list[tuple[str, LineString]]:
    """Return the places as wide as a passage where the source shows a way and the plan has none; a cut is a guess."""
    doors = [(door.polygon, _TOUCH_M if door.kind == "cut" else _WIDEST_WALL_M) for door in plan.doors]
    return [
        (kind, line)
        for kind, line in shown
        if kind in _SHOWN
        and _PASSAGE_M[0] <= line.length <= _PASSAGE_M[1]
        and all(door.distance(line.centroid) >= near for door, near in doors)
    ]


def _rooms(plan: FloorPlan) -> Iterator[Question]:
    for room in plan.rooms if len(plan.rooms) > 1 else ():  # the only room cannot be taken out
        doubt = _doubt(room.confidence)
        if doubt is not None:
            at = _inside(room)
            says = f"Is this {_name(room)} of {room.area:.1f} m² a room of the house?"
            answers = Answer("A room", "room", (at,)), *_none(at), Answer(SEVERAL)
            yield Question(_key(plan, "room", at), at, says, answers, doubt, room.area, room.area**0.5)


def _none(at: tuple[float, float]) -> tuple[Answer, Answer]:
    return Answer("No room", "no_room", (at,)), Answer("Outside", "outside", (at,))


def _meetings(plan: FloorPlan) -> Iterator[Question]:
    """R3."""
    joined = {frozenset(door.rooms) for door in plan.doors}
    grown = {room.id: shapely.buffer(room.polygon, _TOUCH_M) for room in plan.rooms}
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
        says = f"{_names((one, other)).capitalize()} meet without a wall for {edge.length:.1f} m. Are they one room?"
        answers = Answer("One room", "one_room", (_inside(one), _inside(other))), Answer("Two rooms")
        yield Question(_key(plan, "meet", at), at, says, answers, _OPEN, min(one.area, other.area))


def _seen_in_part(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R2."""
    if not source.walls or len(plan.rooms) < 2:
        return
    taken = _Taken(plan)
    for k, room in enumerate(plan.rooms):
        if room.confidence == 1.0 or _doubt(room.confidence) is not None:
            continue
        beside = shapely.union_all([door.polygon for door in plan.doors if room.id in door.rooms])
        if not source.is_map:  # where rooms meet without a wall, another question is asked
            around = taken.near(shapely.box(*room.polygon.bounds).buffer(OF_EDGE_M), but=k, rooms_only=True)
            beside = shapely.union(beside, around)
        share = _seen_share(room.polygon.exterior, source, shift, beside)
        if share >= (_SEEN if source.is_map else _PORCH):
            continue
        point = _inside(room)
        says = f"The {'map' if source.is_map else 'source'} shows no wall along {1 - share:.0%} of the edge of this "
        says += f"{_name(room)} of {room.area:.1f} m². Is it a room of the house?"
        answers = Answer("A room"), *_none(point), Answer(SEVERAL), *_next_room(plan, room)
        yield Question(_key(plan, "seen", point), point, says, answers, _UNSEEN, room.area, room.area**0.5)


def _next_room(plan: FloorPlan, room: Room) -> Iterator[Answer]:
    """Yield the answer that a room is a part of the one to which its widest passage leads."""
    ways = [door for door in plan.doors if room.id in door.rooms and None not in door.rooms]
    for way in sorted(ways, key=lambda door: -door.width)[:1]:
        (other,) = (plan.rooms[side] for side in way.rooms if side is not None and side != room.id)
        yield Answer(
            f"A part of the {_name(other)} of {other.area:.1f} m²", "one_room", (_inside(room), _inside(other))
        )


def _seen_share(ring: LineString, source: SourceView, shift: tuple[float, float], ways: shapely.Geometry) -> float:
    """Return the share of a line beside which the source shows a wall, or one of the ways lies."""
    there = shapely.transform(ring, lambda points: points - np.array(shift))

    def share() -> float:
        at = shapely.line_interpolate_point(ring, np.arange(OF_EDGE_M / 2, max(ring.length, OF_EDGE_M), OF_EDGE_M))
        moved = shapely.transform(at, lambda points: points - np.array(shift))
        return float((shapely.intersects(source.near_walls, moved) | shapely.dwithin(at, ways, OF_EDGE_M)).mean())

    return float(source.computed.get_or_make((shapely.set_precision(there, _TOUCH_M).wkb, ways.wkb), share))


def _bays(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R13."""
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
        yield Question(_key(plan, "bay", at), at, f"{says}Is it of the room?", answers, _UNSEEN, area, area**0.5)


@lru_cache(maxsize=256)
def _narrow_bays(room: bytes) -> list[tuple[float, LineString, Point, LineString]]:
    """Return the bays of a room (WKB): the area of each, its narrow place, a point in it, and the rest of its edge."""
    shape, half, found = shapely.from_wkb(room), _BAY_NECK_M / 2, []
    wide = max(shapely.get_parts(shapely.buffer(shape, -half)), key=lambda part: part.area, default=shape)
    main = shapely.buffer(wide, half + _TOUCH_M)
    for bay in shapely.get_parts(shapely.difference(shape, main)):
        if not SMALLEST_ROOM_M2 <= bay.area <= shape.area / 2:
            continue
        neck = shapely.intersection(bay.boundary, shapely.buffer(main, _TOUCH_M))
        ends = shapely.get_coordinates(neck)
        apart = np.hypot(*(ends[:, None] - ends[None]).transpose(2, 0, 1))
        line = LineString(ends[list(np.unravel_index(int(apart.argmax()), apart.shape))])
        edge = shapely.difference(bay.boundary, shapely.buffer(neck, OF_EDGE_M))
        if OF_EDGE_M <= line.length <= edge.length:
            found.append((bay.area, line, bay.representative_point(), edge))
    return found


def _free_walls(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R13."""
    if not source.is_map:
        return
    moved = np.subtract(shift, source.origin)
    found: list[tuple[float, LineString, list[LineString], float]] = []
    for line in shapely.linestrings(np.add(source.level.seen, moved)) if source.level.seen else []:
        for room in plan.rooms:
            whole = Polygon(room.polygon.exterior)
            stands = [hole for ring in room.polygon.interiors if (hole := Polygon(ring)).intersects(line)]
            if not stands or shapely.intersection(line, whole).length < _FREE * line.length:
                continue
            (reach,) = shapely.get_parts(shapely.union_all(stands).convex_hull)
            through = shapely.intersection(_longer(line, whole.length), whole)
            across = [part for part in shapely.get_parts(through) if part.intersects(reach)]
            gaps = [part for each in across for part in shapely.get_parts(shapely.difference(each, reach))]
            gaps = [part for part in gaps if isinstance(part, LineString) and part.length > _TOUCH_M]
            area = _parted_m2(whole, _longer(line, whole.length))
            if len(gaps) != 2 or min(gap.length for gap in gaps) < _PASSAGE_M[0] or area < SMALLEST_ROOM_M2 * 2:
                continue
            if max(gap.length for gap in gaps) <= max(math.sqrt(area), _PASSAGE_M[1]):
                found.append((line.length, line, gaps, area))
    for length, line, gaps, area in sorted(found, key=lambda each: (-each[0], each[1].bounds))[:_MOST_WALLS_ASKED]:
        ends = [tuple(map(tuple, shapely.get_coordinates(gap).round(3).tolist())) for gap in gaps]
        at = tuple(np.mean(line.coords, axis=0).round(3).tolist())
        says = f"A wall of {length:.2f} m stands free here. Does it part two rooms, with an opening at each end?"
        answers = Answer("Two rooms", "opening", ends[0], more=(ends[1],)), Answer("One room")
        yield Question(_key(plan, "free", at), at, says, answers, _CORNER, area, area**0.5)


def _parted(plan: FloorPlan, places: Sequence[tuple[str, LineString]]) -> Iterator[Question]:
    """R3."""
    shown = [line for kind, line in places if kind in {"door", "lintel"}]
    between: dict[tuple[int, int], list[Door]] = {}
    for door in plan.doors:
        one, other = door.rooms
        if one is not None and other is not None and all(line.distance(door.polygon) > _TOUCH_M for line in shown):
            between.setdefault((min(one, other), max(one, other)), []).append(door)
    asked: list[Question] = []
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
        at = _middle(widest)
        says = f"Are {_names((first, second))} one room? {why}."
        joined = Answer("One room", "one_room", (_inside(first), _inside(second)))
        answers = joined, Answer("Two rooms"), *(_only(door, doors) for door in doors if 1 < len(doors) <= _MOST_WAYS)
        asked.append(Question(_key(plan, "parted", at), at, says, answers, doubt, min(first.area, second.area)))
    yield from sorted(asked, key=lambda each: (-each.doubt, -each.area, each.key))[:_MOST_NARROW]


def _only(door: Door, doors: Sequence[Door]) -> Answer:
    """Return the answer that one of several passages between two rooms is the only one."""
    others = [(_middle(other),) for other in doors if other is not door]
    return Answer(f"Two rooms, and only the way of {door.width:.2f} m", "no_door", others[0], more=tuple(others[1:]))


def _facing_m(one: Room, other: Room, door: Door) -> float:
    """Return the length of the edge at which two rooms face each other across a wall, including the door in it."""
    near = max(door.polygon.area / max(door.width, _TOUCH_M), _FACING_M)
    edges = [(one.polygon.boundary, other.polygon), (other.polygon.boundary, one.polygon)]
    return float(
        min(shapely.intersection(edge, shapely.buffer(room, near, quad_segs=1)).length for edge, room in edges)
    )


def with_effect(
    plan: FloorPlan, asked: list[Question], said: Sequence[Correction] = (), source: SourceView | None = None
) -> list[Question]:
    """Return questions without the leading questions of each kind whose first answer has no effect (R5, R6).

    ``said`` are the corrections that made ``plan`` from the plan of its ``source``: an answer must not contradict them.
    Only the questions up to the first one with an effect are tried, since an answer changes the effects of the others.
    """
    kept: list[Question] = []
    tried: set[tuple[str, ...]] = set()
    trial: Trial | None = None
    for question in asked:
        is_place = question.key.startswith(("place", "corner", "wall", "larger", "front", "bay", "free"))
        is_tried = question.group in tried and not question.key.startswith("front")  # one front says nothing of others
        if is_place and not is_tried:
            trial = trial or _trial(plan, said, source)
            if not _parts_or_joins(plan, question, trial):
                continue
        tried.add(question.group)
        kept.append(question)
    return kept


def _trial(plan: FloorPlan, said: Sequence[Correction], source: SourceView | None) -> Trial:
    if source is None or source.plan is None:
        return Trial(plan)
    return Trial(source.plan, said, source.spaces, source.standing, walls=source.walls, lines=source.lines)


def _parts_or_joins(plan: FloorPlan, question: Question, trial: Trial) -> bool:
    answer = question.answers[0]
    frame: Any = plan.frame
    places = [source_points_from_plan(frame, each).round(3).tolist() for each in (answer.points, *answer.more)]
    try:
        values = checked_values(answer.action, places)  # type: ignore[arg-type]  # places and corners have words
        new = [Correction(answer.action, value) for value in values]  # type: ignore[arg-type]
        outcomes, rooms = trial.outcomes(new)
    except (ConfigError, GEOSException):  # R11
        return False
    return set(outcomes) == {"done"} and (rooms > len(plan.rooms) or not question.key.startswith(("corner", "free")))


def _guesses(plan: FloorPlan, source: SourceView) -> Iterator[Question]:
    """R7."""
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


def _floors(plan: FloorPlan, source: SourceView) -> Iterator[Question]:
    """R7."""
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
    return [shapely.transform(space.shape, lambda points: points + np.array(shift)) for space in source.spaces]


class _Taken:
    """What takes the ground of a plan: its rooms and its passages."""

    def __init__(self, plan: FloorPlan) -> None:
        self.parts = [*(room.polygon for room in plan.rooms), *(door.polygon for door in plan.doors)]
        self._tree, self._rooms = shapely.STRtree(self.parts), len(plan.rooms)

    def near(self, shape: Polygon, but: int = -1, *, rooms_only: bool = False) -> shapely.Geometry:
        """Return what lies at a shape, without the room of this number."""
        found = sorted(self._tree.query(shape, predicate="intersects").tolist())
        return shapely.union_all([self.parts[k] for k in found if k != but and (k < self._rooms or not rooms_only)])


def _spaces_left_out(
    plan: FloorPlan, source: SourceView, shift: tuple[float, float], closed: Sequence[tuple[float, float]]
) -> Iterator[Question]:
    """R5."""
    taken = _Taken(plan)
    asked: list[Polygon] = []
    enclosed = shapely.transform(source.enclosed, lambda points: points + np.array(shift)).tolist()
    reachable = [*(space.reachable for space in source.spaces), *(False for _ in enclosed)]
    for shape, is_reachable in zip((*_moved_spaces(source, shift), *enclosed), reachable, strict=True):
        if shape.area < SMALLEST_ROOM_M2:
            continue
        others = [other for other in asked if other.intersects(shape)]
        free = shapely.difference(shape, shapely.union_all([taken.near(shape), *others]))
        if free.area < SMALLEST_ROOM_M2 or free.area < _FREE * shape.area:
            continue
        if any(shapely.contains_xy(shape, *place) for place in closed):
            continue
        asked.append(shape)
        point = shape.representative_point()
        at = round(point.x, 3), round(point.y, 3)
        why = "nothing leads into it" if not is_reachable else "it was taken for no room"
        says = f"This space of {shape.area:.1f} m² between walls was left out: {why}. Is it a room?"
        answers = Answer("A room", "room", (at,)), Answer("No room")
        yield Question(_key(plan, "space", at), at, says, answers, _LEFT_OUT, shape.area, shape.area**0.5)


def _larger(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R5."""
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
            if shape.intersection(room.polygon).area < _FREE * room.area:
                continue
            if shape.intersection(taken.near(shape, but=k)).area > more / 2:
                continue
            ring = shapely.simplify(shapely.Polygon(shape.exterior), OF_EDGE_M / 3).exterior
            corners = tuple((round(x, 3), round(y, 3)) for x, y in ring.coords[:-1])
            if len(corners) > MOST_POINTS:
                continue
            at = _inside(room)
            says = f"The walls here enclose {shape.area:.1f} m², and this {_name(room)} has {room.area:.1f} m². "
            says += "Is all of it this room?"
            answers = Answer("All of it", "room_outline", corners), Answer("A part of it")
            yield Question(_key(plan, "larger", at), at, says, answers, _LARGER, room.area)
            break


def _places(
    plan: FloorPlan, places: Sequence[tuple[str, LineString]], closed: Sequence[tuple[float, float]]
) -> Iterator[Question]:
    """R5."""
    shut = shapely.multipoints(closed) if closed else None
    rooms = [room.polygon for room in plan.rooms]
    for kind, line in _free_places(plan, places):
        (ax, ay), (bx, by) = line.coords
        way = np.array([ay - by, bx - ax]) / line.length * _WIDEST_WALL_M
        sides = [
            next((k for k, room in enumerate(rooms) if shapely.contains_xy(room, *at)), None)
            for at in (np.array([ax + bx, ay + by]) / 2 + sign * way for sign in (1, -1))
        ]
        if sides[0] == sides[1]:
            continue
        if shut is not None and shut.distance(line) < _WIDEST_WALL_M:
            continue
        at = round((ax + bx) / 2, 3), round((ay + by) / 2, 3)
        word = "entrance" if None in sides else "door"
        shows = {"lintel": "a lintel hangs", "gap": "the walls leave a gap"}.get(kind, f"the source names {_a(kind)}")
        says = f"{shows.capitalize()} here, {line.length:.2f} m wide, and the plan has no way. Is there {_a(word)}?"
        jambs = (ax, ay), (bx, by)
        answers = [Answer(_a(word).capitalize(), word, jambs), Answer("None")]
        if word == "door":
            answers.append(Answer("An opening", "opening", jambs))
        yield Question(_key(plan, "place", at), at, says, tuple(answers), _SHOWN[kind], size=line.length)


def _fronts(
    plan: FloorPlan, source: SourceView, places: Sequence[tuple[str, LineString]], shift: tuple[float, float]
) -> Iterator[Question]:
    """R12."""
    if source.is_map or not source.walls:
        return

    def beyond(line: LineString) -> shapely.Geometry:
        """Return the part of a line that lies away from all walls."""
        there = shapely.transform(line, lambda points: points - np.array(shift))
        key = shapely.set_precision(there, _TOUCH_M).wkb
        free = source.computed.get_or_make(key, lambda: shapely.difference(there, source.near_walls))
        return shapely.transform(free, lambda points: points + np.array(shift))

    def in_walls(line: LineString) -> float:
        there = shapely.transform(line, lambda points: points - np.array(shift))
        return float(shapely.intersection(there, source.all_walls).length)

    ways = shapely.points(np.reshape([_middle(door) for door in plan.doors], (-1, 2)))
    lines = [line for kind, line in places if kind in _FRONTS and line.length > _PASSAGE_M[1]]
    narrow = [line for kind, line in places if kind in _SHOWN and line.length <= _PASSAGE_M[1]]
    for room in plan.rooms:
        edge = shapely.simplify(room.polygon, OF_EDGE_M / 3).exterior.coords
        for side in pairwise(edge):
            if math.dist(*side) >= _FRONT_M[0]:
                lines += shapely.get_parts(beyond(LineString(side))).tolist()
    found: list[tuple[Room, LineString]] = []
    for line in lines:
        if not _FRONT_M[0] <= line.length <= _FRONT_M[1] or in_walls(line) > line.length / 2:
            continue
        (ax, ay), (bx, by) = line.coords
        way = np.array([ay - by, bx - ax]) / line.length * _WIDEST_WALL_M
        sides = shapely.points([np.array([ax + bx, ay + by]) / 2 + sign * way for sign in (1, -1)])
        beside = [(room, shapely.intersects(room.polygon, sides)) for room in plan.rooms]
        beside = [each for each in beside if each[1].any()]
        if len(beside) != 1 or beside[0][1].all() or shapely.dwithin(ways, line, _WIDEST_WALL_M).any():
            continue
        (room, _) = beside[0]
        if shapely.intersection(line, shapely.buffer(room.polygon, _WIDEST_WALL_M)).length >= _FREE * line.length:
            found.append((room, line))
    chosen: list[LineString] = []
    for room, line in sorted(found, key=lambda each: (-each[0].area, -each[1].length, each[1].bounds)):
        is_asked = any(line.distance(other) < _WIDEST_WALL_M for other in chosen) or any(
            line.distance(each.centroid) < _WIDEST_WALL_M and each.length > line.length / 2 for each in narrow
        )
        if is_asked or len(chosen) == _MOST_FRONTS:
            continue
        chosen.append(line)
        (ax, ay), (bx, by) = shapely.get_coordinates(line).round(3).tolist()
        at = round((ax + bx) / 2, 3), round((ay + by) / 2, 3)
        says = f"No wall is seen here, {line.length:.2f} m wide. Is it open to the outside: does one walk in?"
        answers = Answer("An entrance", "entrance", ((ax, ay), (bx, by))), Answer("A wall or a window")
        yield Question(_key(plan, "front", at), at, says, answers, _FRONT, room.area, room.area**0.5)


def _corners(plan: FloorPlan, places: Sequence[LineString] = (), several: Set[str] = frozenset()) -> Iterator[Question]:
    """R6. ``places`` are places in a room where the source shows a door or a gap; ``several``: see ``questions``."""
    narrow: list[tuple[bool, float, float, LineString]] = []
    wide: list[tuple[bool, float, float, LineString]] = []
    known: list[tuple[bool, float, float, LineString]] = []
    for room in plan.rooms:
        is_several = not several.isdisjoint(_key(plan, kind, _inside(room)) for kind in ("room", "seen"))
        doors = shapely.union_all([door.polygon for door in plan.doors if room.id in door.rooms])
        at_doors = shapely.buffer(doors, _PASSAGE_M[0] / 2)
        shown = [place for place in places if room.polygon.covers(place.centroid)]
        parting = [(ray, _parted_m2(room.polygon, _longer(ray, ONWARD_M))) for ray in shown]
        rays = _parting_rays(room.polygon.wkb)
        jambs = {_ends(ray) for ray, _ in rays} & {_ends(shapely.reverse(ray)) for ray, _ in rays}
        for ray, area in (*parting, *rays):
            if ray.length < _PASSAGE_M[0] or area < SMALLEST_ROOM_M2 * 2:
                continue
            at_door = shapely.intersection(ray, at_doors).length
            if at_door > (ray.length / 2 if _ends(ray) in jambs else 0):  # beside a doorway another door may lie
                continue
            is_bare = ray not in shown and _ends(ray) not in jambs
            if is_several:
                known.append((is_bare, ray.length, area, ray))
            elif ray.length <= _PASSAGE_M[1]:
                narrow.append((is_bare, ray.length, area, ray))
            elif ray.length**2 <= area:
                wide.append((is_bare, ray.length / math.sqrt(area), area, ray))
    chosen: list[tuple[float, float, LineString]] = []
    most = _MOST_CORNERS
    for found, doubt, more in ((known, _CUT, _MOST_OF_SEVERAL), (narrow, _CORNER, 0), (wide, _CORNER / 2, _MOST_WIDE)):
        most += min(more, len(found))
        for _, _, area, ray in sorted(found, key=lambda each: each[:2]):
            if all(ray.distance(other) > _PASSAGE_M[0] / 2 for *_, other in chosen) and len(chosen) < most:
                chosen.append((doubt, area, ray))
    for doubt, area, ray in chosen:
        (ax, ay), (bx, by) = (tuple(round(v, 3) for v in end) for end in ray.coords)
        at = round((ax + bx) / 2, 3), round((ay + by) / 2, 3)
        says = f"The room is narrower here, {ray.length:.2f} m. Is there an opening between two rooms?"
        ends = (ax, ay), (bx, by)
        answers = Answer("An opening", "opening", ends), Answer("One room"), Answer("A wall", "wall", ends)
        yield Question(_key(plan, "corner", at), at, says, answers, doubt, area)


def _walls_seen(
    plan: FloorPlan, source: SourceView, shift: tuple[float, float], closed: Sequence[tuple[float, float]]
) -> Iterator[Question]:
    """R10."""
    shut = shapely.multipoints(closed) if closed else None
    found: list[tuple[float, list[LineString]]] = []
    lines = (
        shapely.linestrings(np.add(source.level.seen, np.subtract(shift, source.origin))) if source.level.seen else []
    )
    tree = shapely.STRtree(lines)
    for room in plan.rooms:
        inside = shapely.buffer(room.polygon, -OF_EDGE_M)
        near = [lines[k] for k in sorted(tree.query(room.polygon, predicate="intersects").tolist())]
        parts = [
            part
            for part in shapely.get_parts(shapely.intersection(near, room.polygon)).tolist()
            if isinstance(part, LineString) and shapely.intersection(part, inside).length >= _SHORTEST_WALL_M
        ]
        for row in _in_rows(parts):
            if shut is not None and any(shut.distance(line) < OF_EDGE_M for line in row):
                continue
            whole = LineString([row[0].coords[0], row[-1].coords[-1]])
            if (area := _parted_m2(room.polygon, _longer(whole, _PASSAGE_M[1]))) >= SMALLEST_ROOM_M2 * 2:
                found.append((area, row))
    for area, row in sorted(found, key=lambda each: (-each[0], each[1][0].bounds))[:_MOST_WALLS_ASKED]:
        pieces = [tuple(map(tuple, shapely.get_coordinates(line)[[0, -1]].round(3).tolist())) for line in row]
        ends = pieces[0][0], pieces[-1][-1]
        at = round((ends[0][0] + ends[1][0]) / 2, 3), round((ends[0][1] + ends[1][1]) / 2, 3)
        long, what = sum(line.length for line in row), "it one" if len(row) == 1 else f"it a wall of {len(row)} pieces"
        shown = (
            f"map shows an obstacle of {long:.2f} m"
            if source.is_map
            else f"source shows {long:.2f} m of something higher than a person"
        )
        says = f"The {shown}, the plan no wall. Is {what}?"
        wall = Answer("A wall", "wall", pieces[0], more=tuple(pieces[1:]))
        yield Question(
            _key(plan, "wall", at), at, says, (wall, Answer("No wall"), Answer("An opening", "opening", ends)),
            _SEEN_WALL, area,
        )  # fmt: skip


def _in_rows(lines: Sequence[LineString]) -> list[list[LineString]]:
    """Return lines by rows: those of one row go on with each other, from the first to the last, after gaps."""
    rows: list[list[LineString]] = []
    for line in sorted(lines, key=lambda each: (-each.length, each.bounds)):
        for row in rows:
            a, d = np.array(row[0].coords[0]), np.array(row[-1].coords[-1])
            way = (d - a) / math.dist(a, d)
            at = (np.array(line.coords)[[0, -1]] - a) @ way
            aside = np.abs((np.array(line.coords)[[0, -1]] - a) @ np.array([-way[1], way[0]]))
            low, high = at.min(), at.max()
            if aside.max() > OF_EDGE_M or not (-_PASSAGE_M[1] <= high and low <= math.dist(a, d) + _PASSAGE_M[1]):
                continue
            onward = line if at[1] >= at[0] else shapely.reverse(line)
            if high <= 0:
                row.insert(0, onward)
            elif low >= math.dist(a, d):
                row.append(onward)
            else:
                continue
            break
        else:
            rows.append([line])
    return rows


@lru_cache(maxsize=256)
def _parting_rays(room: bytes) -> list[tuple[LineString, float]]:
    """Return the ``corner_rays`` of a room (WKB), and the area that each parts off, m2; an answer changes few rooms."""
    shape = shapely.from_wkb(room)
    longest = max(_PASSAGE_M[1], math.sqrt(shape.area / 2))
    rays = [ray for ray in corner_rays(shape) if _PASSAGE_M[0] <= ray.length <= longest]
    return [(ray, _parted_m2(shape, _longer(ray, _TOUCH_M))) for ray in rays]


def _ends(ray: LineString) -> tuple[float, ...]:
    """Return the ends of a line to a centimetre."""
    return tuple((shapely.get_coordinates(ray).round(2) + 0.0).ravel().tolist())


def _parted_m2(room: Polygon, line: LineString) -> float:
    """Return the area of the second largest part into which a line parts a room, 0 if it does not."""
    return float(sorted([0.0, *(part.area for part in split(room, line).geoms)])[-2])


def corner_rays(room: Polygon) -> list[LineString]:
    """Return the extensions of both edges of each corner that juts into a room, from the corner to the next wall."""
    found = []
    x1, y1, x2, y2 = room.bounds
    far = x2 - x1 + y2 - y1
    for ring in (shapely.orient_polygons(room).exterior, *shapely.orient_polygons(room).interiors):
        points = np.array(ring.coords[:-1])
        before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        for k in np.flatnonzero(turn < -_TOUCH_M * _TOUCH_M):  # orientation: the room lies to the left of its edges
            for along in (before[k], -after[k]):
                way = along / max(float(np.hypot(*along)), _TOUCH_M)
                start = points[k] + way * _TOUCH_M
                line = LineString([start, points[k] + way * far])
                inside = shapely.intersection(line, room)
                first = min(shapely.get_parts(inside), key=lambda part: part.distance(Point(start)), default=None)
                if first is not None and first.length > _TOUCH_M and first.distance(Point(start)) < _TOUCH_M:
                    end = max(first.coords, key=lambda at: float(np.hypot(*(np.array(at) - points[k]))))
                    found.append(LineString([points[k], end]))
    return found


def _longer(ray: LineString, by_m: float) -> LineString:
    """Return a line longer by so much at both ends, so that it parts the room."""
    a, b = np.array(ray.coords)
    way = (b - a) / ray.length * by_m
    return LineString([a - way, b + way])


def _a(word: str) -> str:
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"


def _doubt(confidence: float | None) -> float | None:
    return None if confidence is None or confidence >= ASKED_BELOW else round(1 - confidence, 3)  # R2


def _name(room: Room) -> str:
    return "space" if room.label == "Unlabelled" else room.label.lower().replace("_", " ")


def _names(rooms: Sequence[Room]) -> str:
    """Return rooms with their areas in words."""
    if len(rooms) > 1 and {_name(room) for room in rooms} == {"space"}:
        return f"the spaces of {' and '.join(f'{room.area:.1f} m²' for room in rooms)}"
    return " and ".join(f"the {_name(room)} of {room.area:.1f} m²" for room in rooms)


def _inside(room: Room) -> tuple[float, float]:
    point = room.polygon.representative_point()
    return round(point.x, 3), round(point.y, 3)


def _middle(door: Door) -> tuple[float, float]:
    (ax, ay), (bx, by) = door.segment
    return round((ax + bx) / 2, 3), round((ay + by) / 2, 3)


def _key(plan: FloorPlan, kind: str, at: Sequence[float]) -> str:
    """Return a key that survives a rebuild of the plan: the kind, and the place in the source to 0.1 m."""
    frame: Any = plan.frame
    x, y = source_points_from_plan(frame, [at])[0].round(1).tolist()
    return f"{kind} at {x + 0.0:.1f}, {y + 0.0:.1f}"
