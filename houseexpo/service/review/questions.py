"""Ask a person about the doubtful places of a plan: one sentence, two contrary answers, the most doubtful place first.

R1  A cut was made since nothing showed a way between two parts of the plan: there is a door, or there is none.
R2  A passage or a room that is rated below ``ASKED_BELOW`` is asked about.
R3  Rooms that meet without a wall are one room, or they stay two; only where nobody has drawn a wall.
R4  What a person has answered or left is not asked again. Answers are words of the storey, as if they had been drawn.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import combinations
from typing import Any, Final

import msgspec
import shapely

from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Door, Room
from houseexpo.service.plan_page import room_names_beside

ASKED_BELOW: Final = 0.7
"""Confidence. Of ten parts rated so, three are wrong: a look at each costs a person less than the search for them."""
_CUT: Final = 0.95
"""Doubt of a cut that is not rated: where it lies is a guess."""
_OPEN: Final = 0.35
"""Doubt of rooms that meet without a wall: most sources that name both mean two."""
_MEETING_M: Final = 1.0
"""Rooms that meet for less have a passage between them, metres."""
_NEAR_M: Final = 0.01
"""Rooms share their edge to the grid of a plan, metres."""


class Answer(msgspec.Struct, frozen=True):
    """An answer: what its button says, and the word that it stands for; no word if the plan is right as it is."""

    title: str
    action: str = "leave"
    points: tuple[tuple[float, float], ...] = ()


class Question(msgspec.Struct, frozen=True):
    """A question about a place ``at`` of a plan, metres; ``key`` names it in the log, ``doubt`` is from 0 to 1."""

    key: str
    at: tuple[float, float]
    says: str
    answers: tuple[Answer, Answer]
    doubt: float


def questions(plan: FloorPlan, left: Collection[str] = ()) -> list[Question]:
    """Return what is to be asked of a plan without the questions that were left, the most doubtful first (R1 to R4)."""
    if plan.frame is None:
        return []
    found = [*_passages(plan), *_rooms(plan), *_meetings(plan)]
    return sorted((each for each in found if each.key not in left), key=lambda each: (-each.doubt, each.key))


def _passages(plan: FloorPlan) -> Iterator[Question]:
    for door in plan.doors:
        doubt = _doubt(door.confidence)
        if door.kind == "cut":  # R1
            doubt = max(doubt or _CUT, _CUT)
        if doubt is None:
            continue
        between, at = room_names_beside(plan, door), _middle(door)
        ends = tuple(door.segment)
        if door.kind == "cut":
            says = f"Nothing shows a way between {between}, so a cut of {door.width:.2f} m was made. Is a door there?"
            answers = Answer("A door", "door", ends), Answer("None", "no_door", (at,))
        elif door.kind == "entrance":
            says = f"Does one walk in here, an entrance of {door.width:.2f} m?"
            answers = Answer("An entrance", "entrance", ends), Answer("A window", "window", (at,))
        else:
            says = f"Is there {'an' if door.kind == 'opening' else 'a'} {door.kind} of {door.width:.2f} m: {between}?"
            answers = Answer("Yes", door.kind, ends), Answer("None", "no_door", (at,))
        yield Question(_key(plan, door.kind, at), at, says, answers, doubt)


def _rooms(plan: FloorPlan) -> Iterator[Question]:
    for room in plan.rooms:
        doubt = _doubt(room.confidence)
        if doubt is not None:
            at = _inside(room)
            says = f"Is this {_name(room)} of {room.area:.1f} m² a room of the house?"
            answers = Answer("A room", "room", (at,)), Answer("No room", "no_room", (at,))
            yield Question(_key(plan, "room", at), at, says, answers, doubt)


def _meetings(plan: FloorPlan) -> Iterator[Question]:
    """R3."""
    joined = {frozenset(door.rooms) for door in plan.doors}
    grown = {room.id: shapely.buffer(room.polygon, _NEAR_M) for room in plan.rooms}
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
        says = f"{_name(one).capitalize()} and {_name(other)} meet without a wall for {edge.length:.1f} m. One room?"
        answers = Answer("One room", "one_room", (_inside(one), _inside(other))), Answer("Two rooms")
        yield Question(_key(plan, "meet", at), at, says, answers, _OPEN)


def _doubt(confidence: float | None) -> float | None:
    return None if confidence is None or confidence >= ASKED_BELOW else round(1 - confidence, 3)  # R2


def _name(room: Room) -> str:
    return "space" if room.label == "Unlabelled" else room.label.lower().replace("_", " ")


def _inside(room: Room) -> tuple[float, float]:
    point = room.polygon.representative_point()
    return round(point.x, 3), round(point.y, 3)


def _middle(door: Door) -> tuple[float, float]:
    (ax, ay), (bx, by) = door.segment
    return round((ax + bx) / 2, 3), round((ay + by) / 2, 3)


def _key(plan: FloorPlan, kind: str, at: Sequence[float]) -> str:
    """Return a name that holds when the plan is built again: the kind, and the place in the source to 0.1 m."""
    frame: Any = plan.frame
    x, y = source_points_from_plan(frame, [at])[0].round(1).tolist()
    return f"{kind} at {x + 0.0:.1f}, {y + 0.0:.1f}"
