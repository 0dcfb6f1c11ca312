"""Hold the review of a data set: what the page shows of a plan, and what a decision does to it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from houseexpo.corrections import Correction
from houseexpo.corrections.preview import Preview, preview
from houseexpo.corrections.vocabulary import WORDS, Word, checked_values
from houseexpo.dataset.store.folders import overrides_path
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_points_from_source, source_points_from_plan
from houseexpo.plan.explanations import GROUNDS
from houseexpo.service.api.analysis import shape_values
from houseexpo.service.collection import Collection
from houseexpo.service.lru_cache import LruCache
from houseexpo.service.plan_page import room_names_beside
from houseexpo.service.review.changes import list_items, replacement
from houseexpo.service.review.decisions import DecisionStore, PlanDecisions
from houseexpo.service.review.questions import questions
from houseexpo.service.review.queue import ReviewQueue, summarise_review
from houseexpo.service.review.rebuild import Rebuild
from houseexpo.service.review.tools import tools
from houseexpo.service.search import plan_title

_BESIDE_M: Final = 2.0
"""Points further than this from the plan are refused, metres."""
_DIGITS: Final = 3
"""Decimals of stored points: millimetres."""
_CONTROLS: Final = re.compile(r"[\x00-\x1f\x7f]+")

_MOST_POINTS: Final = 60
"""Points of an outline, or rooms that become one, at most."""

Name = Annotated[str, Meta(min_length=1, max_length=60)]
Id = Annotated[str, Meta(min_length=1, max_length=300)]
Point = tuple[float, float]


class DecisionRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A decision; ``points`` are in plan metres, ``seen`` is the number of the last log line that the reviewer saw.

    ``text`` is that of a note or a drop, the label of a room, and the question that is left.
    """

    plan: Id
    action: Literal["keep", "drop", Word, "note", "leave"]
    reviewer: Name
    seen: int = 0
    points: Annotated[list[Point], Meta(max_length=_MOST_POINTS)] = []
    text: Annotated[str, Meta(max_length=500)] = ""


class ReplaceRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to move or to take out something that is said.

    ``value`` is what the table says, in the source's axes; ``points`` are the new ones in plan metres, none to take it
    out; ``text`` is the label of a room.
    """

    plan: Id
    word: Word
    value: list[Any]
    reviewer: Name
    seen: int = 0
    points: Annotated[list[Point], Meta(max_length=_MOST_POINTS)] = []
    text: Annotated[str, Meta(max_length=500)] = ""


class RebuildRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to rebuild; ``confirm`` is the digest of the commands that were shown (``Rebuild.status``)."""

    reviewer: Name
    confirm: Annotated[str, Meta(max_length=64)]


class UndoRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to undo the reviewer's latest decision, or to make the one again that was undone last."""

    reviewer: Name


def one_line(text: str) -> str:
    """Return a text as one line without control characters."""
    return _CONTROLS.sub(" ", text).strip()


def decision_value(asked: DecisionRequest, plan: FloorPlan) -> Any:
    """Return the value of a decision, as ``DecisionStore.decide`` takes it.

    Raises
    ------
    ConfigError
        The number of points is wrong, a point is outside the plan, a line is too short, a label is unknown, or the
        plan has no frame.
    """
    if asked.action in {"keep", "drop", "note", "leave"}:
        return one_line(asked.text)
    return word_value(asked.action, asked.points, asked.text, plan)  # type: ignore[arg-type]  # all others are words


def word_value(word: Word, points: Sequence[Point], text: str, plan: FloorPlan) -> Any:
    """Return the value of a word, in the source's axes, from points in plan metres; see ``decision_value``."""
    tool = _TOOLS[word]
    if len(points) < tool.points or (len(points) > tool.points and not tool.more):
        raise ConfigError(f"{word}: expected {tool.points} points, found {len(points)}")
    _check_inside(points, plan)
    if plan.frame is None:
        raise ConfigError(
            f"{plan.id}: its position in the source is not recorded, so that only keep and drop are possible"
        )
    there = [_round_point(point) for point in source_points_from_plan(plan.frame, points).tolist()]
    value = [*there[0], one_line(text)] if tool.text else there[0] if tool.points == 1 else there
    checked_values(word, [value])
    return value


_TOOLS: Final = {tool.word: tool for tool in tools()}


