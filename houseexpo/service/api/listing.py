"""What there is: data sets, plans by the page, counts, lists of ids."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.exports import FORMATS
from houseexpo.plan.categories import LABELS
from houseexpo.service.caching import hashed, values
from houseexpo.service.collection import Collection, Opened
from houseexpo.service.measures import MEASURES, RADII
from houseexpo.service.query import PAGING, Query, number, parsed
from houseexpo.service.service import Service

MAX_LIMIT: Final = 500
"""Plans of one page."""

_USUAL: Final = 60
_FARTHEST: Final = 10**8
_SHOWN: Final = ("rooms", "area", "doors", "holes", "quality", "narrowest", "reach")


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    def data_sets(request: Request) -> Response:
        return values(request, {"data": [described(shown) for shown in service.collections.values()]})

    def data_set(request: Request) -> Response:
        return values(request, described(service.collection(request)))

    def plans(request: Request) -> Response:
        now, query = service.collection(request).now, parsed(request.query_params, PAGING)
        offset = number(request.query_params, "offset", 0, _FARTHEST)
        limit = number(request.query_params, "limit", _USUAL, MAX_LIMIT, least=1)
        found = now.views.find(query)
        rows = found.rows[offset : offset + limit]
        following = offset + limit if offset + limit < len(found.rows) else None
        page = {"found": len(found.rows), "offset": offset, "next": following, "query": str(query)}
        return values(request, {**page, "plans": _lines(now, rows, query)})

    def facets(request: Request) -> Response:
        return values(request, service.collection(request).now.views.find(parsed(request.query_params)).facets)

    def ids(request: Request) -> Response:
        now = service.collection(request).now
        table = now.views.table
        rows = now.views.find(parsed(request.query_params)).rows.tolist()
        return _listed(request, (table.ids[row] for row in rows))

    def split(request: Request) -> Response:
        lists = service.collection(request).dataset.splits
        name = request.path_params["name"]
        if name not in lists:
            raise HTTPException(404, f"no list {name[:80]!r}; there are: {', '.join(sorted(lists)) or 'none'}")
        return _listed(request, lists[name])

    return [
        Route("/api/data", data_sets),
        Route("/api/{data}", data_set),
        Route("/api/{data}/plans", plans),
        Route("/api/{data}/facets", facets),
        Route("/api/{data}/ids.txt", ids),
        Route("/api/{data}/splits/{name}", split),
    ]


def described(shown: Collection) -> dict[str, Any]:
    """Return what a data set is, in plain values."""
    data = shown.dataset
    return {
        "name": shown.name,
        "plans": len(data),
        "splits": {name: len(ids) for name, ids in data.splits.items()},
        "measures": [
            {"name": measure.name, "title": measure.title, "unit": measure.unit, "counts": measure.counts}
            for measure in MEASURES
        ],
        "labels": list(LABELS),
        "radii": list(RADII),
        "formats": {name: form.what for name, form in FORMATS.items()},
    }


def _listed(request: Request, ids: Iterable[str]) -> Response:
    return hashed(request, "".join(f"{each}\n" for each in ids).encode(), "text/plain; charset=utf-8")


def _lines(now: Opened, rows: npt.NDArray[np.int64], query: Query) -> list[dict[str, Any]]:
    """Plans of a page: the id, what is shown of each, and the measure by which they are sorted."""
    table = now.views.table
    names = dict.fromkeys([*_SHOWN, *([query.sort.removeprefix("-")] if query.sort != "id" else [])])
    names.pop("id", None)
    lines: list[dict[str, Any]] = [{"id": table.ids[row]} for row in rows.tolist()]
    for name in names:
        for line, value in zip(lines, table.numbers(name, query.radius)[rows].tolist(), strict=True):
            if not math.isnan(value):
                line[name] = value
    return lines
