"""Describe ``/api``: an OpenAPI 3.1 document for programs, and a page that lists its addresses for people.

Parameters that it does not list are refused.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import msgspec
from starlette.datastructures import QueryParams
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route
from starlette.types import Receive, Scope, Send

from houseexpo import __version__
from houseexpo.errors import ConfigError
from houseexpo.exports import FORMATS
from houseexpo.service.api.analysis import LARGEST_ROBOT_M
from houseexpo.service.api.listing import MAX_LIMIT
from houseexpo.service.api.tags import Tagging
from houseexpo.service.responses import json_response
from houseexpo.service.search import JOINED, MEASURES, PAGE, RADII, SORTS, TOKEN
from houseexpo.service.service import Service
from houseexpo.words import suggest_name


class ApiCall(NamedTuple):
    """One address: what it gives, of which type, the parameters of its query, and the body that it takes."""

    path: str
    what: str
    kind: str = "application/json"
    query: tuple[str, ...] = ()
    body: type | None = None

    @property
    def method(self) -> str:
        """Return the method by which it is asked."""
        return "get" if self.body is None else "post"


_FILTER: Final = (*(m.name for m in MEASURES), "labels", "without", "tags", "source", "split", "text", "radius")
_PAGED: Final = (*_FILTER, "sort", "offset", "limit", "columns")
_PARQUET: Final = "application/vnd.apache.parquet"

CALLS: Final = (
    ApiCall("/api/data", "The data sets."),
    ApiCall("/api/{data}", "What a data set is: plans, splits, measures, labels, formats."),
    ApiCall("/api/{data}/plans", f"Plans that meet a filter, by the page; limit is 1 to {MAX_LIMIT}.", query=_PAGED),
    ApiCall("/api/{data}/facets", "How many plans meet a filter, with counts beside each condition.", query=_FILTER),
    ApiCall("/api/{data}/ids.txt", "The ids of the plans found, one a line.", "text/plain", (*_FILTER, "sort")),
    ApiCall("/api/{data}/statistics", "Statistics of the plans found.", query=(*_FILTER, "against")),
    ApiCall("/api/{data}/splits/{name}", "A list of ids that comes with the data set.", "text/plain"),
    ApiCall("/api/{data}/index.parquet", "One row a plan, with the SHA-1 of its JSON; ranges.", _PARQUET),
    ApiCall("/api/{data}/refused/picture.png", "What was found of an input that gave no plan.", "image/png", ("id",)),
    ApiCall("/api/{data}/duplicates/{plan}/picture.png", "The picture of a dropped plan.", "image/png"),
    ApiCall("/api/{data}/export/{form}", "The plans found, in another format.", "application/zip", (*_FILTER, "ids")),
    ApiCall("/api/{data}/tags", "The tags that people gave to plans."),
    ApiCall("/api/{data}/tags", "Give a tag to plans, or take it away.", body=Tagging),
    ApiCall("/api/{data}/plans/{plan}", "A plan's JSON as it is packed; its tag is the SHA-1 of its bytes."),
    ApiCall("/api/{data}/plans/{plan}/thumbnail.svg", "A small picture.", "image/svg+xml"),
    ApiCall("/api/{data}/plans/{plan}/picture.svg", "A picture with labels and scale.", "image/svg+xml"),
    ApiCall(
        "/api/{data}/plans/{plan}/stages.png",
        "The stages that a plan went through, if kept.",
        "image/png",
    ),
    ApiCall("/api/{data}/plans/{plan}/export/{form}", "A plan in another format.", "application/octet-stream"),
    ApiCall("/api/{data}/plans/{plan}/shape", "Rings of all that a plan records, metres."),
    ApiCall("/api/{data}/plans/{plan}/rooms", "Rooms and doors; found where the plan records none."),
    ApiCall("/api/{data}/plans/{plan}/reach", "Where a round robot can stand, and what it covers.", query=("radius",)),
    ApiCall("/api/{data}/plans/{plan}/way", "The shortest way of a round robot.", query=("from", "to", "radius")),
    ApiCall("/api/{data}/plans/{plan}/clearance", "The distance to the nearest wall, as a picture."),
    ApiCall("/api/{data}/plans/{plan}/similar", "The plans most like one."),
)

_ENUMS: Final[dict[str, list[str]]] = {
    "radius": list(RADII),
    "sort": [f"{sign}{name}" for name in SORTS for sign in ("", "-")],
    "form": list(FORMATS),
}
_RANGES: Final = {measure.name for measure in MEASURES}


_ALSO: Final = (TOKEN,)
"""Parameters of every address: a server without a token ignores it."""
_OF_PAGES: Final = ("sort", *PAGE)
"""Parameters of a page's address, which its pages pass on with the filter."""


