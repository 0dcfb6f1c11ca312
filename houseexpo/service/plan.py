"""A plan's page: what is known of it; drawing and measuring on it is the page's part, computing that of ``/api``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any
from urllib.parse import quote

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.drawing.scene import DOOR_COLOURS
from houseexpo.exports import FORMATS
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.categories import colour
from houseexpo.service.collection import Opened
from houseexpo.service.evidence import evidence_of
from houseexpo.service.measures import MEASURES, RADII
from houseexpo.service.query import parsed
from houseexpo.service.service import Service
from houseexpo.service.views import Rows


def routes(service: Service) -> list[BaseRoute]:
    """Return the route of ``/DATA/plan/ID``."""

    def plan(request: Request) -> Response:
        shown = service.collection(request)
        query, name = parsed(request.query_params), request.path_params["plan"]
        now, view = shown.find(query)
        found = now.plan(name)
        before, place, after, number = _neighbours(now, name, view.rows, request.url.query)
        return service.page(
            request,
            "plan.html",
            shown=shown,
            here="plan",
            plan=found,
            quoted=quote(name, safe=""),
            title=now.views.table.title(now.numbers[name]),
            legend=_legend(found),
            query=request.url.query,
            tags=now.views.tags_of(now.numbers[name]),
            before=before,
            after=after,
            place=place,
            found=number,
            measures=list(_measures(now, name)),
            evidence=evidence_of(found),
            has_stages=now.data.stages(name) is not None,
            provenance=list(_told(found)),
            splits=[each for each, ids in now.data.splits.items() if name in ids],
            repeats=now.records.repeats_of(name),
            formats=FORMATS,
            python=_python(service.opening(request, shown.name), name),
        )

    return [Route("/{data}/plan/{plan}", plan)]


def _legend(plan: FloorPlan) -> list[tuple[str, str]]:
    """Return what stands in the drawing, with its colour: labels of rooms, the most frequent first, and doors."""
    rooms = Counter(room.label for room in plan.rooms) if plan.rooms else Counter(plan.room_category)
    labels = [(label.replace("_", " "), colour(label)) for label, _ in rooms.most_common()]
    kinds = dict.fromkeys(door.kind for door in plan.doors)
    return [*labels, *((kind, DOOR_COLOURS[kind]) for kind in kinds)]


def _neighbours(now: Opened, name: str, rows: Rows, query: str) -> tuple[str | None, int, str | None, int]:
    """Return the plan before, the place (from 1, or 0 if the view lacks the plan), the plan after, and how many."""
    at = (rows == now.numbers[name]).nonzero()[0]
    if not len(at):
        return None, 0, None, len(rows)
    place, ids = int(at[0]), now.views.table.ids
    suffix = f"?{query}" if query else ""

    def to(i: int) -> str | None:
        return quote(ids[int(rows[i])], safe="") + suffix if 0 <= i < len(rows) else None

    return to(place - 1), place + 1, to(place + 1), len(rows)


def _measures(now: Opened, name: str) -> Iterator[tuple[str, str]]:
    table, row = now.views.table, now.numbers[name]
    for measure in MEASURES:
        if measure.name in {"narrowest", "reach"}:
            continue
        value = table.value(row, measure.name)
        if value is not None:
            yield measure.title, f"{value:,g}{f' {measure.unit}' if measure.unit else ''}"
    for radius in RADII:
        reach, narrowest = table.value(row, "reach", radius), table.value(row, "narrowest", radius)
        if reach is not None:
            width = "" if narrowest is None else f", narrowest passage {narrowest:g} m"
            yield f"Reached, radius {radius} m", f"{reach:.1%}{width}"


def _told(plan: FloorPlan) -> Iterator[tuple[str, str]]:
    for key, value in (plan.provenance or {}).items():
        if words := _plain(value):
            yield key.replace("_", " "), words
    if plan.repair is not None:
        yield "repair", str(plan.repair)


def _plain(value: Any) -> str:
    """Return a value of JSON as a person reads it, or "" if it says nothing."""
    if isinstance(value, Mapping):
        return ", ".join(f"{str(name).replace('_', ' ')}: {_plain(each)}" for name, each in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(_plain, value))
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()


def _python(opening: str, name: str) -> str:
    return (
        "import houseexpo\n\n"
        f"{opening}\n"
        f"plan = plans[{name!r}]\n"
        "plan.area, plan.rooms, plan.doors\n"
        "plan.grid(25), plan.graph()"
    )
