"""Define what the page Review asks, and turn it into the values that ``overrides.toml`` stores.

The page speaks in metres of the plan that it shows (``Ground``), the file in metres along the source's plan axes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal, NamedTuple

import msgspec
from msgspec import Meta

from houseexpo.corrections.vocabulary import Word, checked_values
from houseexpo.errors import ConfigError
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Frame
from houseexpo.service.review.question import MOST_POINTS, Further
from houseexpo.service.review.sources import SourceView
from houseexpo.service.review.tools import tools

_OUTSIDE_M: Final = 2.0
"""Points further than this from the plan are refused, metres."""
MILLIMETRE_DIGITS: Final = 3
"""Decimals of stored points: millimetres."""
_CONTROLS: Final = re.compile(r"[\x00-\x1f\x7f]+")
_MOST_LIKE: Final = 1000
"""The most places for one word in one decision."""
_LONGEST_NOTE: Final = 500

Name = Annotated[str, Meta(min_length=1, max_length=60)]
Id = Annotated[str, Meta(min_length=1, max_length=300)]
Point = tuple[float, float]


class DecisionRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A decision; ``points`` are in plan metres, ``seen`` is the number of the last log line that the reviewer saw.

    ``text`` is the text of a note or a drop, the label of a room, or the keys of the skipped questions, one a line.
    ``more`` are the points of further places for the same word, ``then`` are other words; all of them are one decision.
    ``answer`` is the answer that confirms the plan, for "leave"; "" leaves the question. ``question`` is the key of the
    question that the decision answers.
    """

    plan: Id
    action: Literal["keep", "drop", Word, "note", "leave"]
    reviewer: Name
    seen: int = 0
    points: Annotated[list[Point], Meta(max_length=MOST_POINTS)] = []
    text: Annotated[str, Meta(max_length=_MOST_LIKE * 100)] = ""
    more: Annotated[list[Annotated[list[Point], Meta(max_length=MOST_POINTS)]], Meta(max_length=_MOST_LIKE)] = []
    then: Annotated[list[Further], Meta(max_length=_MOST_LIKE)] = []
    answer: Annotated[str, Meta(max_length=100)] = ""
    question: Annotated[str, Meta(max_length=1000)] = ""


class ReplaceRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to move or to remove a correction.

    ``value`` is its value in the table, in the source's axes. ``points`` are the new points in plan metres; an empty
    list removes the correction. ``text`` is the label of a room. ``by``, in place of ``points``, is a factor by which
    its distance from the source's origin grows.
    """

    plan: Id
    word: Word
    value: list[Any]
    reviewer: Name
    seen: int = 0
    points: Annotated[list[Point], Meta(max_length=MOST_POINTS)] = []
    text: Annotated[str, Meta(max_length=500)] = ""
    by: Annotated[float, Meta(gt=0)] | None = None


class FileRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A statement about the whole file of a plan: a key of ``FILE_WORDS`` or ``keep``, and its value; "" removes it.

    ``points`` are the ends of a known distance, in plan metres.
    """

    plan: Id
    key: Literal["up", "units", "scale", "distance", "storey_height", "floors", "drop_nodes", "wall_layers", "keep"]
    reviewer: Name
    value: Annotated[str, Meta(max_length=4000)] = ""
    points: Annotated[list[Point], Meta(max_length=2)] = []


class GapRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A question where a space is open: ``points`` are the ends of a wall, or a point in the space, in plan metres."""

    plan: Id
    points: Annotated[list[Point], Meta(min_length=1, max_length=2)]


class RebuildRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to rebuild; ``confirm`` is the digest of the commands that were shown (``Rebuild.status``)."""

    reviewer: Name
    confirm: Annotated[str, Meta(max_length=64)]


class UndoRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to undo the reviewer's latest decision, or to redo the decision that was undone last.

    With ``plan``, only the latest decision on this plan can be undone.
    """

    reviewer: Name
    plan: Annotated[str, Meta(max_length=300)] = ""


def one_line(text: str) -> str:
    """Return a text as one line without control characters."""
    return _CONTROLS.sub(" ", text).strip()


class Ground(NamedTuple):
    """The place in which a person draws: a plan, or the source of a house without a plan."""

    id: str
    frame: Frame | None
    bbox: tuple[float, float, float, float]
    is_plan: bool = True


def decision_value(asked: DecisionRequest, plan: Ground) -> Any:
    """Return the value of a decision, as ``DecisionStore.decide`` takes it.

    Raises
    ------
    ConfigError
        The number of points is wrong, a point is outside the plan, a line is too short, a label is unknown, or the
        plan has no frame.
    """
    if asked.action == "leave":
        return one_line(asked.text.split("\n")[0])
    if asked.action in {"keep", "drop", "note"}:
        if len(asked.text) > _LONGEST_NOTE:
            raise ConfigError(f"text: expected {_LONGEST_NOTE} characters at most, found {len(asked.text)}")
        return one_line(asked.text)
    return word_value(asked.action, asked.points, asked.text, plan)  # type: ignore[arg-type]  # all others are words


def word_value(word: Word, points: Sequence[Point], text: str, plan: Ground) -> Any:
    """Return the value of a word, in the source's axes, from points in plan metres; see ``decision_value``."""
    tool = TOOLS[word]
    if len(points) < tool.points or (len(points) > tool.points and not tool.more):
        raise ConfigError(f"{word}: expected {tool.points} points, found {len(points)}")
    check_inside(points, plan)
    if plan.frame is None:
        raise ConfigError(
            f"{plan.id}: its position in the source is not recorded, so that only keep and drop are possible"
        )
    there = [_round_point(point) for point in source_points_from_plan(plan.frame, points).tolist()]
    value = [*there[0], one_line(text)] if tool.text else there[0] if tool.points == 1 else there
    checked_values(word, [value])
    return value


def scaled_value(value: Any, by: float) -> Any:
    """Return a correction's value with its coordinates times a factor; a label keeps its text."""
    if isinstance(value, list):
        return [scaled_value(each, by) for each in value]
    return value if isinstance(value, str) else _round_point([value * by])[0]


TOOLS: Final = {tool.word: tool for tool in tools()}
"""The words of a storey as the page offers them."""


def check_inside(points: Sequence[Point], plan: Ground) -> None:
    """Raise ConfigError if a point lies more than ``_OUTSIDE_M`` outside the bounds of a plan."""
    x1, y1, x2, y2 = plan.bbox
    for x, y in points:
        if not (x1 - _OUTSIDE_M <= x <= x2 + _OUTSIDE_M and y1 - _OUTSIDE_M <= y <= y2 + _OUTSIDE_M):
            raise ConfigError(f"point: expected metres inside the plan, found ({x:g}, {y:g})")


def _round_point(point: Sequence[float]) -> list[float]:
    return [round(value, MILLIMETRE_DIGITS) + 0.0 for value in point]  # + 0.0: no -0.0


def file_value(asked: FileRequest, plan: Ground, source: SourceView) -> Any:
    """Return the value of a statement about a file, as ``overrides.toml`` stores it, or None to remove it."""
    text = one_line(asked.value)
    if not text:
        return None
    if asked.key in {"keep", "up", "units"}:
        return True if asked.key == "keep" else text
    if asked.key in {"drop_nodes", "wall_layers"}:
        return [line.strip() for line in asked.value.splitlines() if line.strip()]
    numbers = [_number(asked.key, part) for part in re.split(r"[,;\s]+", text) if part]
    if len(numbers) != 1 and asked.key != "floors":
        raise ConfigError(f"{asked.key}: expected one number, found {text!r}")
    if asked.key != "distance":
        return numbers if asked.key == "floors" else numbers[0]
    unit_m = source.record.unit_m
    if len(asked.points) != 2 or unit_m is None or plan.frame is None:
        raise ConfigError("distance: expected two points, and the metres between them")
    check_inside(asked.points, plan)
    there = source_points_from_plan(plan.frame, asked.points) / unit_m
    a, b = (_round_to_unit(point, unit_m) for point in there.tolist())
    return [a, b, numbers[0]]


def _round_to_unit(point: Sequence[float], unit_m: float) -> list[float]:
    """Return a point of a file to a tenth of a millimetre, whatever its unit."""
    digits = max(0, MILLIMETRE_DIGITS + 1 + math.ceil(math.log10(unit_m)))
    return [round(value, digits) + 0.0 for value in point]


def _number(key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ConfigError(f"{key}: expected a number, found {text!r}") from None
    if not math.isfinite(value):
        raise ConfigError(f"{key}: expected a finite number, found {text}")
    return value
