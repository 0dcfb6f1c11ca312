"""Serve statistics of the plans that a query finds, alone or beside another data set.

As in ``houseexpo stats --compare``, the distance of two means is in standard deviations of the other data set, and that
of labels is their total variation (half the sum of the differences of the shares).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.analysis.measures import Measure
from houseexpo.errors import ConfigError
from houseexpo.plan.room_labels import LABELS
from houseexpo.service.collection import OpenedDataset
from houseexpo.service.responses import json_response
from houseexpo.service.search import MEASURES, HistogramBins, Numbers, Query, choose_bins, parse_query
from houseexpo.service.service import Service

_BESIDE: Final = ("against",)


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of the page and of its numbers."""

    def page(request: Request) -> Response:
        shown, query = service.collection(request), parse_query(request.query_params, _BESIDE)
        against = _against(service, request)
        others = [name for name in service.collections if name != shown.name]
        given: dict[str, Any] = {"query": str(query), "others": others, "against": against}
        return service.page(request, "statistics.html", shown=shown, here="statistics", **given)

    def numbers(request: Request) -> Response:
        query = parse_query(request.query_params, _BESIDE)
        now, _ = service.collection(request).find(query)
        against = _against(service, request)
        other = service.collections[against].now if against else None
        return json_response(request, query_statistics(now, query, other))

    return [
        Route("/{data}/statistics", page),
        Route("/api/{data}/statistics", numbers),
    ]


def query_statistics(now: OpenedDataset, query: Query, other: OpenedDataset | None = None) -> dict[str, Any]:
    """Return the statistics of the plans that a query finds; ``other`` is a whole data set for comparison."""
    mask = now.views.find(query).mask
    there = None if other is None else np.ones(len(other.views.table), dtype=bool)
    measures = {}
    for measure in MEASURES:
        values = now.views.table.numbers(measure.name, query.radius)
        beside = None if other is None else other.views.table.numbers(measure.name, query.radius)
        measures[measure.name] = _measure_values(measure, values, mask, beside)
    labels = _label_shares(now, mask)
    found: dict[str, Any] = {"total": len(mask), "found": int(mask.sum()), "measures": measures, "labels": labels}
    if other is not None and there is not None:
        found["other"] = {"found": len(there), "labels": (beside_labels := _label_shares(other, there))}
        found["labels_distance"] = round(sum(abs(labels[label] - beside_labels[label]) for label in LABELS) / 2, 4)
    return found


def _measure_values(measure: Measure, values: Numbers, mask: Any, beside: Numbers | None) -> dict[str, Any]:
    bins = choose_bins(values if beside is None else np.concatenate([values, beside]), whole=measure.is_count)
    here = HistogramBins(bins.first, bins.step, bins.number, bins.of[: len(values)])
    found = {
        "title": measure.title,
        "unit": measure.unit,
        "whole": measure.is_count,
        "first": bins.first,
        "step": bins.step,
        "counts": here.counts(mask),
        **_summary(values[mask]),
    }
    if beside is not None:
        there = HistogramBins(bins.first, bins.step, bins.number, bins.of[len(values) :])
        found["other"] = {"counts": there.counts(np.ones(len(beside), dtype=bool)), **_summary(beside)}
        spread = float(np.nanstd(beside)) if (~np.isnan(beside)).any() else 0.0
        means = found.get("mean"), found["other"].get("mean")
        if spread > 0 and None not in means:
            found["distance"] = round(abs(means[0] - means[1]) / spread, 3)
    return found


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


def _against(service: Service, request: Request) -> str:
    name = request.query_params.get("against", "")
    if name and name not in service.collections:
        raise ConfigError(f"against: expected one of {', '.join(service.collections)}, found {name[:40]!r}")
    return name