def add_query_check(route: Route) -> None:
    """Let a route below ``/api`` refuse parameters that its address does not take (``CALLS``), and those given twice.

    The answer is that of a ConfigError, 400; it names the most similar parameter that there is.
    """
    found = dict.fromkeys(name for call in CALLS if call.path == route.path for name in call.query)
    known = list(dict.fromkeys([*found, *(_OF_PAGES if found.keys() >= set(_FILTER) else ())]))
    answer = route.app

    async def check_parameters(scope: Scope, receive: Receive, send: Send) -> None:
        given = QueryParams(scope["query_string"])
        for name in given:
            if name not in known and name not in _ALSO:
                takes = f"expected {', '.join(known)}" if known else "expected no parameter"
                raise ConfigError(f"query: {takes}; found {name[:40]!r}{suggest_name(name[:40], known)}")
            if len(given.getlist(name)) > 1 and name not in JOINED:
                raise ConfigError(f"query: {name}: expected once, found {len(given.getlist(name))} of it")
        await answer(scope, receive, send)

    route.app = check_parameters


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    def document(request: Request) -> Response:
        return json_response(request, openapi_document())

    def page(request: Request) -> Response:
        first = next(iter(service.collections.values()))
        shown = service.collections.get(request.query_params.get("data", ""), first)
        return service.page(request, "api.html", here="api", shown=shown, calls=CALLS)

    def redirect(_: Request) -> Response:
        return RedirectResponse("/api")

    return [Route("/api", page), Route("/api/", redirect), Route("/api/openapi.json", document)]


def openapi_document() -> dict[str, Any]:
    """Return the OpenAPI document."""
    paths: dict[str, dict[str, Any]] = {}
    for call in CALLS:
        paths.setdefault(call.path, {})[call.method] = _operation(call)
    info = {
        "title": "houseexpo",
        "version": __version__,
        "description": "Floor plans for programs. Lengths are metres.",
    }
    return {"openapi": "3.1.0", "info": info, "paths": paths}


def _operation(call: ApiCall) -> dict[str, Any]:
    errors = {"description": "What is wrong, in a sentence.", "content": {"application/json": {"schema": _ERROR}}}
    found: dict[str, Any] = {"200": {"description": call.what, "content": {call.kind: {}}}}
    return {
        "summary": call.what,
        "operationId": _name_of(call.path) if call.body is None else f"{call.method}_{_name_of(call.path)}",
        **({} if call.body is None else {"requestBody": _body(call.body)}),
        "parameters": [*_in_path(call.path), *(_in_query(call, name) for name in call.query)],
        "responses": {**found, "4XX": errors, "503": errors},
    }


def _body(kind: type) -> dict[str, Any]:
    (schema,), parts = msgspec.json.schema_components([kind])
    return {"required": True, "content": {"application/json": {"schema": parts.get(kind.__name__, schema)}}}


_ERROR: Final = {"type": "object", "properties": {"error": {"type": "string"}}, "required": ["error"]}


def _in_path(path: str) -> list[dict[str, Any]]:
    names = [part[1:-1] for part in path.split("/") if part.startswith("{")]
    return [{"name": name, "in": "path", "required": True, "schema": _schema(name)} for name in names]


def _in_query(call: ApiCall, name: str) -> dict[str, Any]:
    metres = name == "radius" and call.path.endswith(("/reach", "/way"))
    schema = {"type": "number", "minimum": 0.01, "maximum": LARGEST_ROBOT_M} if metres else _schema(name)
    words = "A number or a range: 3, 3..6, ..6, 3.." if name in _RANGES and not metres else ""
    required = name in {"from", "to", "id"}
    return {"name": name, "in": "query", "required": required, "schema": schema, "description": words}


def _schema(name: str) -> dict[str, Any]:
    if name == "offset":
        return {"type": "integer", "minimum": 0}
    if name == "limit":
        return {"type": "integer", "minimum": 1, "maximum": MAX_LIMIT}
    return {"type": "string", **({"enum": _ENUMS[name]} if name in _ENUMS else {})}


def _name_of(path: str) -> str:
    parts = (f"by_{part.strip('{}')}" if part.startswith("{") else part for part in path.split("/")[2:])
    return "_".join(parts).replace(".", "_")
