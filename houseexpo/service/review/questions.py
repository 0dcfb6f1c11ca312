"""Ask a person about the doubtful places of a plan: one sentence, two opposite answers, the most valuable first.

The rules for what is asked are in ``plan_questions``, ``source_questions`` and ``line_questions``. The rules here say
which of these questions remain, and in which order.

R1  A question that a person has answered or skipped is not asked again. Answers are words of the storey, as if drawn.
    A line that would part what a person has said to be one room, or has outlined, is not asked about, nor one in whose
    place such a question was answered, nor what the source shows along a line where a person has said no wall, nor a
    front along an edge that a person has drawn.
R2  An answer's value is the question's doubt times (``_LEAST`` + the share of the plan's area that it concerns).
    Questions of one kind about parts of a similar size are grouped, as one answer is often true of all of them. The
    group with the most valuable question comes first, after the questions about the file: all else depends on these.
R3  A shape whose ring crosses itself counts as its largest part. A rule that meets a fault of geometry asks no further
    questions; those of the other rules stay.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence, Set
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

import msgspec
import numpy as np
import shapely
from shapely import GEOSException, LineString, MultiLineString, Polygon
from shapely.ops import split

from houseexpo.corrections import Correction
from houseexpo.corrections.apply import Trial
from houseexpo.corrections.draft import largest_valid_part
from houseexpo.corrections.vocabulary import WORDS, checked_values
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.service.review.line_questions import (
    corner_questions,
    longer,
    part_questions,
    parted_m2,
    seen_wall_questions,
)
from houseexpo.service.review.plan_questions import (
    meeting_questions,
    parted_questions,
    passage_questions,
    room_questions,
)
from houseexpo.service.review.question import PASSAGE_M, SHOWN, Answer, Question, place_of
from houseexpo.service.review.source_questions import (
    bay_questions,
    floor_questions,
    front_questions,
    guess_questions,
    larger_questions,
    left_out_questions,
    place_questions,
    seen_in_part_questions,
)
from houseexpo.service.review.sources import OF_EDGE_M, SourceView
from houseexpo.tolerances import SMALLEST_ROOM_M2

Places = Sequence[tuple[float, float]]
_LIKE: Final = 1.2
"""Parts whose sizes in metres differ by a smaller factor look alike."""
_LEAST: Final = 0.25
"""The value of a passage itself: as if it concerned a quarter of the plan."""
_DENIED: Final = frozenset({"no_door", "window", "no_room", "outside"})
"""Words that deny a part at a place: questions about this place are not asked again."""
_PARTING: Final = ("corner", "wall", "bay")
"""Questions about lines that may part a room."""


def questions(
    plan: FloorPlan,
    left: Collection[str] = (),
    source: SourceView | None = None,
    said: Sequence[tuple[str, Places]] = (),
    several: Set[str] = frozenset(),
) -> list[Question]:
    """Return the questions about a plan, the most valuable first (R1 to R3).

    ``left`` are the keys of skipped questions. ``said`` are words of the storey with their points (x, y) in the plan,
    metres. ``several`` are the keys of questions about rooms that were answered by ``SEVERAL``.
    """
    if plan.frame is None:
        return []
    plan, places = _mended(plan), list[tuple[str, LineString]]()
    closed = [points[0] for word, points in said if word in _DENIED]
    rules = [room_questions(plan), meeting_questions(plan)]
    if source is not None and source.plan is not None:
        dx, dy = np.subtract(source.origin, source.origin_of(plan)).round(3).tolist()
        places = [(kind, LineString(np.add(ends, (dx, dy)).round(3))) for kind, ends in source.places]
        rules += [
            guess_questions(plan, source),
            floor_questions(plan, source),
            parted_questions(plan, places),
            seen_in_part_questions(plan, source, (dx, dy)),
            left_out_questions(plan, source, places, (dx, dy), closed),
            larger_questions(plan, source, (dx, dy)),
            place_questions(plan, source, places, (dx, dy), closed),
            front_questions(plan, source, places, (dx, dy)),
            seen_wall_questions(plan, source, (dx, dy), closed),
            bay_questions(plan, source, (dx, dy)),
        ]
    rules.append(passage_questions(plan, places, closed))
    rules.append(part_questions(plan, several))
    rules.append(corner_questions(plan, [line for kind, line in places if kind in SHOWN], several))
    found = [each for rule in rules for each in _without_fault(rule)]
    bays = [LineString(each.answers[0].points) for each in found if each.key.startswith("bay")]
    found = [each for each in found if not each.key.startswith("corner") or not _is_at(each, bays)]
    found = [each for each in found if each.key not in left and not _is_told(plan, each, left, said)]
    return _in_order(found, plan.area)


def _is_told(plan: FloorPlan, asked: Question, left: Collection[str], said: Sequence[tuple[str, Places]]) -> bool:
    """R1."""
    if asked.key.startswith("front"):
        line = LineString(asked.answers[0].points)
        drawn = [LineString([*points, points[0]]) for word, points in said if word == "room_outline"]
        return any(edge.buffer(OF_EDGE_M).covers(line) for edge in drawn)
    if not asked.key.startswith(_PARTING):
        return False
    frame: Any = plan.frame
    there = source_points_from_plan(frame, [asked.at])[0]
    beside_m = OF_EDGE_M
    if asked.key.startswith("corner") and len(asked.answers[0].points) == 2:  # a line beside it parts the same
        beside_m = max(OF_EDGE_M, math.dist(*asked.answers[0].points) / 2)
    if any(math.dist(there, place_of(key)) < beside_m for key in left if key.startswith(_PARTING)):
        return True
    pieces = [LineString(points) for points in (asked.answers[0].points, *asked.answers[0].more)]
    gone = [LineString(points) for word, points in said if word == "no_wall"]
    is_wall = asked.key.startswith("wall")
    if is_wall and gone:
        taken = shapely.intersection(shapely.multilinestrings(pieces), shapely.union_all(gone).buffer(OF_EDGE_M))
        if taken.length >= sum(piece.length for piece in pieces) / 2:
            return True
    if is_wall:  # a row of pieces
        pieces = [LineString([pieces[0].coords[0], pieces[-1].coords[-1]])]
    whole = MultiLineString([longer(piece, PASSAGE_M[1] if is_wall else OF_EDGE_M) for piece in pieces])
    return any(_parts(plan, word, points, whole) for word, points in said)


def _parts(plan: FloorPlan, word: str, points: Places, line: shapely.Geometry) -> bool:
    """Return whether a line parts a room that a person has said to be one, or has outlined (R1)."""
    if word == "room_outline":
        outline = Polygon(points)
        return outline.is_valid and parted_m2(outline, line) >= SMALLEST_ROOM_M2
    if word != "one_room":
        return False
    xs, ys = np.transpose(points)
    rooms = [room.polygon for room in plan.rooms if shapely.contains_xy(room.polygon, xs, ys).all()]
    if not rooms:
        return False
    return bool(sum(shapely.contains_xy(part, xs, ys).any() for part in split(rooms[0], line).geoms) > 1)


def _is_at(question: Question, lines: Sequence[LineString]) -> bool:
    """Return whether a question's line is one of those."""
    line = LineString(question.answers[0].points)
    return any(line.distance(other) < OF_EDGE_M for other in lines)


