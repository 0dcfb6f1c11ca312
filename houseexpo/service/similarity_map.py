"""Compute and serve a map of a data set: a point in the unit square for each plan, similar plans near each other.

1. The features of a plan are its measures (logarithms of sizes, so that doubling is the same step everywhere) and its
   labels.
2. Principal components keep the directions in which plans differ most.
3. Each plan is connected to its nearest neighbours. The map starts with the first two components; then connected plans
   attract each other, and random others repel each other, in shrinking steps. The scheme is that of UMAP (McInnes,
   Healy, Melville 2018).

The map of a data set is the same each time.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.service.computations import compute_in_turn
from houseexpo.service.lru_cache import LruCache
from houseexpo.service.responses import json_response
from houseexpo.service.search import MeasureTable, parse_query
from houseexpo.service.service import Service

Floats = npt.NDArray[np.float64]

SIZES: Final = ("area", "long_side", "short_side", "source_rooms", "vertices")
_COLOURED: Final = ("rooms", "source_rooms", "area", "quality", "doors")
_COMPONENTS: Final = 10
_NEIGHBOURS: Final = 10
_EPOCHS: Final = 80
_STRANGERS: Final = 3
"""Random plans that repel a plan in each step."""
_LABELS: Final = 0.8
"""The weight of a label; a standard deviation of a measure has 1."""
_NEAR: Final = 1e-3
"""Keeps the repulsion of equal points finite."""
_STEP: Final = 4.0
"""The longest step of a coordinate."""
_FENCE: Final = 2.0
"""Plans farther than this number of interquartile ranges from the middle half lie at the edge of the map."""
_KEPT: Final = 8
"""Maps that stay in memory."""


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/map`` and of its positions."""
    maps: LruCache[Floats] = LruCache(_KEPT)

    def page(request: Request) -> Response:
        query = str(parse_query(request.query_params))
        return service.page(request, "map.html", shown=service.collection(request), here="map", query=query)

    async def places(request: Request) -> Response:
        query = parse_query(request.query_params)
        now, view = service.collection(request).find(query)
        table = now.views.table
        found = await compute_in_turn(
            request, lambda: maps.get_or_make(now.number, lambda: lay_out_by_similarity(plan_features(table)))
        )
        columns = {name: _plain(table.numbers(name)) for name in _COLOURED}
        answer: dict[str, Any] = {
            "ids": list(table.ids),
            "titles": [table.title(row) for row in range(len(table))],
            "x": found[:, 0].round(4).tolist(),
            "y": found[:, 1].round(4).tolist(),
            "colours": {name: column for name, column in columns.items() if any(each is not None for each in column)},
            "found": np.flatnonzero(view.mask).tolist() if len(view.rows) < len(table) else None,
        }
        return json_response(request, answer)

    return [Route("/{data}/map", page), Route("/api/{data}/map", places)]


def plan_features(table: MeasureTable) -> Floats:
    """Return the features of plans (n, features): measures in standard deviations, and labels."""
    columns = [np.log1p(table.numbers(name)) for name in SIZES]
    columns.append(table.numbers("area") / np.maximum(table.numbers("long_side") * table.numbers("short_side"), 1e-6))
    columns.append(table.numbers("short_side") / np.maximum(table.numbers("long_side"), 1e-6))
    found = []
    for column in columns:
        known = column[np.isfinite(column)]
        if len(known) and known.std() > 0:
            filled = np.where(np.isfinite(column), column, np.median(known))
            found.append(np.clip((filled - known.mean()) / known.std(), -4.0, 4.0))
    labels = table.labels.T.astype(np.float64) * _LABELS
    return np.column_stack([*found, labels]) if found else labels


def lay_out_by_similarity(features: Floats) -> Floats:
    """Return a position (n, 2) in the unit square for each row of features (n, k)."""
    from scipy.spatial import cKDTree

    count = len(features)
    if count < 3:
        return np.column_stack([np.linspace(0.3, 0.7, count), np.full(count, 0.5)])
    components = _components(features)
    near = cKDTree(components).query(components, min(_NEIGHBOURS + 1, count))[1]
    one = np.repeat(np.arange(count), near.shape[1] - 1)
    other = near[:, 1:].ravel()
    places = components[:, :2] / max(float(components[:, :2].std()), 1e-9) * 5.0
    rng = np.random.default_rng(0)
    places += rng.normal(0.0, 1e-3, places.shape)  # so that equal plans are separate points
    for epoch in range(_EPOCHS):
        rate = 1.0 - epoch / _EPOCHS
        apart = places[one] - places[other]
        square = np.sum(apart**2, axis=1, keepdims=True)
        pull = np.clip(2.0 * apart / (1.0 + square), -_STEP, _STEP)
        moved = -_sum_by_row(one, pull, count) + _sum_by_row(other, pull, count)
        for _ in range(_STRANGERS):
            stranger = rng.integers(0, count, count)
            apart = places - places[stranger]
            square = np.sum(apart**2, axis=1, keepdims=True)
            moved += np.clip(_NEIGHBOURS * apart / ((_NEAR + square) * (1.0 + square)), -_STEP, _STEP)
        places = places + 0.1 * rate * np.clip(moved, -10 * _STEP, 10 * _STEP)
    low, first, third, high = np.quantile(places, (0.002, 0.25, 0.75, 0.998), axis=0)
    fence = _FENCE * (third - first)
    low, high = np.maximum(low, first - fence), np.minimum(high, third + fence)
    inside = np.clip((places - low) / np.maximum(high - low, 1e-9), -0.02, 1.02)
    return np.asarray(0.04 + 0.92 * inside)


def _components(features: Floats) -> Floats:
    """Return the first principal components of the rows, with signs that make each largest weight positive."""
    centred = features - features.mean(axis=0)
    weights = np.linalg.eigh(centred.T @ centred)[1][:, ::-1][:, : max(min(_COMPONENTS, features.shape[1]), 2)]
    weights = weights * np.sign(weights[np.abs(weights).argmax(axis=0), np.arange(weights.shape[1])])
    return np.asarray(centred @ weights)


def _sum_by_row(rows: npt.NDArray[Any], steps: Floats, count: int) -> Floats:
    return np.column_stack([np.bincount(rows, steps[:, axis], count) for axis in (0, 1)])


def _plain(column: Floats) -> list[float | None]:
    return [None if np.isnan(value) else round(float(value), 3) for value in column]
