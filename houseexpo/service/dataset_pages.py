"""Serve the start page of all data sets, and each one's gallery, statistics, about page, and what gave no plan.

The description of a data set may come from strangers. It is shown as plain text of limited length, and it is read only
from regular files in the data set's folder. A damaged file is ignored.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from houseexpo.analysis.measures import Measure
from houseexpo.drawing.styles import DOOR_COLOURS
from houseexpo.files import decode_json, read_file
from houseexpo.plan.parts import SURE
from houseexpo.plan.room_labels import LABELS, label_colour
from houseexpo.release.check_releasable import MADE, OWN
from houseexpo.service.build_lists import duplicate_picture_path, rejection_picture_path
from houseexpo.service.collection import Collection, OpenedDataset
from houseexpo.service.responses import file_response, json_response
from houseexpo.service.search import MEASURES, Numbers, Query, choose_bins, parse_query, parse_whole_number
from houseexpo.service.service import Service

_KINDS: Final = {"procedural": "homes made by houseexpo"}
"""Kinds of sources that people know by another name."""
_SHOWN_FILE_BYTES: Final = 4 << 20
"""The largest file that is read."""
_SHOWN_LETTERS: Final = 600
"""The longest text that is shown."""
_PICTURES: Final = 12
_FEW_SOURCES: Final = 6
"""The number of sources listed, and of pictures on the page of all data sets."""
_LISTED: Final = 100
"""The number of refused inputs on a page, and of duplicates."""
_FARTHEST: Final = 10**7


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of the pages below ``/DATA/`` (the gallery), and of ``/`` (all data sets, or the only one)."""

    def about(request: Request) -> Response:
        shown = service.collection(request)
        facts = dataset_facts(shown, _PICTURES)
        return service.page(
            request,
            "about.html",
            shown=shown,
            here="about",
            facts=facts,
            labels=_labels(shown.now),
            doors=DOOR_COLOURS,
            python=_python(service.opening(request, shown.name)),
        )

    def start(request: Request) -> Response:
        if len(service.collections) == 1:
            return RedirectResponse(f"/{next(iter(service.collections))}/")
        listed = [(shown, dataset_facts(shown, _FEW_SOURCES)) for shown in service.collections.values()]
        return service.page(request, "start.html", listed=listed)

    def gallery(request: Request) -> Response:
        return service.page(request, "gallery.html", shown=service.collection(request), here="gallery")

    return [
        Route("/", start),
        Route("/{data}/about", about),
        *_refused_routes(service),
        *_statistics_routes(service),
        Route("/{data}/", gallery),
    ]


def dataset_facts(shown: Collection, pictures: int) -> dict[str, Any]:
    """Return the description and the figures of a data set, and ``pictures`` of its plans, spread over the whole."""
    now = shown.now
    table, described = now.views.table, _read_description(shown.path)
    figures = [("plans", f"{len(table):,}"), *_totals(now)]
    figures += [(words, f"{count:,}") for words, count in _outcome_counts(now) if count]
    return {
        "name": described.get("name", "") or shown.name,
        "what": described.get("description", "") or _sentence(now, described),
        "licence": described.get("license", ""),
        "version": described.get("version", ""),
        "sources": described.get("sources", ""),
        "figures": figures,
        "plans": [(table.ids[row], table.title(row)) for row in _spread_evenly(len(table), pictures)],
    }


def _totals(now: OpenedDataset) -> list[tuple[str, str]]:
    table, found = now.views.table, []
    measures = (
        ("rooms", "rooms", ""),
        ("source_rooms", "rooms in the source", ""),
        ("area", "free area", " m²"),
    )
    for name, words, unit in measures:
        known = table.numbers(name)[~np.isnan(table.numbers(name))]
        if len(known):
            found.append((f"{words} in total", f"{known.sum():,.0f}{unit}"))
            found.append((f"{words} per plan, median", f"{np.median(known):,.0f}{unit}"))
    return found


def _outcome_counts(now: OpenedDataset) -> list[tuple[str, int]]:
    quality = now.views.table.numbers("quality")
    doubtful = int((quality[~np.isnan(quality)] < SURE).sum())
    records = now.records
    return [
        (f"doubtful plans (quality below {SURE:g})", doubtful),
        ("inputs that gave no plan", len(records.refused)),
        ("duplicates dropped", len(records.repeated)),
    ]


def _sentence(now: OpenedDataset, described: Mapping[str, str]) -> str:
    names, codes = now.views.table.groups["source"]
    counts = Counter(codes[codes >= 0].tolist())
    kinds = ", ".join(
        f"{_KINDS.get(names[code], names[code])} ({count:,})" for code, count in counts.most_common(_FEW_SOURCES)
    )
    if len(counts) > _FEW_SOURCES:
        kinds += f" and others ({counts.total() - sum(count for _, count in counts.most_common(_FEW_SOURCES)):,})"
    count = len(now.views.table)
    told = [f"{count:,} floor plan{'' if count == 1 else 's'}."]
    if kinds:
        told.append(f"{'Source' if len(counts) == 1 else 'Sources'}: {kinds}.")
    if described.get("generator"):
        told.append(f"Made by {described['generator']}.")
    return " ".join(told)


