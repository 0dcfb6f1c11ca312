"""Serve the Review page of each data set: the plans, the decisions that come in, the build."""

from __future__ import annotations

import getpass
from collections.abc import Callable
from threading import Lock
from typing import Any, Final, get_args

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.corrections.vocabulary import WORDS
from houseexpo.drawing import svg
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan.room_labels import LABELS
from houseexpo.service.responses import JsonResponse, decode_body
from houseexpo.service.review.changes import DecidedOtherwiseError
from houseexpo.service.review.queue import Move
from houseexpo.service.review.requests import (
    DecisionRequest,
    FileRequest,
    GapRequest,
    RebuildRequest,
    ReplaceRequest,
    UndoRequest,
    one_line,
)
from houseexpo.service.review.session import SIZE_PX, Review
from houseexpo.service.review.sources import SourceView
from houseexpo.service.review.tools import tools
from houseexpo.service.service import Service, is_loopback

_MOVES: Final = get_args(Move)


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
            request,
            "review/review.html",
            here="review",
            shown=shown,
            reviewer=reviewer,
            file=file,
            labels=LABELS,
            tools=msgspec.to_builtins(tools()),
        )

    def state(request: Request) -> Response:
        found, asked = review(request), request.query_params
        how = asked.get("move", "here")
        if how not in _MOVES:
            raise ConfigError(f"move: expected one of {', '.join(_MOVES)}; found {how!r}")
        chosen = asked.get("plan")
        if how == "here" and chosen in found.rejected:
            return JsonResponse(found.state(chosen), headers={"cache-control": "no-store"})
        name = found.queue.move(asked.get("plan"), how, one_line(asked.get("reviewer", "")), found.decisions.by_plan())  # type: ignore[arg-type]  # one of _MOVES
        return JsonResponse(found.state(name), headers={"cache-control": "no-store"})

    def picture(request: Request) -> Response:
        found, name = review(request), request.path_params["plan"]
        when = request.query_params.get("when")
        if when == "built":
            return _picture_response(found.queue.dataset[name])
        if when != "before":
            plan, said = found.queue.dataset[name], found.said_of(name)
            return _picture_response(found.told(plan, said, found.source(name)).plan)
        if name not in found.building.before:
            raise HTTPException(404, f"{name}: this plan did not exist before the last build")
        return _picture_response(decode(found.building.before[name]))

    def source_with(shown: Callable[[SourceView, FloorPlan | None], dict[str, Any]]) -> Callable[[Request], Response]:
        def answer(request: Request) -> Response:
            found, name = review(request), request.query_params.get("plan", "")
            view = found.source(name, wait=True)
            if view is None:
                raise HTTPException(404, f"{name}: no plan of this data set, and no house that its build rejected")
            return JsonResponse(shown(view, found.base(name, view)), headers={"cache-control": "no-store"})

        return answer

    def gap(request: Request) -> Response:
        asked = decode_body(request.query_params.get("asked", "").encode(), GapRequest)
        return JsonResponse(review(request).gap(asked.plan, asked.points), headers={"cache-control": "no-store"})

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
        Route("/{data}/review/source", source_with(SourceView.drawn_under)),
        Route("/{data}/review/solid", source_with(SourceView.solid_over)),
        Route("/{data}/review/gap", gap),
        Route("/{data}/review/file", post(_say_of_file), methods=["POST"]),
        Route("/{data}/review/decide", post(_decide), methods=["POST"]),
        Route("/{data}/review/replace", post(_replace), methods=["POST"]),
        Route("/{data}/review/undo", post(_undo), methods=["POST"]),
        Route("/{data}/review/redo", post(_redo), methods=["POST"]),
        Route("/{data}/review/build", post(_start), methods=["POST"]),
        Route("/{data}/review/stop", post(_stop), methods=["POST"]),
        Route("/{data}/review/build", status),
    ]


def _say_of_file(found: Review, body: bytes) -> dict[str, Any]:
    asked = decode_body(body, FileRequest)
    _check_idle(found)
    return found.say_of_file(asked, _reviewer(asked.reviewer))


def _decide(found: Review, body: bytes) -> dict[str, Any]:
    asked = decode_body(body, DecisionRequest)
    if asked.action in WORDS:
        _check_idle(found)
    return found.decide(asked, _reviewer(asked.reviewer))


def _replace(found: Review, body: bytes) -> dict[str, Any]:
    asked = decode_body(body, ReplaceRequest)
    _check_idle(found)
    return found.replace(asked, _reviewer(asked.reviewer))


def _undo(found: Review, body: bytes) -> dict[str, Any]:
    asked = decode_body(body, UndoRequest)
    return found.undo(_reviewer(asked.reviewer), asked.plan)


def _redo(found: Review, body: bytes) -> dict[str, Any]:
    return found.redo(_reviewer(decode_body(body, UndoRequest).reviewer))


def _check_idle(found: Review) -> None:
    if found.building.phase == "building":
        raise HTTPException(409, "the data set is being rebuilt; draw when the build has ended")


def _start(found: Review, body: bytes) -> dict[str, Any]:
    asked = decode_body(body, RebuildRequest)
    found.building.start(_reviewer(asked.reviewer), asked.confirm, found.shown_plans())
    return found.building.status()


def _stop(found: Review, body: bytes) -> dict[str, Any]:  # noqa: ARG001  # all are called in the same way
    found.building.stop()
    return found.building.status()


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
