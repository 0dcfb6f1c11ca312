"""Serve the page of two plans side by side at one scale: measures, labels and the difference of their areas."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from urllib.parse import quote

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.analysis.similarity import compare_masks, comparison_mask
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.service.collection import Collection, OpenedDataset
from houseexpo.service.computations import compute_in_turn
from houseexpo.service.search import MEASURES
from houseexpo.service.service import Service

_PIXELS_PER_METRE = 10.0
_PIXELS = 300.0
"""Longer side of the larger plan on the grid on which both are compared."""


def routes(service: Service) -> list[BaseRoute]:
    """Return the route of ``/DATA/compare?plans=ID,ID``; ``other`` names the data set of the second plan."""

    async def page(request: Request) -> Response:
        shown = service.collection(request)
        other = request.query_params.get("other") or shown.name
        if other not in service.collections:
            raise ConfigError(f"other: no data set {other[:40]!r}; the data sets: {', '.join(service.collections)}")
        asked = [name for name in request.query_params.get("plans", "").split(",") if name]
        if len(asked) != 2:
            raise ConfigError(f"plans: expected two ids, as in plans=ID,ID, found {len(asked)}")
        places = (shown, service.collections[other])
        opened = [place.now for place in places]
        plans = [now.plan(name) for now, name in zip(opened, asked, strict=True)]
        difference, symmetry = await compute_in_turn(request, _difference, *plans)
        return service.page(
            request,
            "compare.html",
            shown=shown,
            here="compare",
            sides=[_side(place, now, name) for place, now, name in zip(places, opened, asked, strict=True)],
            rows=list(_rows(opened, asked)),
            labels=list(_labels(plans)),
            difference=difference,
            symmetry=symmetry,
        )

    return [Route("/{data}/compare", page)]


def _side(place: Collection, now: OpenedDataset, name: str) -> dict[str, str]:
    return {
        "data": place.name,
        "id": name,
        "quoted": quote(name, safe=""),
        "title": now.views.table.title(now.numbers[name]),
    }


def _difference(one: FloorPlan, other: FloorPlan) -> tuple[float, str]:
    """Return the share of the larger area that differs, under the best symmetry of the square."""
    longest = max(max(plan.bbox[2] - plan.bbox[0], plan.bbox[3] - plan.bbox[1]) for plan in (one, other))
    scale = min(_PIXELS_PER_METRE, _PIXELS / max(longest, 1.0))
    match = compare_masks(comparison_mask(one, scale), comparison_mask(other, scale), 2.0)
    return (1.0, "") if match is None else (match.difference, match.symmetry.replace("_", " "))


def _rows(opened: list[OpenedDataset], asked: list[str]) -> Iterator[tuple[str, str, str, str]]:
    """Yield each measure's title, both values, and the difference of the second from the first."""
    for measure in MEASURES:
        found = [
            now.views.table.value(now.numbers[name], measure.name) for now, name in zip(opened, asked, strict=True)
        ]
        if found == [None, None]:
            continue
        words = [_number(value, measure.is_count, measure.unit) for value in found]
        one, two = found
        apart = "" if one is None or two is None else _number(two - one, measure.is_count, measure.unit, sign=True)
        yield measure.title, words[0], words[1], apart


def _labels(plans: list[FloorPlan]) -> Iterator[tuple[str, int, int]]:
    """Yield each label and the number of its occurrences in both plans."""
    counts = [Counter(_labels_of(plan)) for plan in plans]
    for label in sorted(counts[0] | counts[1]):
        yield label.replace("_", " "), counts[0][label], counts[1][label]


def _labels_of(plan: FloorPlan) -> list[str]:
    if plan.rooms:
        return [room.label for room in plan.rooms]
    return [label for label, boxes in plan.room_category.items() for _ in boxes]


def _number(value: float | None, whole: bool, unit: str, *, sign: bool = False) -> str:
    if value is None:
        return "unknown"
    if sign and value == 0:
        return "equal"
    text = f"{value:{'+' if sign else ''},.{0 if whole else 2}f}"
    return f"{text} {unit}".rstrip()
