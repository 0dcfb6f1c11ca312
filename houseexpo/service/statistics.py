"""Serve statistics of the plans that a query finds."""

from __future__ import annotations

from typing import Any

import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.analysis.measures import Measure
from houseexpo.plan.room_labels import LABELS
from houseexpo.service.collection import OpenedDataset
from houseexpo.service.responses import json_response
from houseexpo.service.search import MEASURES, Numbers, Query, choose_bins, parse_query
from houseexpo.service.service import Service


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of the page and of its numbers."""

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
