"""The routes of review: a page, what it asks for, and what it decides."""

from __future__ import annotations

import getpass
from threading import Lock
from typing import Any, Final, get_args

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.dataset.store.folders import overrides_file
from houseexpo.drawing import svg
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.service.answers import Json, read
from houseexpo.service.collection import Collection
from houseexpo.service.review.building import Building
from houseexpo.service.review.changes import DecidedOtherwiseError
from houseexpo.service.review.decisions import Decisions
from houseexpo.service.review.page_values import SIZE_PX, history, marks, plan_values, summary
from houseexpo.service.review.queue import Move, Queue
from houseexpo.service.review.request_bodies import Begin, Decision, Undo, plain, value_of
from houseexpo.service.service import Service
from houseexpo.service.settings import is_loopback

_MOVES: Final = get_args(Move)


class Review:
    """The review of one data set: the plans in order, the decisions, the build."""

    def __init__(self, collection: Collection) -> None:
        self._collection = collection
        self._queue = Queue(collection.dataset)
        self.decisions = Decisions(overrides_file(collection.path))
        self.building = Building(collection, self.decisions)

    @property
    def queue(self) -> Queue:
        """The plans in order, anew where the data set was built again."""
        dataset = self._collection.dataset
        if self._queue.dataset is not dataset:
            self._queue = Queue(dataset)
        return self._queue

    def state(self, name: str | None) -> dict[str, Any]:
        """Return what is shown of a plan, None: that none is left; and how far all is judged."""
        judged = self.decisions.judged()
        queue = self.queue
        common = {"progress": queue.progress(judged), "build": self.building.status()}
        if name is None:
            return {"plan": None, "summary": summary(queue.dataset.ids, judged), **common}
        plan, table = queue.dataset[name], self.decisions.table(name)
        return {
            **plan_values(plan),
            **history(self.decisions.latest().get(name), judged.get(name)),
            "place": queue.places[name] + 1,
            "table": table,
            "marks": marks(plan, table),
            **common,
        }


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/review``; a word of what to do where the service is not asked to review."""
    if not service.settings.review:
        return [Route("/{data}/review", _not_asked)]
    reviews: dict[str, Review] = {}
    opening = Lock()

    def review(request: Request) -> Review:
        collection = service.collection(request)
        with opening:  # one each: a second one would not know of the first one's build
            if collection.name not in reviews:
                reviews[collection.name] = Review(collection)
            return reviews[collection.name]

    def page(request: Request) -> Response:
        shown = service.collection(request)
        file = review(request).decisions.file
        reviewer = _user() if is_loopback(service.settings.host) else ""  # others' browsers are not this machine's user
        return service.page(request, "review/review.html", here="review", shown=shown, reviewer=reviewer, file=file)

    def state(request: Request) -> Response:
        found, asked = review(request), request.query_params
        how = asked.get("move", "here")
        if how not in _MOVES:
            raise ConfigError(f"move: expected one of {', '.join(_MOVES)}; found {how!r}")
        name = found.queue.move(asked.get("plan"), how, plain(asked.get("reviewer", "")), found.decisions.judged())  # type: ignore[arg-type]  # one of _MOVES
        return Json(found.state(name), headers={"cache-control": "no-store"})

    def picture(request: Request) -> Response:
        found, name = review(request), request.path_params["plan"]
        if request.query_params.get("when") != "before":
            return _drawn(found.queue.dataset[name])
        if name not in found.building.before:
            raise HTTPException(404, f"{name}: there was no such plan before the last build")
        return _drawn(decode(found.building.before[name]))

    def decided(found: Review, body: bytes) -> dict[str, Any]:
        asked = read(body, Decision)
        if found.building.phase == "building" and asked.action in {"door", "no_room"}:
            raise HTTPException(409, "the data set is being built; draw when that has ended")
        plan = found.queue.dataset[asked.plan]
        value, reviewer = value_of(asked, plan), _reviewer(asked.reviewer)
        line = found.decisions.decide(asked.plan, asked.action, reviewer, value, asked.seen)
        return {**found.state(asked.plan), "noted": line.number}

    def undone(found: Review, body: bytes) -> dict[str, Any]:
        line = found.decisions.undo(_reviewer(read(body, Undo).reviewer))
        there = line.plan if line.plan in found.queue.dataset else None
        return {**found.state(there), "undone": line.plan}

    def started(found: Review, body: bytes) -> dict[str, Any]:
        asked = read(body, Begin)
        found.building.start(_reviewer(asked.reviewer), asked.confirm)
        return found.building.status()

    def stopped(found: Review, body: bytes) -> dict[str, Any]:  # noqa: ARG001  # each is called alike
        found.building.stop()
        return found.building.status()

    def status(request: Request) -> Response:
        return Json(review(request).building.status(), headers={"cache-control": "no-store"})

    def posted(work: Any) -> Any:
        async def answer(request: Request) -> Response:
            body = await request.body()
            found = await run_in_threadpool(review, request)
            try:
                return Json(await run_in_threadpool(work, found, body))
            except DecidedOtherwiseError as error:
                raise HTTPException(409, str(error)) from None

        return answer

    return [
        Route("/{data}/review", page),
        Route("/{data}/review/state", state),
        Route("/{data}/review/pictures/{plan}.svg", picture),
        Route("/{data}/review/decide", posted(decided), methods=["POST"]),
        Route("/{data}/review/undo", posted(undone), methods=["POST"]),
        Route("/{data}/review/build", posted(started), methods=["POST"]),
        Route("/{data}/review/stop", posted(stopped), methods=["POST"]),
        Route("/{data}/review/build", status),
    ]


def _not_asked(_: Request) -> Response:
    raise HTTPException(404, "plans are judged here where the service was started with --review")


def _drawn(plan: FloorPlan) -> Response:
    return Response(svg(plan, size=SIZE_PX), media_type="image/svg+xml", headers={"cache-control": "no-store"})


def _reviewer(name: str) -> str:
    found = plain(name)
    if not found:
        raise ConfigError("reviewer: expected a name, found none; write yours")
    return found


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # a system without such a user
        return ""
