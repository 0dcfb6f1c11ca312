"""Hold the review of a data set: the state of each plan for the page Review, and the effect of decisions on it."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence, Set
from contextlib import suppress
from types import MappingProxyType
from typing import Any, Final

import msgspec
import numpy as np
from shapely import GEOSException, LineString, Polygon

from houseexpo.corrections import Correction, Override
from houseexpo.corrections.apply import Effect
from houseexpo.corrections.leaks import find_gap
from houseexpo.corrections.openings import SAID_WALL_M
from houseexpo.corrections.preview import Preview, preview
from houseexpo.corrections.vocabulary import FILE_WORDS, WORDS, Word, author_key, checked_values, in_order_said
from houseexpo.dataset.store.folders import overrides_path
from houseexpo.errors import ConfigError, PlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.lru_cache import LruCache
from houseexpo.plan.ids import parts_of
from houseexpo.service.collection import Collection
from houseexpo.service.review.changes import list_items, replacement, words_added, words_removed
from houseexpo.service.review.decisions import DecisionStore, NothingHereError
from houseexpo.service.review.plan_facts import decision_history, facts_without_plan, plan_facts, said_corrections
from houseexpo.service.review.question import SEVERAL, Answer, Question
from houseexpo.service.review.questions import gap_question, questions, with_effect
from houseexpo.service.review.queue import ReviewQueue, summarise_review
from houseexpo.service.review.rebuild import Rebuild
from houseexpo.service.review.requests import (
    TOOLS,
    DecisionRequest,
    FileRequest,
    Ground,
    Point,
    ReplaceRequest,
    check_inside,
    decision_value,
    file_value,
    one_line,
    scaled_value,
    word_value,
)
from houseexpo.service.review.source_questions import FLOORS, GUESS
from houseexpo.service.review.sources import NoSuchLevelError, Sources, SourceView
from houseexpo.service.review.unread_questions import LAYER, layer_questions, unread_questions

_LOG = logging.getLogger(__name__)
_LAST: Final = "~"
"""Comes after all times of a log, which begin with digits."""
_TAKING_OUT: Final = frozenset({"no_door", "no_wall", "no_room", "outside"})
"""Words that are said by taking out an earlier one, if it made what they remove."""


def corrections_in(table: Mapping[str, Any], times: Mapping[str, str] = MappingProxyType({})) -> list[Correction]:
    """Return the corrections of a storey in a table; see ``in_order_said`` for ``times``."""
    said = [Correction(word, value) for word in WORDS for value in checked_values(word, table.get(word, ()))]
    return [*in_order_said(said, times)]


def told_corrections(
    plan: FloorPlan, said: Sequence[Correction], source: SourceView | None = None
) -> Preview[FloorPlan]:
    """Return the plan with corrections, and the effect of each; exact only if the source is known."""
    base = None if source is None else source.plan
    if base is None or source is None:
        return preview(plan, said)
    if source.is_founded:
        records = (base.provenance or {}).get("corrections", [])
        return Preview(base, tuple({**record, "built": False} for record in records))
    shown = {"walls": source.walls, "lines": source.lines}
    return preview(plan, said, base, source.spaces, source.standing, **shown)


def _told_or_refused(plan: FloorPlan, said: Sequence[Correction], source: SourceView | None) -> Preview[FloorPlan]:
    """Return ``told_corrections``, or the plan without them and the reason if their shapes cannot be computed."""
    try:
        return told_corrections(plan, said, source)
    except (GEOSException, PlanError, ValueError, IndexError) as fault:
        _LOG.warning("%s: refused: %s", plan.id, [*map(str, said)], exc_info=True)
        why = f"its shapes cannot be computed ({fault}); move a point by some centimetres"
        shown = plan if source is None or source.plan is None else source.plan
        return Preview(shown, tuple({**Effect(each, "none", why).as_record(), "built": False} for each in said))


def effect_in(told: Preview[FloorPlan], word: Word, value: Any) -> dict[str, Any]:
    """Return the record of a correction by its word and value."""
    return next(record for record in told.records if (record["word"], record["value"]) == (word, value))


class _NoEffectHereError(ConfigError):
    """A word has no effect; ``against`` is the earlier word that it contradicts, as a text, or ""."""

    def __init__(self, text: str, against: str) -> None:
        super().__init__(text)
        self.against = against


def _taken_out(gone: Sequence[tuple[Word, Any]]) -> str:
    """Return a sentence about earlier words that a new one takes the place of."""
    return f"{' and '.join(_earlier(word) for word, _ in gone)} {'is' if len(gone) == 1 else 'are'} taken out"


def _earlier(word: Word) -> str:
    """Return the name of an earlier correction, with its key on the page."""
    return f"the earlier “{TOOLS[word].title}” ({TOOLS[word].key.upper()})"


def _without_effect_now(before: Preview[FloorPlan], after: Preview[FloorPlan]) -> list[str]:
    """Return a sentence about each earlier correction that a new one has robbed of its effect."""
    had = {author_key(each["word"], each["value"]) for each in before.records if each["outcome"] == "done"}
    idle = [each for each in after.records if each["outcome"] == "none"]
    lost = [each for each in idle if author_key(each["word"], each["value"]) in had]
    return [f"but {_earlier(each['word'])} has no effect any more: {each['said']}" for each in lost]


def _hash_of(plan: FloorPlan | None) -> str:
    """Return the SHA-256 of the file from which a plan was made, "" if it is not recorded."""
    return str(((plan.provenance if plan else None) or {}).get("sha256", ""))


def _is_of_another(one: FloorPlan, other: FloorPlan) -> bool:
    """Return whether two plans are known to come from different versions of a file."""
    return bool(_hash_of(one) and _hash_of(other)) and _hash_of(one) != _hash_of(other)


def changed_question(plan: FloorPlan, count: int, size: int = 0, *, grows: bool = False) -> dict[str, Any]:
    """Return the question whether earlier corrections are valid for the file as it is now.

    ``size`` is the number of the log line that stated another size or axis, 0 if the file itself was replaced.
    ``grows`` tells whether it is known by which factor the file has grown.
    """
    (x1, y1, x2, y2), what = plan.bbox, "1 correction was" if count == 1 else f"{count} corrections were"
    why = "The size or the axis of the file was said" if size else "The file has changed"
    says = f"{why} since {what} made here; they are shown as dotted ghosts. Do they still hold?"
    along = (Answer("They have grown with it", "grow"),) if grows else ()
    answers = Answer("They hold"), Answer("Take them out", "take_out"), *along
    at = round((x1 + x2) / 2, 3), round((y1 + y2) / 2, 3)
    return dict(msgspec.to_builtins(Question(_changed_key(_hash_of(plan), size), at, says, answers, 1.0)))


def _changed_key(source: str, size: int) -> str:
    return f"changed at {source[:8]}{f', line {size}' if size else ''}"


SIZE_PX: Final = 900
"""Size of the pictures of plans before and after a build, pixels."""
_KEPT: Final = 32
"""The number of corrected plans in memory, so that an undo finds the previous one."""


class Review:
    """The review of one data set: its queue, its decisions, its build."""

    def __init__(self, collection: Collection) -> None:
        self._collection = collection
        self._queue = ReviewQueue(collection.dataset)
        self.decisions = DecisionStore(overrides_path(collection.path))
        self.building = Rebuild(collection, self.decisions)
        self._told: LruCache[Preview[FloorPlan]] = LruCache(_KEPT)
        self._facts: tuple[FloorPlan, dict[str, Any]] | None = None
        self._sources = Sources(self.building.commands)
        self._refused: tuple[Any, dict[str, str]] = None, {}

    @property
    def queue(self) -> ReviewQueue:
        """The queue, which starts again when the data set has been rebuilt."""
        dataset = self._collection.dataset
        if self._queue.dataset is not dataset:
            self._queue = ReviewQueue(dataset)
            self._told = LruCache(_KEPT)
        return self._queue

    @property
    def rejected(self) -> dict[str, str]:
        """The houses that the build rejected and that nobody dropped, with the reasons."""
        dataset = self._collection.dataset
        if self._refused[0] is not dataset:
            found = {
                each.id: f"{each.reason.replace('_', ' ')}: {each.detail}"
                for each in self._collection.now.records.refused
                if each.reason not in {"dropped_by_hand", "no_such_level"}
            }
            self._refused = dataset, {name: why for name, why in found.items() if name not in dataset}
        return self._refused[1]

    def source(self, name: str, *, wait: bool = False) -> SourceView | None:
        """Return the source of a plan, or None if it is not read yet; raise SourceError if it cannot be read."""
        known = name in self.queue.dataset
        if not known and name not in self.rejected:
            return None
        tables = self.decisions.tables()
        if wait:
            return self._sources.read(name, tables, is_plan=known)
        return self._sources.known(name, tables, is_plan=known)

    def _shown(self, name: str) -> SourceView | None:
        """Return the source of a plan, or while it is not read with the current statements, the one to show."""
        tables, is_plan = self.decisions.tables(), name in self.queue.dataset
        if self._is_outdated(name):
            return self._sources.latest(name)
        return self.source(name) or self._sources.latest_with(name, tables, is_plan=is_plan)

    def _is_outdated(self, name: str) -> bool:
        """Return whether the file of a plan is still to be read with what is said of it since the build."""
        can_be_read = not self.building.why_not_possible()
        if not can_be_read or self.source(name) is not None or not self.decisions.file_changed(name):
            return False
        return not self._sources.is_read_with(name, self.decisions.tables())

    def _check_read(self, name: str) -> None:
        if self._is_outdated(name):
            raise ConfigError(f"{name}: its file is read with what is said of it; draw when the new plan is shown")

    def shown_plans(self) -> dict[str, FloorPlan]:
        """Return the plans with decisions since the last build as the page shows them, where their source is read."""
        found = {}
        for name in self.decisions.since_build():
            source = self.source(name)
            plan = None if source is None else self.base(name, source)
            if plan is not None:
                found[name] = self.told(plan, self.said_of(name), source).plan
        return found

    def state(self, name: str | None) -> dict[str, Any]:
        """Return the state of the page for a plan, or for the end of the queue (None), and the review's progress."""
        judged = self.decisions.by_plan()
        queue = self.queue
        common: dict[str, Any] = {
            "progress": queue.progress(judged),
            "build": self.building.status(),
            "rejections": self.rejected,
        }
        if name is None:
            return {"plan": None, "summary": summarise_review(queue.dataset.ids, judged), **common}
        table, source, is_plan = self.decisions.table(name), self.source(name), name in queue.dataset
        common["source"] = self._source_facts(name, source, is_plan=is_plan)
        history = decision_history(name, self._storey(name), self.decisions, judged.get(name))
        common |= {**history, "table": table}
        common |= {"storeys": queue.storeys(name) if is_plan else [], "place": queue.places.get(name, -1) + 1}
        shown = self._shown(name)
        plan = self.base(name, shown)
        if plan is None:
            rejected = self.rejected.get(name) or (shown.why_no_plan if shown else "")
            known = () if source is None else unread_questions(source, self._left(name, source), self.said_of(name))
            asked = msgspec.to_builtins(list(known))
            return {**facts_without_plan(name, shown), "rejected": rejected, "questions": asked, **common}
        all_said = self.said_of(name)
        told, left = self.told(plan, all_said, shown), self._left(name, shown)
        effects = said_corrections(plan, told)
        ghosts, size = self._mark_ghosts(name, plan, effects, left)
        words = [(each["word"], each["points"]) for each in effects]
        said = () if source is None or source.is_founded else all_said
        several = {key for key, answer in self.decisions.left(name).items() if answer == SEVERAL}
        found = questions(told.plan, left, source, words, several)
        is_current = source is shown and not common["source"]["is_outdated"]  # else it is read again with what was said
        asked = msgspec.to_builtins(with_effect(told.plan, found, said, source))
        if source is not None:
            (x1, y1, x2, y2) = told.plan.bbox
            first = layer_questions(source, left, (round((x1 + x2) / 2, 3), round((y1 + y2) / 2, 3)))
            asked = [*msgspec.to_builtins(list(first)), *asked]
        if ghosts:
            asked.insert(0, changed_question(plan, len(ghosts), size, grows=all(ghosts)))
        return {
            **self._facts_of(told.plan),
            "plan": name,  # the source's plan may have another id, that of its input alone
            "rejected": "" if is_plan else self.rejected.get(name, ""),
            "effects": effects,
            "questions": asked if is_current else [],
            **common,
        }

    def _facts_of(self, plan: FloorPlan) -> dict[str, Any]:
        """Return ``plan_facts``; an answer that confirms the plan leaves it as it is."""
        if self._facts is None or self._facts[0] is not plan:
            self._facts = plan, plan_facts(plan)
        return self._facts[1]

    def base(self, name: str, source: SourceView | None) -> FloorPlan | None:
        """Return the plan to correct: from the data set, or from its source.

        It is from its source if it is made of what is said there, or if the file or its statements changed; None if the
        source gives no plan with the statements about the file.
        """
        now = None if source is None else source.plan
        if name in self.rejected:
            return now
        built = self.queue.dataset[name]
        if source is None or (now is None and not source.why_no_plan):
            return built
        is_said = source.is_founded or self.decisions.file_changed(source.record.id)
        return now if is_said or (now is not None and _is_of_another(now, built)) else built

    def _left(self, name: str, source: SourceView | None) -> set[str]:
        """Return the questions that are not asked again; that about the file is left on any of its storeys."""
        found = set(self.decisions.left(name))
        storeys = [plan.id for level in source.record.levels for plan in level.plans] if source is not None else []
        for storey in storeys:
            found |= {key for key in self.decisions.left(storey) if key in {GUESS, FLOORS} or key.startswith(LAYER)}
        return found

    def _mark_ghosts(
        self, name: str, plan: FloorPlan, effects: list[dict[str, Any]], left: Set[str]
    ) -> tuple[list[float], int]:
        """Mark the corrections that were made for another version of the plan's file, or for another size of it.

        Return the factor by which the file has grown since each, 0 if it is not known, and the log line that stated the
        size (``DecisionStore.said_before_size``).
        """
        source, latest = _hash_of(plan), self._sources.latest(name)
        size, resized = self.decisions.said_before_size(name, name if latest is None else latest.record.id)
        if _changed_key(source, size) in left:
            return [], size
        made = self.decisions.sources(name)
        for each in effects:
            key = author_key(each["word"], each["value"])
            each["ghost"] = key in resized or bool(source and made.get(key, "") not in {"", source})
            each["grown"] = resized.get(key, 0.0)
        return [each["grown"] for each in effects if each["ghost"]], size

    def _why_changed(self, name: str, source: SourceView | None, *, is_said: bool) -> str:
        """Return why the page does not show the data set's plan, "" if it does.

        ``is_said`` tells whether anything is said of the file.
        """
        is_drawing = source is not None and name in self.rejected and source.record.reader == "vector_plans"
        if source is not None and source.plan is None and is_said and self.base(name, source) is None:
            if is_drawing:  # which lines are walls is asked next
                return ""
            return f"With what is said of the file there is no plan now: {source.record.rejected or source.why_no_plan}"
        if source is not None and name in self.rejected and len(source.level.plans) > 1:
            return f"With what is said there are {len(source.level.plans)} plans; this is the largest"
        if source is None or source.plan is None or name in self.rejected:
            return ""
        if _is_of_another(source.plan, self.queue.dataset[name]):
            return "The file has changed since the plan was built; this is the plan of the file as it is now"
        said = self.decisions.file_changed(source.record.id)
        return "This is the plan with what is said of the file" if said else ""

    def _source_facts(self, name: str, source: SourceView | None, *, is_plan: bool) -> dict[str, Any]:
        """Return whether the source is read, the reason if it cannot be, and the statements about the file."""
        tables = self.decisions.tables()
        never, failed = self.building.why_not_possible(), self._sources.why_not(name, tables, is_plan=is_plan)
        latest = source or self._sources.latest(name)
        file = name if latest is None else latest.record.id
        table = tables.get(file, {})
        said = {key: table[key] for key in (*FILE_WORDS, "keep") if key in table} if isinstance(table, dict) else {}
        takes = () if latest is None else latest.record.takes
        levels = () if latest is None else latest.record.levels
        return {
            "known": source is not None,
            "why": never or str(failed or ""),
            "can_be_read": not never and not isinstance(failed, NoSuchLevelError),
            "is_outdated": self._is_outdated(name),
            "changed": self._why_changed(name, source, is_said=bool(said)),
            "file": file,
            "said": said,
            "takes": [*takes, *(["distance"] if "units" in takes and latest and latest.record.unit_m else [])],
            "floors": sorted({round(level.frame.floor, 2) + 0.0 for level in levels}),  # not -0
            "names": () if latest is None else latest.record.names,
            "unit_m": None if latest is None else latest.record.unit_m,
            "rejected": "" if source is None or source.plan is not None else source.why_no_plan,
        }

    def undo(self, reviewer: str, plan: str = "") -> dict[str, Any]:
        """Undo a reviewer's latest decision, only on ``plan`` or its file if given; return the state of the plan."""
        source = self._sources.latest(plan) if plan else None
        try:
            line = self.decisions.undo(
                reviewer, () if not plan else (plan, self._storey(plan), plan if source is None else source.record.id)
            )
        except NothingHereError as elsewhere:
            return {**self.state(self._there(plan)), "elsewhere": elsewhere.plan}
        undone = {"undone": line.plan, "asked": self.decisions.question_of(line.undoes)}
        return {**self.state(self._there(plan or line.plan)), **undone}

    def redo(self, reviewer: str) -> dict[str, Any]:
        """Redo the decision that a reviewer undid last; return the state of its plan."""
        line = self.decisions.redo(reviewer)
        return {**self.state(self._there(line.plan)), "redone": line.plan}

    def _there(self, name: str) -> str | None:
        return name if name in self.queue.dataset or name in self.rejected else None

    def told(self, plan: FloorPlan, said: Sequence[Correction], source: SourceView | None = None) -> Preview[FloorPlan]:
        """Return ``told_corrections``; the latest answers are kept."""
        words = "\n".join(map(str, said)).encode()
        key = plan.id, words, None if source is None else id(source)
        return self._told.get_or_make(key, lambda: _told_or_refused(plan, said, source))

    def said_of(
        self, name: str, table: Mapping[str, Any] | None = None, times: Mapping[str, str] = MappingProxyType({})
    ) -> list[Correction]:
        """Return the corrections of a plan, or in a table of it, in the order in which they were said.

        ``times`` are of statements that the log does not know yet.
        """
        table = self.decisions.table(name) if table is None else table
        times = {**self.decisions.times(name), **times}
        own = corrections_in(table, times)
        above = [each for each in self._said_of_storey(name) if each not in own]
        return [*in_order_said([*above, *own], {**self.decisions.times(self._storey(name)), **times})] if above else own

    def _storey(self, name: str) -> str:
        """Return the id of the storey of which a plan is one building; "" if the plan is a whole storey."""
        storey = parts_of(name).of_level
        return "" if storey == name or storey in self.queue.dataset or name not in self.queue.dataset else storey

    def _said_of_storey(self, name: str) -> list[Correction]:
        """Return what is said of the whole storey of a plan, as far as the build found it to be of this building."""
        storey = self._storey(name)
        table = self.decisions.table(storey) if storey else {}
        if not table:
            return []
        records = (self.queue.dataset[name].provenance or {}).get("corrections", [])
        built = {author_key(each["word"], each["value"]) for each in records}
        return [each for each in corrections_in(table) if author_key(each.word, each.value) in built]

    def _ground(self, name: str) -> Ground:
        """Return the place in which a person draws: the plan, and the source around it if it is read.

        Raises
        ------
        ConfigError
            The source of a house without a plan has not been read.
        """
        source = self._shown(name)
        plan = self.base(name, source)
        if source is None and plan is None:
            raise ConfigError(f"{name}: its source is not read yet; wait until it is shown")
        if plan is None:
            assert source is not None  # noqa: S101  # checked above
            return Ground(name, source.level.frame, source.bounds_around(None), is_plan=False)
        if source is None:
            return Ground(name, plan.frame, plan.bbox)
        boxes = np.array([plan.bbox, source.bounds_around(plan)])
        low, high = boxes[:, :2].min(axis=0).tolist(), boxes[:, 2:].max(axis=0).tolist()
        return Ground(name, plan.frame, (*low, *high))

    def gap(self, name: str, points: Sequence[Point]) -> dict[str, Any]:
        """Return a question about the gap by which a space stays open (``GapRequest``), {} if there is none.

        Raises
        ------
        ConfigError
            There is no such plan, a point is outside it, or its source has not been read.
        """
        ground, source = self._ground(name), self._shown(name)
        check_inside(points, ground)
        if ground.frame is None:
            return {}
        plan, table = self.base(name, source), self.decisions.table(name)
        lines, standing, rooms = list_items(table.get("wall"), "wall"), list[Polygon](), list[Polygon]()
        if plan is not None:
            told = self.told(plan, self.said_of(name), self.source(name))
            rooms = [room.polygon for room in told.plan.rooms]
            lines = [*lines, *(each["value"] for each in told.records if each.get("waits"))]
        if source is not None:
            standing = source.standing_in(plan)
        there = [LineString(plan_points_from_source(ground.frame, line)) for line in lines]
        drawn = [line.buffer(SAID_WALL_M / 2, cap_style="square") for line in there]
        found = find_gap(points, rooms, standing, drawn)
        return {} if found is None else msgspec.to_builtins(gap_question(found))

    def _plan(self, name: str) -> FloorPlan:
        """Return the plan to correct; the plan of a rejected house comes from its source."""
        plan = self.base(name, self._shown(name))
        if plan is None:
            raise ConfigError(f"{name}: it has no plan yet")
        return plan

    def decide(self, asked: DecisionRequest, reviewer: str) -> dict[str, Any]:
        """Store a decision; return the plan's state, and the effect if the action is a word, else None.

        Raises
        ------
        ConfigError
            See ``decision_value`` and ``DecisionStore.decide``, or the word has no effect.
        """
        is_word = asked.action in WORDS or asked.plan not in self.rejected
        plan = self._ground(asked.plan) if is_word else Ground(asked.plan, None, (0.0, 0.0, 0.0, 0.0))
        value, effect, more = decision_value(asked, plan), None, list[Any]()
        then, gone, beside = list[tuple[Word, Any]](), list[tuple[Word, Any]](), list[str]()
        if asked.action == "leave":
            more = [one_line(each) for each in asked.text.split("\n")[1:]]
        elif asked.action in WORDS:
            self._check_read(asked.plan)
            word: Word = asked.action
            wanted = [value, *(word_value(word, points, asked.text, plan) for points in asked.more)]
            table = self.decisions.table(asked.plan)
            values, effect, gone = self._said_instead(asked.plan, plan, word, wanted, table)
            value, *more = values or [None]
            if gone and values:
                effect = {**effect, "also": [_taken_out(gone), *effect.get("also", ())]}
            table = words_removed(table, gone)
            for each in asked.then:
                table = {**table, **words_added(table, [*((word, one) for one in values), *then])}
                further = word_value(each.action, each.points, "", plan)
                with suppress(ConfigError):  # what the words before it have done already
                    _, also = self._said(asked.plan, plan, each.action, [further], table)
                    then.append((each.action, further))
                    beside = [*beside, also["said"]]
                    effect = {**effect, "also": [*beside, *also.get("also", ())]}  # what followed before may be gone
        source = self._hash_at(asked.plan) if effect else ""
        answer = one_line(asked.answer) if asked.action == "leave" else ""
        line = self.decisions.decide(
            asked.plan,
            asked.action,
            reviewer,
            value,
            asked.seen,
            more=more,
            then=then,
            gone=gone,
            source=source,
            answer=answer,
            question=one_line(asked.question),
        )
        return {**self.state(asked.plan), "noted": line.number, "effect": effect}

    def _hash_at(self, name: str) -> str:
        """Return the SHA-256 of the file of the shown plan."""
        return _hash_of(self.base(name, self._shown(name)))

    def _said(
        self, name: str, plan: Ground, word: Word, wanted: Sequence[Any], table: Mapping[str, Any]
    ) -> tuple[Sequence[Any], dict[str, Any]]:
        """Return the values of a word that have an effect after those in a table, and one record of their effects."""
        items = list_items(table.get(word), word)
        new = [value for k, value in enumerate(wanted) if value not in items and value not in wanted[:k]]
        if not new:
            raise ConfigError(f"{word}: no effect: it is said already")
        found = self._effects(name, plan, {**table, word: [*items, *new]}, word, new)
        done = [each for each in found if each["outcome"] != "none" or each.get("waits")]
        if not done:
            raise _NoEffectHereError(f"{word}: no effect: {found[0]['said']}", found[0].get("against", ""))
        if len(found) == 1:
            return new, done[0]
        none = [f"at {len(found) - len(done)} it has none: {each['said']}" for each in found if each not in done][:1]
        also = [line for each in done for line in each.get("also", ())]
        said = f"{len(done)} places at once, which one undo takes back; the first: {done[0]['said']}"
        return [each["value"] for each in done], {**done[0], "said": said, "also": [*none, *also]}

    def _said_instead(
        self, name: str, plan: Ground, word: Word, wanted: Sequence[Any], table: Mapping[str, Any]
    ) -> tuple[Sequence[Any], dict[str, Any], list[tuple[Word, Any]]]:
        """Return what ``_said`` returns, and the earlier words that a word contradicts, in whose place it comes.

        There is no value if taking out an earlier word does all that the new one says.
        """
        gone, refused, known = list[tuple[Word, Any]](), None, table
        while True:
            try:
                return *self._said(name, plan, word, wanted, known), gone
            except _NoEffectHereError as error:
                refused = refused or error
                earlier = next((each for each in corrections_in(known) if str(each) == error.against), None)
                if earlier is None and gone and not error.against and word in _TAKING_OUT:
                    return [], {"word": word, "value": wanted[0], "outcome": "done", "said": _taken_out(gone)}, gone
                if earlier is None or len(wanted) > 1:
                    raise refused from None
            gone.append((earlier.word, earlier.plain_value))
            known = words_removed(table, gone)
            if word in {"no_room", "outside"} and earlier.word in {"room", "room_outline"}:  # not the room below it
                return [], {"word": word, "value": wanted[0], "outcome": "done", "said": _taken_out(gone)}, gone

    def _effects(
        self, name: str, plan: Ground, table: Mapping[str, Any], word: Word, values: Sequence[Any], *, at: str = _LAST
    ) -> list[dict[str, Any]]:
        """Return the records of new corrections; effects that only the search can tell are found later.

        ``at`` is the time that the log will have for them.
        """
        source = self._shown(name)
        if not plan.is_plan or (source is not None and source.is_founded):
            Override(**{each: table[each] for each in WORDS if each in table})
            said = {"word": word, "outcome": "done", "said": "the rooms are searched with it now"}
            return [{**said, "value": value} for value in values]
        base = self._plan(name)
        with_new = self.said_of(name, table, {author_key(word, value): at for value in values})
        told, now = self.told(base, with_new, source), self.told(base, self.said_of(name), source)
        before = {line for each in now.records for line in each.get("also", ())}
        found = [effect_in(told, word, value) for value in values]
        found[-1] = {**found[-1], "also": [*found[-1].get("also", ()), *_without_effect_now(now, told)]}
        return [{**each, "also": [line for line in each.get("also", ()) if line not in before]} for each in found]

    def say_of_file(self, asked: FileRequest, reviewer: str) -> dict[str, Any]:
        """Store a statement about a whole file; return the state of the plan, whose source must be read again.

        Raises
        ------
        ConfigError
            The value is invalid, the file's reader does not support the key, or the source has not been read.
        """
        source = self._sources.latest(asked.plan)
        if source is None:
            raise ConfigError(f"{asked.plan}: its source is not read yet; wait until it is shown")
        if asked.key not in self._source_facts(asked.plan, source, is_plan=asked.plan in self.queue.dataset)["takes"]:
            raise ConfigError(f"{asked.key}: the reader of {source.record.id} does not take it")
        value = file_value(asked, self._ground(asked.plan), source)
        said = self.decisions.table(source.record.id)
        kept = {
            key: said[key] for key in ("up", "floors", "drop_nodes", "wall_layers") if key in said and key != asked.key
        }
        if value is not None:
            Override(**kept, **{asked.key: value})  # raises ConfigError if it is invalid
        line = self.decisions.say_of_file(source.record.id, asked.key, value, reviewer)
        return {**self.state(asked.plan), "noted": line.number, "effect": None}

    def replace(self, asked: ReplaceRequest, reviewer: str) -> dict[str, Any]:
        """Move or remove a correction; return the plan's state and the effect of the moved correction.

        Raises
        ------
        ConfigError
            See ``word_value`` and ``DecisionStore.replace``, or the correction has no effect in its new place.
        """
        plan, table = self._ground(asked.plan), self.decisions.table(asked.plan)
        above = [(each.word, each.plain_value) for each in self._said_of_storey(asked.plan)]
        if (asked.word, asked.value) in above and asked.value not in list_items(table.get(asked.word), asked.word):
            return self._remove_of_storey(asked, reviewer)
        new = word_value(asked.word, asked.points, asked.text, plan) if asked.points else None
        new = new if asked.by is None else scaled_value(asked.value, asked.by)
        changed = {key: after for key, (_, after) in replacement(table, asked.word, asked.value, new).items()}
        effect = None
        if new is not None:
            self._check_read(asked.plan)
            at = self.decisions.times(asked.plan).get(author_key(asked.word, asked.value), "")
            (effect,) = self._effects(asked.plan, plan, {**table, **changed}, asked.word, [new], at=at)
            if effect["outcome"] == "none" and not effect.get("waits"):
                raise ConfigError(f"{asked.word}: no effect: {effect['said']}")
        source = self._hash_at(asked.plan)
        line = self.decisions.replace(
            asked.plan, asked.word, asked.value, new, reviewer=reviewer, seen=asked.seen, source=source
        )
        return {**self.state(asked.plan), "noted": line.number, "effect": effect}

    def _remove_of_storey(self, asked: ReplaceRequest, reviewer: str) -> dict[str, Any]:
        storey = self._storey(asked.plan)
        if asked.points or asked.by is not None:
            raise ConfigError(f"{asked.word}: it is said of the whole storey {storey}; take it out, and say it here")
        line = self.decisions.replace(storey, asked.word, asked.value, None, reviewer=reviewer, seen=asked.seen)
        return {**self.state(asked.plan), "noted": line.number, "effect": None}
