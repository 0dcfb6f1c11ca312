"""Serve lists below ``/api``: data sets, pages of plans, counts, ids, splits, and the index, in parts if asked so."""

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

from houseexpo.drawing.styles import DOOR_COLOURS
from houseexpo.errors import ConfigError
from houseexpo.exports import FORMATS
from houseexpo.plan.room_labels import LABELS, label_colour
from houseexpo.service.collection import Collection, OpenedDataset
from houseexpo.service.responses import hash_tagged_response, json_response, range_response
from houseexpo.service.search import GROUPS, MEASURES, NAMES, PAGING, RADII, Query, parse_query, parse_whole_number
from houseexpo.service.service import Service

PARQUET: Final = "application/vnd.apache.parquet"

MAX_LIMIT: Final = 500
"""The largest number of plans on a page."""

COLUMNS: Final = (*NAMES, *GROUPS, "labels")
"""The columns that a page of plans may have."""

_LIMIT: Final = 60
"""The number of plans on a page if the address names none."""
_LARGEST_OFFSET: Final = 10**8
"""The largest offset."""
_SHOWN: Final = ("rooms", "source_rooms", "area", "doors", "holes", "quality", "narrowest", "reach")


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    def data_sets(request: Request) -> Response:
        return json_response(request, {"data": [describe_dataset(shown) for shown in service.collections.values()]})

    def data_set(request: Request) -> Response:
        return json_response(request, describe_dataset(service.collection(request)))

    def plans(request: Request) -> Response:
        query = parse_query(request.query_params, PAGING)
        columns = _columns(request.query_params.get("columns", ""))
        offset = parse_whole_number(request.query_params, "offset", 0, _LARGEST_OFFSET)
        limit = parse_whole_number(request.query_params, "limit", _LIMIT, MAX_LIMIT, least=1)
        now, found = service.collection(request).find(query)
        rows = found.rows[offset : offset + limit]
        following = offset + limit if offset + limit < len(found.rows) else None
        page = {"found": len(found.rows), "offset": offset, "next": following, "query": str(query)}
        return json_response(request, {**page, "plans": _lines(now, rows, query, columns)})

    def facets(request: Request) -> Response:
        return json_response(request, service.collection(request).find(parse_query(request.query_params))[1].facets)

    def ids(request: Request) -> Response:
        now, found = service.collection(request).find(parse_query(request.query_params))
        return _ids_response(request, (now.views.table.ids[row] for row in found.rows.tolist()))

    def split(request: Request) -> Response:
        lists = service.collection(request).dataset.splits
        name = request.path_params["name"]
        if name not in lists:
            raise HTTPException(404, f"no list {name[:80]!r}; the lists: {', '.join(sorted(lists)) or 'none'}")
        return _ids_response(request, lists[name])

    def index(request: Request) -> Response:
        data, tag = service.collection(request).now.index
        return range_response(request, data, tag, PARQUET)

    return [
        Route("/api/data", data_sets),
        Route("/api/{data}", data_set),
        Route("/api/{data}/plans", plans),
        Route("/api/{data}/facets", facets),
        Route("/api/{data}/ids.txt", ids),
        Route("/api/{data}/splits/{name}", split),
        Route("/api/{data}/index.parquet", index),
    ]


def describe_dataset(shown: Collection) -> dict[str, Any]:
    """Return the description of a data set as plain values."""
    data = shown.dataset
    return {
        "name": shown.name,
        "plans": len(data),
        "splits": {name: len(ids) for name, ids in data.splits.items()},
        "measures": [
            {"name": measure.name, "title": measure.title, "unit": measure.unit, "counts": measure.is_count}
            for measure in MEASURES
        ],
        "labels": list(LABELS),
        "colours": {label: label_colour(label) for label in LABELS},
        "door_colours": DOOR_COLOURS,
        "radii": list(RADII),
        "formats": {name: form.what for name, form in FORMATS.items()},
    }


def _ids_response(request: Request, ids: Iterable[str]) -> Response:
    return hash_tagged_response(request, "".join(f"{each}\n" for each in ids).encode(), "text/plain; charset=utf-8")


def _columns(word: str) -> list[str]:
    """Return the columns that an address asks for; raise ConfigError if one is unknown."""
    names = [name for name in word.split(",") if name]
    for name in names:
        if name not in COLUMNS:
            raise ConfigError(f"query: columns: expected some of {', '.join(COLUMNS)}; found {name[:40]!r}")
    return names


def _lines(
    now: OpenedDataset, rows: npt.NDArray[np.int64], query: Query, columns: Sequence[str]
) -> list[dict[str, Any]]:
    """Return the plans of a page with the usual columns, the measure by which they are sorted, and further columns."""
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
    for name in (name for name in names if name in NAMES):
        for line, value in zip(lines, table.numbers(name, query.radius)[rows].tolist(), strict=True):
            if not math.isnan(value):
                line[name] = value
    return lines
