"""Serve the review of a data set: the queue of plans, what is known of each, the decisions that come in, the build."""

from __future__ import annotations

import getpass
import math
import re
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from threading import Lock
from typing import Annotated, Any, Final, Literal, get_args

import msgspec
from msgspec import Meta
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.corrections import Correction
from houseexpo.corrections.preview import Preview, preview
from houseexpo.corrections.vocabulary import WORDS, Word, checked_values
from houseexpo.dataset import Dataset
from houseexpo.dataset.store.folders import overrides_path
from houseexpo.drawing import svg
from houseexpo.drawing.scene import lay_out_plan
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.frame import GridFrame, plan_points_from_source, source_points_from_plan
from houseexpo.plan.explanations import GROUNDS
from houseexpo.plan.parts import SURE
from houseexpo.plan.room_labels import LABELS
from houseexpo.service.collection import Collection
from houseexpo.service.plan_page import room_names_beside
from houseexpo.service.responses import JsonResponse, decode_body
from houseexpo.service.review.changes import DecidedOtherwiseError, list_items
from houseexpo.service.review.decisions import DecisionStore, PlanDecisions
from houseexpo.service.review.log import LogLine
from houseexpo.service.review.rebuild import Rebuild
from houseexpo.service.search import plan_title
from houseexpo.service.service import Service, is_loopback

Move = Literal["here", "next", "previous", "open"]
LOOKED_AT_S: Final = 90.0
"""For this time, a plan that one reviewer was sent to is not offered to others."""


class ReviewQueue:
    """The plans of a data set, the least certain first; plans without a quality come last, by id."""

    def __init__(self, dataset: Dataset) -> None:
        qualities = [math.inf if value is None else value for value in dataset.column("quality")]
        self.dataset = dataset
        self.order = [name for _, name in sorted(zip(qualities, dataset.ids, strict=True))]
        self.places = {name: place for place, name in enumerate(self.order)}
        self.doubtful = sum(quality < SURE for quality in qualities)
        self._looked_at: dict[str, tuple[str, float]] = {}

    def move(self, start: str | None, how: Move, reviewer: str, judged: Mapping[str, PlanDecisions]) -> str | None:
        """Return the "next" or "previous" plan, the next "open" (undecided) one, or the plan "here".

        If ``start`` is not in the data set, the queue starts at the first plan. The result is None if no plan is left.
        """
        size = len(self.order)
        if not size:
            return None
        if start is None or start not in self.places:
            return self.order[0] if how != "open" else self._next_undecided(-1, reviewer, judged)
        place = self.places[start]
        if how == "open":
            return self._next_undecided(place, reviewer, judged)
        step = {"here": 0, "next": 1, "previous": -1}[how]
        return self.order[min(max(place + step, 0), size - 1)]

    def _next_undecided(self, place: int, reviewer: str, judged: Mapping[str, PlanDecisions]) -> str | None:
        now, others = time.monotonic(), None
        for step in range(1, len(self.order) + 1):
            name = self.order[(place + step) % len(self.order)]
            if name in judged:
                continue
            who, when = self._looked_at.get(name, ("", -math.inf))
            if who in {"", reviewer} or now - when > LOOKED_AT_S:
                self._looked_at[name] = reviewer, now
                return name
            others = others or name
        return others

    def progress(self, judged: Mapping[str, PlanDecisions]) -> dict[str, int]:
        """Return the number of plans and of judged ones, in all and among the doubtful ones."""
        doubtful = self.order[: self.doubtful]
        return {
            "plans": len(self.order),
            "judged": sum(name in self.places for name in judged),
            "doubtful": self.doubtful,
            "doubtful_judged": sum(name in judged for name in doubtful),
        }


_BESIDE_M: Final = 2.0
"""Points further than this from the plan are refused, metres."""
_DIGITS: Final = 3
"""Decimals of stored points: millimetres."""
_CONTROLS: Final = re.compile(r"[\x00-\x1f\x7f]+")

_MOST_POINTS: Final = 12
"""So many rooms become one at most."""

Name = Annotated[str, Meta(min_length=1, max_length=60)]
Id = Annotated[str, Meta(min_length=1, max_length=300)]
Point = tuple[float, float]


class DecisionRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A decision; ``points`` are in plan metres, ``seen`` is the number of the last log line that the reviewer saw.

    ``text`` is that of a note or a drop, and the label of a room.
    """

    plan: Id
    action: Literal["keep", "drop", Word, "note"]
    reviewer: Name
    seen: int = 0
    points: Annotated[list[Point], Meta(max_length=_MOST_POINTS)] = []
    text: Annotated[str, Meta(max_length=500)] = ""


class RebuildRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to rebuild; ``confirm`` is the digest of the commands that were shown (``Rebuild.status``)."""

    reviewer: Name
    confirm: Annotated[str, Meta(max_length=64)]


class UndoRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to undo the reviewer's latest decision."""

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
    if asked.action in {"keep", "drop", "note"}:
        return one_line(asked.text)
    word: Word = asked.action  # type: ignore[assignment]  # all others are words
    wanted = WORDS[word].depth
    if len(asked.points) != wanted and not (word == "one_room" and len(asked.points) > wanted):
        raise ConfigError(f"{word}: expected {wanted} points, found {len(asked.points)}")
    _check_inside(asked.points, plan)
    if plan.frame is None:
        raise ConfigError(
            f"{plan.id}: its position in the source is not recorded, so that only keep and drop are possible"
        )
    points = [_round_point(point) for point in source_points_from_plan(plan.frame, asked.points).tolist()]
    value = [*points[0], one_line(asked.text)] if word == "label" else points[0] if wanted == 1 else points
    checked_values(word, [value])
    return value


def told_corrections(plan: FloorPlan, table: Mapping[str, Any]) -> Preview[FloorPlan]:
    """Return the plan with what a table says of its storey, and the effect of each word."""
    said = [Correction(word, value) for word in WORDS for value in checked_values(word, table.get(word, ()))]
    return preview(plan, said)


def effect_of(plan: FloorPlan, table: Mapping[str, Any], word: Word, value: Any) -> dict[str, Any]:
    """Return the record of one more word beside those of a table.

    Raises
    ------
    ConfigError
        It has no effect; the message says why.
    """
    items = list_items(table.get(word), word)
    if value in items:
        raise ConfigError(f"{word}: no effect: it is said already")
    told = told_corrections(plan, {**table, word: [*items, value]})
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
"""Size of the picture of a plan."""
_LEAST_GROUND: Final = 0.005
"""Smaller grounds are not shown: they round to 0.00."""


def plan_facts(plan: FloorPlan) -> dict[str, Any]:
    """Return a plan's measures, its grounds (the strongest first), and the position of its picture in metres."""
    quality = plan.quality
    grounds = sorted((quality.grounds if quality else {}).items(), key=lambda pair: -pair[1])
    layout = lay_out_plan(plan, None, SIZE_PX)
    frame = GridFrame.around(layout.bounds, layout.pixels_per_metre, margin_px=0, y_up=True)
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
        "picture": {"origin": frame.origin_m, "ppm": frame.pixels_per_metre, "size": frame.shape[::-1]},
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


