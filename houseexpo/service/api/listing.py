"""What there is: data sets, plans by the page, counts, lists of ids."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.drawing.scene import DOOR_COLOURS
from houseexpo.errors import ConfigError
from houseexpo.exports import FORMATS
from houseexpo.plan.categories import LABELS, colour
from houseexpo.service.caching import hashed, values
from houseexpo.service.collection import Collection, Opened
from houseexpo.service.measures import MEASURES, RADII
from houseexpo.service.query import GROUPS, NAMES, PAGING, Query, number, parsed
from houseexpo.service.service import Service

MAX_LIMIT: Final = 500
"""Plans of one page."""

COLUMNS: Final = (*NAMES, *GROUPS, "labels", "tags")
"""What a page of plans may be asked for."""

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
        query = parsed(request.query_params, PAGING)
        columns = _columns(request.query_params.get("columns", ""))
        offset = number(request.query_params, "offset", 0, _FARTHEST)
        limit = number(request.query_params, "limit", _USUAL, MAX_LIMIT, least=1)
        now, found = service.collection(request).find(query)
        rows = found.rows[offset : offset + limit]
        following = offset + limit if offset + limit < len(found.rows) else None
        page = {"found": len(found.rows), "offset": offset, "next": following, "query": str(query)}
        return values(request, {**page, "plans": _lines(now, rows, query, columns)})

    def facets(request: Request) -> Response:
        return values(request, service.collection(request).find(parsed(request.query_params))[1].facets)

    def ids(request: Request) -> Response:
        now, found = service.collection(request).find(parsed(request.query_params))
        return _listed(request, (now.views.table.ids[row] for row in found.rows.tolist()))

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
        "colours": {label: colour(label) for label in LABELS},
        "door_colours": DOOR_COLOURS,
        "radii": list(RADII),
        "formats": {name: form.what for name, form in FORMATS.items()},
    }


def _listed(request: Request, ids: Iterable[str]) -> Response:
    return hashed(request, "".join(f"{each}\n" for each in ids).encode(), "text/plain; charset=utf-8")


def _columns(word: str) -> list[str]:
    """Return the columns that an address asks for; raise ConfigError if one is not known."""
    names = [name for name in word.split(",") if name]
    for name in names:
        if name not in COLUMNS:
            raise ConfigError(f"query: columns: expected some of {', '.join(COLUMNS)}; found {name[:40]!r}")
    return names


def _lines(now: Opened, rows: npt.NDArray[np.int64], query: Query, columns: Sequence[str]) -> list[dict[str, Any]]:
    """Plans of a page: id and title, what is shown of each, the measure of the order, and the columns asked for."""
    table = now.views.table
    names = dict.fromkeys([*_SHOWN, *columns, query.sort.removeprefix("-")])
    lines: list[dict[str, Any]] = [{"id": table.ids[row], "title": table.title(row)} for row in rows.tolist()]
    for name in GROUPS:
        known, code = table.groups[name]
        for line, of in zip(lines, code[rows].tolist() if name in names else (), strict=False):
            if of >= 0:
                line[name] = known[of]
    for line, row in zip(lines, rows.tolist(), strict=True):
        if "labels" in names:
            line["labels"] = [label for label, has in zip(LABELS, table.labels[:, row].tolist(), strict=True) if has]
        if tags := now.views.tags_of(row):
            line["tags"] = tags
    for name in (name for name in names if name in NAMES):
        for line, value in zip(lines, table.numbers(name, query.radius)[rows].tolist(), strict=True):
            if not math.isnan(value):
                line[name] = value
    return lines
