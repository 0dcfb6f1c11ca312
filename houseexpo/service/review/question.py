"""What a question of a review is, and what its rules share: the words for parts, keys, doubt, and widths in metres.

R1  The answers to a question are all that is usually true of such a place, the two most usual first. Questions of one
    kind have them in one order: a reviewer gives them by heart.
R2  A part that is rated below ``ASKED_BELOW`` is doubtful. Its doubt is what its confidence lacks of 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta

from houseexpo.corrections.vocabulary import Word
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Door, Room

ASKED_BELOW: Final = 0.9
"""Confidence. In marked plans that are not right, 26 of 244 rooms and 18 of 33 doors and openings rated 0.7 to 0.9 are
wrong; of those above, 12 of 373 and none of 435."""
CUT: Final = 0.95
"""Doubt of a cut: its place is a guess."""
SHOWN: Final = {"door": 0.3, "opening": 0.3, "lintel": 0.25, "gap": 0.2}
"""Doubt of a place without a passage, by the kind of evidence in the source. Of 14 groups, no mark wants any."""
NAMED: Final = frozenset({"door", "opening"})
"""Kinds that the source names: these are asked about also where something stands in them, as a closed gate."""
FREE: Final = 0.8
"""A left-out space has at least this share of its area outside all rooms."""
WIDEST_WALL_M: Final = 0.6
"""A place in a wall of a room is at most this far from the room, metres: half of the thickest wall."""
PASSAGE_M: Final = (0.6, 2.5)
"""The least and the greatest width of an opening, metres."""
MOST_POINTS: Final = 400
"""The most points of an outline, or rooms to merge."""
SEVERAL: Final = "Several rooms"
"""The answer after which the places are asked about at which the room may part."""


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


def none_of(at: tuple[float, float]) -> tuple[Answer, Answer]:
    """Return the answers that a part is no room."""
    return Answer("No room", "no_room", (at,)), Answer("Outside", "outside", (at,))


def an(word: str) -> str:
    """Return a word with its article."""
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"


def doubt_of(confidence: float | None) -> float | None:
    """Return the doubt of a part of this confidence, None if it is not doubtful (R2)."""
    return None if confidence is None or confidence >= ASKED_BELOW else round(1 - confidence, 3)


def name_of(room: Room) -> str:
    """Return the word for a room."""
    return "space" if room.label == "Unlabelled" else room.label.lower().replace("_", " ")


def names_of(rooms: Sequence[Room]) -> str:
    """Return rooms with their areas in words."""
    if len(rooms) > 1 and {name_of(room) for room in rooms} == {"space"}:
        return f"the spaces of {' and '.join(f'{room.area:.1f} m²' for room in rooms)}"
    return " and ".join(f"the {name_of(room)} of {room.area:.1f} m²" for room in rooms)


def point_in(room: Room) -> tuple[float, float]:
    """Return a point in a room, metres."""
    point = room.polygon.representative_point()
    return round(point.x, 3), round(point.y, 3)


def middle_of(door: Door) -> tuple[float, float]:
    """Return the middle of a passage, metres."""
    (ax, ay), (bx, by) = door.segment
    return round((ax + bx) / 2, 3), round((ay + by) / 2, 3)


def key_of(plan: FloorPlan, kind: str, at: Sequence[float]) -> str:
    """Return a key that survives a rebuild of the plan: the kind, and the place in the source to 0.1 m."""
    frame: Any = plan.frame
    x, y = source_points_from_plan(frame, [at])[0].round(1).tolist()
    return f"{kind} at {x + 0.0:.1f}, {y + 0.0:.1f}"


def place_of(key: str) -> tuple[float, float]:
    """Return the place in a question's key (``key_of``)."""
    x, y = key.split(" at ")[1].split(", ")
    return float(x), float(y)