def corrections_in(table: Mapping[str, Any]) -> list[Correction]:
    """Return what a table says of a storey."""
    return [Correction(word, value) for word in WORDS for value in checked_values(word, table.get(word, ()))]


def told_corrections(plan: FloorPlan, table: Mapping[str, Any]) -> Preview[FloorPlan]:
    """Return the plan with what a table says of its storey, and the effect of each word."""
    return preview(plan, corrections_in(table))


def effect_in(told: Preview[FloorPlan], word: Word, value: Any) -> dict[str, Any]:
    """Return the record of a word that was just said.

    Raises
    ------
    ConfigError
        It has no effect; the message says why.
    """
    mine = next(record for record in told.records if (record["word"], record["value"]) == (word, value))
    if mine["outcome"] == "none":
        raise ConfigError(f"{word}: no effect: {mine['said']}")
    return mine


def _check_inside(points: Sequence[Point], plan: FloorPlan) -> None:
    x1, y1, x2, y2 = plan.bbox
    for x, y in points:
        if not (x1 - _BESIDE_M <= x <= x2 + _BESIDE_M and y1 - _BESIDE_M <= y <= y2 + _BESIDE_M):
            raise ConfigError(f"point: expected metres inside the plan, found ({x:g}, {y:g})")


def _round_point(point: Sequence[float]) -> list[float]:
    return [round(value, _DIGITS) + 0.0 for value in point]  # + 0.0: no -0.0


SIZE_PX: Final = 900
"""Size of the pictures of plans before and after a build."""
_STEPS: Final = 60
"""The latest decisions on a plan that the page lists."""
_LEAST_GROUND: Final = 0.005
"""Smaller grounds are not shown: they round to 0.00."""


def plan_facts(plan: FloorPlan) -> dict[str, Any]:
    """Return a plan's measures, its grounds (the strongest first), and its shape in metres."""
    quality = plan.quality
    grounds = sorted((quality.grounds if quality else {}).items(), key=lambda pair: -pair[1])
    return {
        "plan": plan.id,
        "title": plan_title(len(plan.rooms) or None, plan.area, plan.room_num),
        "quality": quality.score if quality else None,
        "doubtful": bool(quality and quality.is_doubtful),
        "grounds": [
            [GROUNDS.get(name, name.replace("_", " ")), value] for name, value in grounds if value > _LEAST_GROUND
        ],
        "unsure": unsure_parts(plan),
        "area": round(plan.area, 1),
        "rooms": len(plan.rooms),
        "doors": len(plan.doors),
        "drawable": plan.frame is not None,
        "shape": shape_values(plan),
    }


def unsure_parts(plan: FloorPlan) -> list[str]:
    """Return the rooms and doors that are more likely wrong than right, in words, the least sure ones first."""
    rooms = [
        (room.confidence, f"outline of room {room.id}, {room.label.replace('_', ' ')}")
        for room in plan.rooms
        if room.is_unsure
    ]
    doors = [
        (door.confidence, f"{door.kind} {door.id}, between {room_names_beside(plan, door)}")
        for door in plan.doors
        if door.is_unsure
    ]
    return [f"{text}: {confidence:.0%} sure" for confidence, text in sorted(rooms + doors)]


def said_corrections(plan: FloorPlan, told: Preview[FloorPlan]) -> list[dict[str, Any]]:
    """Return what is said of a plan: the record of each word, and its points in metres of the plan."""
    frame = plan.frame
    if frame is None:
        return []
    found = []
    for record in told.records:
        points = Correction(record["word"], checked_values(record["word"], [record["value"]])[0]).points
        found.append({**record, "points": plan_points_from_source(frame, points).round(_DIGITS).tolist()})
    return found


def decision_history(name: str, decisions: DecisionStore, judged: PlanDecisions | None) -> dict[str, Any]:
    """Return the decisions on a plan, with reviewer and time, and the number of the latest log line about it."""
    last, latest = judged.last if judged else None, decisions.latest().get(name)
    said = {"by": last.reviewer, "time": last.time, "actions": list(judged.actions)} if last and judged else None
    steps = [
        {"number": line.number, "action": line.action, "by": line.reviewer, "time": line.time, "holds": holds}
        for line, holds in decisions.history(name)
    ]
    return {"judged": said, "seen": latest.number if latest else 0, "history": steps[-_STEPS:]}


_KEPT: Final = 32
"""So many corrected plans stay in memory: an undo finds the one before it."""