def decided_points(plan: FloorPlan, table: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the words of a plan's table (``DecisionStore.table``) with their points in plan metres."""
    if plan.frame is None:
        return []
    said = [Correction(word, value) for word in WORDS for value in checked_values(word, table.get(word, ()))]
    frame = plan.frame
    return [{"word": each.word, "points": plan_points_from_source(frame, each.points).tolist()} for each in said]


def decision_history(latest: LogLine | None, judged: PlanDecisions | None) -> dict[str, Any]:
    """Return the decisions on a plan, with reviewer and time, and the number of the latest log line about it."""
    last = judged.last if judged else None
    said = {"by": last.reviewer, "time": last.time, "actions": list(judged.actions)} if last and judged else None
    return {"judged": said, "seen": latest.number if latest else 0}


def summarise_review(ids: Iterable[str], judged: Mapping[str, PlanDecisions]) -> dict[str, Any]:
    """Return the result of a review: the plans by kind of decision, the reviewers, and the time from first to last."""
    there = {name: judged[name] for name in ids if name in judged}
    actions: dict[str, list[str]] = {}
    for name, found in there.items():
        for action in dict.fromkeys(found.actions):
            actions.setdefault(action, []).append(name)
    times = sorted(found.last.time for found in there.values())
    return {
        "actions": actions,
        "reviewers": dict(Counter(found.last.reviewer for found in there.values()).most_common()),
        "from": times[0] if times else None,
        "to": times[-1] if times else None,
    }


_MOVES: Final = get_args(Move)


class Review:
    """The review of one data set: its queue, its decisions, its build."""

    def __init__(self, collection: Collection) -> None:
        self._collection = collection
        self._queue = ReviewQueue(collection.dataset)
        self.decisions = DecisionStore(overrides_path(collection.path))
        self.building = Rebuild(collection, self.decisions)

    @property
    def queue(self) -> ReviewQueue:
        """The queue, which starts again when the data set has been rebuilt."""
        dataset = self._collection.dataset
        if self._queue.dataset is not dataset:
            self._queue = ReviewQueue(dataset)
        return self._queue

    def state(self, name: str | None) -> dict[str, Any]:
        """Return what the page shows of a plan, or of the end if it is None, and the progress of the review."""
        judged = self.decisions.by_plan()
        queue = self.queue
        common = {"progress": queue.progress(judged), "build": self.building.status()}
        if name is None:
            return {"plan": None, "summary": summarise_review(queue.dataset.ids, judged), **common}
        plan, table = queue.dataset[name], self.decisions.table(name)
        told = told_corrections(plan, table)
        return {
            **plan_facts(told.plan),
            "effects": list(told.records),
            **decision_history(self.decisions.latest().get(name), judged.get(name)),
            "place": queue.places[name] + 1,
            "table": table,
            "marks": decided_points(plan, table),
            **common,
        }


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/review``; without --review, they answer how to start it."""
    if not service.settings.review:
        return [Route("/{data}/review", _not_asked)]
    reviews: dict[str, Review] = {}
    opening = Lock()

    def review(request: Request) -> Review:
        collection = service.collection(request)
        with opening:  # only one: a second review would not know about a build that the first one started
            if collection.name not in reviews:
                reviews[collection.name] = Review(collection)
            return reviews[collection.name]

    def page(request: Request) -> Response:
        shown = service.collection(request)
        file = review(request).decisions.file
        reviewer = _user() if is_loopback(service.settings.host) else ""  # a browser elsewhere belongs to somebody else
        return service.page(
            request, "review/review.html", here="review", shown=shown, reviewer=reviewer, file=file, labels=LABELS
        )

    def state(request: Request) -> Response:
        found, asked = review(request), request.query_params
        how = asked.get("move", "here")
        if how not in _MOVES:
            raise ConfigError(f"move: expected one of {', '.join(_MOVES)}; found {how!r}")
        name = found.queue.move(asked.get("plan"), how, one_line(asked.get("reviewer", "")), found.decisions.by_plan())  # type: ignore[arg-type]  # one of _MOVES
        return JsonResponse(found.state(name), headers={"cache-control": "no-store"})

    def picture(request: Request) -> Response:
        found, name = review(request), request.path_params["plan"]
        when = request.query_params.get("when")
        if when == "built":
            return _picture_response(found.queue.dataset[name])
        if when != "before":
            return _picture_response(told_corrections(found.queue.dataset[name], found.decisions.table(name)).plan)
        if name not in found.building.before:
            raise HTTPException(404, f"{name}: this plan did not exist before the last build")
        return _picture_response(decode(found.building.before[name]))

    def decide(found: Review, body: bytes) -> dict[str, Any]:
        asked = decode_body(body, DecisionRequest)
        if found.building.phase == "building" and asked.action in WORDS:
            raise HTTPException(409, "the data set is being rebuilt; draw when the build has ended")
        plan = found.queue.dataset[asked.plan]
        value, reviewer = decision_value(asked, plan), _reviewer(asked.reviewer)
        effect = _effect(asked, plan, found.decisions, value)
        line = found.decisions.decide(asked.plan, asked.action, reviewer, value, asked.seen)
        return {**found.state(asked.plan), "noted": line.number, "effect": effect}

    def undo(found: Review, body: bytes) -> dict[str, Any]:
        line = found.decisions.undo(_reviewer(decode_body(body, UndoRequest).reviewer))
        there = line.plan if line.plan in found.queue.dataset else None
        return {**found.state(there), "undone": line.plan}

    def start(found: Review, body: bytes) -> dict[str, Any]:
        asked = decode_body(body, RebuildRequest)
        found.building.start(_reviewer(asked.reviewer), asked.confirm)
        return found.building.status()

    def stop(found: Review, body: bytes) -> dict[str, Any]:  # noqa: ARG001  # all are called in the same way
        found.building.stop()
        return found.building.status()

    def status(request: Request) -> Response:
        return JsonResponse(review(request).building.status(), headers={"cache-control": "no-store"})

    def post(work: Any) -> Any:
        async def answer(request: Request) -> Response:
            body = await request.body()
            found = await run_in_threadpool(review, request)
            try:
                return JsonResponse(await run_in_threadpool(work, found, body))
            except DecidedOtherwiseError as error:
                raise HTTPException(409, str(error)) from None

        return answer

    return [
        Route("/{data}/review", page),
        Route("/{data}/review/state", state),
        Route("/{data}/review/pictures/{plan}.svg", picture),
        Route("/{data}/review/decide", post(decide), methods=["POST"]),
        Route("/{data}/review/undo", post(undo), methods=["POST"]),
        Route("/{data}/review/build", post(start), methods=["POST"]),
        Route("/{data}/review/stop", post(stop), methods=["POST"]),
        Route("/{data}/review/build", status),
    ]


def _effect(asked: DecisionRequest, plan: FloorPlan, decisions: DecisionStore, value: Any) -> dict[str, Any] | None:
    """Return what a word will do to a plan; None for a decision that is no word of a storey."""
    if asked.action not in WORDS:
        return None
    return effect_of(plan, decisions.table(asked.plan), asked.action, value)


def _not_asked(_: Request) -> Response:
    raise HTTPException(404, "review is off; start the service with --review")


def _picture_response(plan: FloorPlan) -> Response:
    return Response(svg(plan, size=SIZE_PX), media_type="image/svg+xml", headers={"cache-control": "no-store"})


def _reviewer(name: str) -> str:
    found = one_line(name)
    if not found:
        raise ConfigError("reviewer: expected a name, found none; enter yours")
    return found


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # the system has no such user
        return ""