def _read_description(path: Path) -> dict[str, str]:
    """Return the description in a data set's files; a release's files take precedence over the build's manifest."""
    if not path.is_dir():
        return {}
    manifest, croissant = _json(path / "manifest.json"), _json(path / "croissant.json")
    generator, sources = manifest.get("generator"), manifest.get("sources")
    made = [_text(generator.get(key)) for key in ("name", "version")] if isinstance(generator, dict) else []
    # a path would show where somebody keeps files; made houses have none
    named = [_text(each) for each in sources if "/" not in str(each)] if isinstance(sources, list) else []
    own = OWN if isinstance(sources, list) and sources and all(str(each).startswith(MADE) for each in sources) else ""
    found = {
        "generator": " ".join(made),
        "sources": ", ".join(named[:_FEW_SOURCES]),
        "license": _text(croissant.get("license")) or _text(manifest.get("licence")) or own,
        **{key: _text(croissant.get(key)) for key in ("name", "description", "version")},
    }
    return {key: value.strip() for key, value in found.items()}


def _json(file: Path) -> dict[str, Any]:
    try:
        if file.is_symlink():
            return {}
        found = decode_json(read_file(file, _SHOWN_FILE_BYTES), object)
    except (OSError, msgspec.DecodeError):
        return {}
    return found if isinstance(found, dict) else {}


def _text(value: Any) -> str:
    return " ".join(value[:_SHOWN_LETTERS].split()) if isinstance(value, str) else ""


def _spread_evenly(count: int, most: int) -> Sequence[int]:
    """Return up to ``most`` rows, evenly spread over a data set."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int)).tolist() if count else []


def _labels(now: OpenedDataset) -> list[tuple[str, str, int]]:
    """Return the labels that occur, with colour and number of plans, the most frequent first."""
    counts = now.views.table.labels.sum(axis=1).tolist()
    found = [(label, label_colour(label), count) for label, count in zip(LABELS, counts, strict=True) if count]
    return sorted(found, key=lambda each: -each[2])


def _python(opening: str) -> str:
    return (
        "import houseexpo\n\n"
        f"{opening}\n"
        "some = plans.select(rooms=(3, 6), labels=['Kitchen'])\n"
        "some.plot(12)                  # pictures, drawn by matplotlib\n"
        "plans.to_pandas()              # one row per plan\n"
        "plan = some[0]\n"
        "plan.grid(25), plan.graph()    # an occupancy grid, the graph of rooms and doors\n"
    )


def _refused_routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/refused``, what gave no plan and what was dropped, and of its pictures."""

    def page(request: Request) -> Response:
        shown, given = service.collection(request), request.query_params
        now, offset = shown.now, parse_whole_number(given, "offset", 0, _FARTHEST)
        stage, reason = given.get("stage", ""), given.get("reason", "")
        found = now.records.of(stage, reason)
        repeated = now.records.repeated
        listed = found[offset : offset + _LISTED]
        drawn = {each.id for each in listed if rejection_picture_path(shown.path, each.id)}
        pictured = {each.id for each in repeated[:_LISTED] if duplicate_picture_path(shown.path, each.id)}
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
            size=_LISTED,
            repeated=repeated[:_LISTED],
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


def _statistics_routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/statistics`` and of its numbers."""

    def page(request: Request) -> Response:
        query = str(parse_query(request.query_params))
        return service.page(
            request, "statistics.html", shown=service.collection(request), here="statistics", query=query
        )

    def numbers(request: Request) -> Response:
        query = parse_query(request.query_params)
        now, _ = service.collection(request).find(query)
        return json_response(request, query_statistics(now, query))

    return [Route("/{data}/statistics", page), Route("/api/{data}/statistics", numbers)]


def query_statistics(now: OpenedDataset, query: Query) -> dict[str, Any]:
    """Return the statistics of the plans that a query finds."""
    mask = now.views.find(query).mask
    table = now.views.table
    return {
        "total": len(mask),
        "found": int(mask.sum()),
        "measures": {
            each.name: _measure_values(each, table.numbers(each.name, query.radius), mask) for each in MEASURES
        },
        "labels": _label_shares(now, mask),
    }


def _measure_values(measure: Measure, values: Numbers, mask: Any) -> dict[str, Any]:
    bins = choose_bins(values, whole=measure.is_count)
    return {
        "title": measure.title,
        "unit": measure.unit,
        "whole": measure.is_count,
        "first": bins.first,
        "step": bins.step,
        "counts": bins.counts(mask),
        **_summary(values[mask]),
    }


def _summary(values: Numbers) -> dict[str, Any]:
    known = values[~np.isnan(values)]
    if not len(known):
        return {"known": 0}
    names = ("min", "p05", "median", "p95", "max")
    ends = np.quantile(known, (0, 0.05, 0.5, 0.95, 1)).round(4).tolist()
    return {"known": len(known), "mean": round(float(known.mean()), 4), **dict(zip(names, ends, strict=True))}


def _label_shares(now: OpenedDataset, mask: Any) -> dict[str, float]:
    """Return each label's share of all pairs of a plan and a label that occurs in it."""
    counts = (now.views.table.labels & mask).sum(axis=1)
    shares: list[float] = (counts / max(int(counts.sum()), 1)).round(5).tolist()
    return dict(zip(LABELS, shares, strict=True))
