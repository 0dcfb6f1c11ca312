"""Serve the page of inputs that gave no plan, by stage and reason, and of duplicates beside the plans kept instead."""

from __future__ import annotations

from typing import Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.service.build_lists import duplicate_picture_path, rejection_picture_path
from houseexpo.service.responses import file_response
from houseexpo.service.search import parse_whole_number
from houseexpo.service.service import Service

_PAGE: Final = 100
_FARTHEST: Final = 10**7


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/refused`` and of its pictures."""

    def page(request: Request) -> Response:
        shown, given = service.collection(request), request.query_params
        now, offset = shown.now, parse_whole_number(given, "offset", 0, _FARTHEST)
        stage, reason = given.get("stage", ""), given.get("reason", "")
        found = now.records.of(stage, reason)
        repeated = now.records.repeated
        listed = found[offset : offset + _PAGE]
        drawn = {each.id for each in listed if rejection_picture_path(shown.path, each.id)}
        pictured = {each.id for each in repeated[:_PAGE] if duplicate_picture_path(shown.path, each.id)}
        return service.page(
            request,
            "refused.html",
            shown=shown,
            here="refused",
            records=now.records,
            chosen=(stage, reason),
            refused=listed,
            drawn=drawn,
            found=len(found),
            offset=offset,
            size=_PAGE,
            repeated=repeated[:_PAGE],
            pictured=pictured,
            there=now.numbers,
        )

    def picture(request: Request) -> Response:
        shown, name = service.collection(request), request.path_params["plan"]
        known = any(each.id == name for each in shown.now.records.repeated)
        file = duplicate_picture_path(shown.path, name) if known else None
        if file is None:
            raise HTTPException(404, "the build kept no picture of it")
        return file_response(request, file, "image/png")

    def refused_picture(request: Request) -> Response:
        shown, name = service.collection(request), request.query_params.get("id", "")
        known = any(each.id == name for each in shown.now.records.refused)
        file = rejection_picture_path(shown.path, name) if known else None
        if file is None:
            raise HTTPException(404, "the build kept no picture of it")
        return file_response(request, file, "image/png")

    return [
        Route("/{data}/refused", page),
        Route("/api/{data}/refused/picture.png", refused_picture),
        Route("/api/{data}/duplicates/{plan}/picture.png", picture),
    ]
