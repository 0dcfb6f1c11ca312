"""Serve ``/api``, data sets for programs; the pages use the same addresses.

A page lists the addresses with the parameters of their queries. Other parameters are refused.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from starlette.datastructures import QueryParams
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route
from starlette.types import Receive, Scope, Send

from houseexpo.errors import ConfigError
from houseexpo.service.api import analysis, listing, plans
from houseexpo.service.api.listing import MAX_LIMIT
from houseexpo.service.search import JOINED, MEASURES, PAGE, TOKEN
from houseexpo.service.service import Service
from houseexpo.words import suggest_name


class ApiCall(NamedTuple):
    """One address: what it gives, of which type, and the parameters of its query."""

    path: str
    what: str
    kind: str = "application/json"
    query: tuple[str, ...] = ()


_FILTER: Final = (*(m.name for m in MEASURES), "labels", "without", "source", "split", "text", "radius")
_PAGED: Final = (*_FILTER, "sort", "offset", "limit", "columns")
_PARQUET: Final = "application/vnd.apache.parquet"

CALLS: Final = (
    ApiCall("/api/data", "The data sets."),
    ApiCall("/api/{data}", "What a data set is: plans, splits, measures, labels, formats."),
    ApiCall("/api/{data}/plans", f"Plans that meet a filter, by the page; limit is 1 to {MAX_LIMIT}.", query=_PAGED),
    ApiCall("/api/{data}/facets", "How many plans meet a filter, with counts beside each condition.", query=_FILTER),
    ApiCall("/api/{data}/ids.txt", "The ids of the plans found, one a line.", "text/plain", (*_FILTER, "sort")),
    ApiCall("/api/{data}/statistics", "Statistics of the plans found.", query=_FILTER),
    ApiCall("/api/{data}/splits/{name}", "A list of ids that comes with the data set.", "text/plain"),
    ApiCall("/api/{data}/index.parquet", "One row a plan, with the SHA-1 of its JSON; ranges.", _PARQUET),
    ApiCall("/api/{data}/refused/picture.png", "What was found of an input that gave no plan.", "image/png", ("id",)),
    ApiCall("/api/{data}/duplicates/{plan}/picture.png", "The picture of a dropped plan.", "image/png"),
    ApiCall("/api/{data}/export/{form}", "The plans found, in another format.", "application/zip", (*_FILTER, "ids")),
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
    """Return the routes of ``/api``."""

    def page(request: Request) -> Response:
        first = next(iter(service.collections.values()))
        shown = service.collections.get(request.query_params.get("data", ""), first)
        return service.page(request, "api.html", here="api", shown=shown, calls=CALLS)

    def redirect(_: Request) -> Response:
        return RedirectResponse("/api")

    found: list[BaseRoute] = [Route("/api", page), Route("/api/", redirect)]
    for part in (listing, plans, analysis):
        found += part.routes(service)
    return found