class Review:
    """The review of one data set: its queue, its decisions, its build."""

    def __init__(self, collection: Collection) -> None:
        self._collection = collection
        self._queue = ReviewQueue(collection.dataset)
        self.decisions = DecisionStore(overrides_path(collection.path))
        self.building = Rebuild(collection, self.decisions)
        self._told: LruCache[Preview[FloorPlan]] = LruCache(_KEPT)

    @property
    def queue(self) -> ReviewQueue:
        """The queue, which starts again when the data set has been rebuilt."""
        dataset = self._collection.dataset
        if self._queue.dataset is not dataset:
            self._queue = ReviewQueue(dataset)
            self._told = LruCache(_KEPT)
        return self._queue

    def state(self, name: str | None) -> dict[str, Any]:
        """Return what the page shows of a plan, or of the end if it is None, and the progress of the review."""
        judged = self.decisions.by_plan()
        queue = self.queue
        common = {"progress": queue.progress(judged), "build": self.building.status()}
        if name is None:
            return {"plan": None, "summary": summarise_review(queue.dataset.ids, judged), **common}
        plan, table = queue.dataset[name], self.decisions.table(name)
        told = self.told(plan, table)
        return {
            **plan_facts(told.plan),
            "effects": said_corrections(plan, told),
            **decision_history(name, self.decisions, judged.get(name)),
            "place": queue.places[name] + 1,
            "table": table,
            "questions": msgspec.to_builtins(questions(told.plan, self.decisions.left(name))),
            "storeys": queue.storeys(name),
            **common,
        }

    def undo(self, reviewer: str) -> dict[str, Any]:
        """Undo a reviewer's latest decision; return the state of its plan, which may be another than the one shown."""
        line = self.decisions.undo(reviewer)
        return {**self.state(self._there(line.plan)), "undone": line.plan}

    def redo(self, reviewer: str) -> dict[str, Any]:
        """Make the decision again that a reviewer undid last; return the state of its plan."""
        line = self.decisions.redo(reviewer)
        return {**self.state(self._there(line.plan)), "redone": line.plan}

    def _there(self, name: str) -> str | None:
        return name if name in self.queue.dataset else None

    def told(self, plan: FloorPlan, table: Mapping[str, Any]) -> Preview[FloorPlan]:
        """Return ``told_corrections``; the latest answers are kept."""
        key = plan.id, msgspec.json.encode({word: table[word] for word in WORDS if word in table})
        return self._told.get_or_make(key, lambda: told_corrections(plan, table))

    def decide(self, asked: DecisionRequest, reviewer: str) -> dict[str, Any]:
        """Store a decision; return the plan's state and the effect of a word, None if it is not one.

        Raises
        ------
        ConfigError
            See ``decision_value`` and ``DecisionStore.decide``, or the word has no effect.
        """
        plan = self.queue.dataset[asked.plan]
        value = decision_value(asked, plan)
        effect = self._said(asked, plan, value)
        line = self.decisions.decide(asked.plan, asked.action, reviewer, value, asked.seen)
        return {**self.state(asked.plan), "noted": line.number, "effect": effect}

    def _said(self, asked: DecisionRequest, plan: FloorPlan, value: Any) -> dict[str, Any] | None:
        if asked.action not in WORDS:
            return None
        word: Word = asked.action
        table = self.decisions.table(asked.plan)
        items = list_items(table.get(word), word)
        if value in items:
            raise ConfigError(f"{word}: no effect: it is said already")
        return effect_in(self.told(plan, {**table, word: [*items, value]}), word, value)

    def replace(self, asked: ReplaceRequest, reviewer: str) -> dict[str, Any]:
        """Move or take out something that is said; return the plan's state and the effect of the word that moved.

        Raises
        ------
        ConfigError
            See ``word_value`` and ``DecisionStore.replace``, or the word has no effect in its new place.
        """
        plan, table = self.queue.dataset[asked.plan], self.decisions.table(asked.plan)
        new = word_value(asked.word, asked.points, asked.text, plan) if asked.points else None
        changed = {key: after for key, (_, after) in replacement(table, asked.word, asked.value, new).items()}
        effect = None if new is None else effect_in(self.told(plan, {**table, **changed}), asked.word, new)
        line = self.decisions.replace(asked.plan, asked.word, asked.value, new, reviewer=reviewer, seen=asked.seen)
        return {**self.state(asked.plan), "noted": line.number, "effect": effect}