def _mended(plan: FloorPlan) -> FloorPlan:
    """R3."""

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
    """R3."""
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
    """R2."""
    asked = _grouped(asked)
    worth = {each.key: each.doubt * (_LEAST + min(each.area / area, 1.0)) for each in asked}
    best: dict[tuple[str, ...], float] = {}
    for each in asked:
        best[each.group] = max(best.get(each.group, 0.0), worth[each.key])
    return sorted(asked, key=lambda each: (each.doubt < 1.0, -best[each.group], each.group, -worth[each.key], each.key))


def _grouped(asked: Sequence[Question]) -> list[Question]:
    """R2."""
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


def with_effect(
    plan: FloorPlan, asked: list[Question], said: Sequence[Correction] = (), source: SourceView | None = None
) -> list[Question]:
    """Return questions without the leading questions of each kind whose first answer has no effect.

    ``said`` are the corrections that made ``plan`` from the plan of its ``source``: an answer must not contradict them.
    Only the questions up to the first one with an effect are tried, since an answer changes the effects of the others.
    """
    kept: list[Question] = []
    tried: set[tuple[str, ...]] = set()
    trial: Trial | None = None
    for question in asked:
        is_place = question.key.startswith(("place", "corner", "wall", "larger", "front", "bay"))
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


def _correction(frame: Any, word: str, points: Places) -> Correction:
    """Return an answer's word, from points in plan metres."""
    there = source_points_from_plan(frame, points).round(3).tolist()
    (value,) = checked_values(word, [there if WORDS[word].depth == 2 else there[0]])  # type: ignore[arg-type, index]
    return Correction(word, value)  # type: ignore[arg-type]  # places and corners have words


def _parts_or_joins(plan: FloorPlan, question: Question, trial: Trial) -> bool:
    answer, frame = question.answers[0], plan.frame
    words = [(answer.action, points) for points in (answer.points, *answer.more)]
    words += [(further.action, further.points) for further in answer.then]
    try:
        new = [_correction(frame, word, points) for word, points in words]
        outcomes, rooms = trial.outcomes(new)
    except (ConfigError, GEOSException):  # R3
        return False
    return set(outcomes) == {"done"} and (rooms > len(plan.rooms) or not question.key.startswith("corner"))
