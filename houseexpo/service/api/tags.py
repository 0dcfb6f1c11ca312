"""List and change a data set's tags below ``/api``; ``houseexpo.service.tags`` stores them."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import Meta, Struct
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.errors import ConfigError
from houseexpo.service.collection import Collection
from houseexpo.service.responses import JsonResponse, decode_body, json_response
from houseexpo.service.search import parse_query
from houseexpo.service.service import Service
from houseexpo.service.tags import Tags


class Tagging(Struct, frozen=True, forbid_unknown_fields=True):
    """Give a tag to plans, or remove it: those of ``ids``, or those that ``query`` finds."""

    tag: Annotated[str, Meta(max_length=200)]
    ids: list[str] | None = None
    query: dict[str, str] | None = None
    remove: bool = False


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    def description(shown: Collection, found: Tags) -> dict[str, Any]:
        file = shown.tags.file
        return {
            "tags": {name: len(ids) for name, ids in found.items()},
            "file": None if file is None else file.name,
            "writable": file is not None and not service.settings.read_only,
        }

    def list_tags(request: Request) -> Response:
        shown = service.collection(request)
        return json_response(request, description(shown, shown.tags.now()))

    async def tag_plans(request: Request) -> Response:
        shown, asked = service.collection(request), decode_body(await request.body(), Tagging)

        def change() -> Tags:
            if (asked.ids is None) == (asked.query is None):
                raise ConfigError("request: expected either ids or a query, found both or neither")
            if asked.ids is not None:
                ids = [shown.now.check_id(each) for each in asked.ids]
            else:
                now, found = shown.find(parse_query(asked.query or {}))
                ids = [now.views.table.ids[row] for row in found.rows.tolist()]
            return shown.tags.tag(asked.tag, ids, remove=asked.remove)

        return JsonResponse(description(shown, await run_in_threadpool(change)))

    return [
        Route("/api/{data}/tags", list_tags),
        Route("/api/{data}/tags", tag_plans, methods=["POST"]),
    ]
