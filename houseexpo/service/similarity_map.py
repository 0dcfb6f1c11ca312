"""Compute and serve a map of a data set: a point in the unit square for each plan, similar plans near each other.

1. The features of a plan are its measures (logarithms of sizes, so that doubling is the same step everywhere) and its
   labels.
2. Principal components keep the directions in which plans differ most.
3. Each plan is connected to its nearest neighbours. The map starts with the first two components; then connected plans
   attract each other, and random others repel each other, in shrinking steps. The scheme is that of UMAP (McInnes,
   Healy, Melville 2018).

The map of a data set is the same each time. The last step takes seconds for tens of thousands of plans. Until a thread
has made the map, the page shows the first two components. The map is then kept in the user's cache, by its features.
"""

from __future__ import annotations

import hashlib
import io
import logging
import threading
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.files import cache_folder, write_atomically
from houseexpo.lru_cache import LruCache
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
_LEAST_SQUARE: Final = 1e-3
"""Keeps the repulsion of equal points finite."""
_LONGEST_STEP: Final = 4.0
"""The longest step of a coordinate."""
_FENCE: Final = 2.0
"""Plans farther than this number of interquartile ranges from the middle half lie at the edge of the map."""
_MAPS_KEPT: Final = 8
"""Maps that stay in memory."""
_VERSION: Final = "1"
"""Part of the place of maps in the cache; change it when the layout changes."""
_LARGE: Final = 2000
"""A map of so many plans takes half a second; the first components are shown only for more."""
_LOG: Final = logging.getLogger(__name__)


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/map`` and of its positions."""
    maps: LruCache[SimilarityMap] = LruCache(_MAPS_KEPT)

    def page(request: Request) -> Response:
        query = str(parse_query(request.query_params))
        return service.page(request, "map.html", shown=service.collection(request), here="map", query=query)

    def places(request: Request) -> Response:
        query = parse_query(request.query_params)
        now, view = service.collection(request).find(query)
        table = now.views.table
        drawn = maps.get_or_make(now.number, lambda: SimilarityMap(table))
        found, is_final = drawn.positions()
        columns = {name: _plain(table.numbers(name)) for name in _COLOURED}
        answer: dict[str, Any] = {
            "ids": list(table.ids),
            "titles": drawn.titles,
            "x": found[:, 0].round(4).tolist(),
            "y": found[:, 1].round(4).tolist(),
            "final": is_final,
            "colours": {name: column for name, column in columns.items() if any(each is not None for each in column)},
            "found": np.flatnonzero(view.mask).tolist() if len(view.rows) < len(table) else None,
        }
        return json_response(request, answer)

    return [Route("/{data}/map", page), Route("/api/{data}/map", places)]


class SimilarityMap:
    """The map of one data set: made once, in a thread if that takes long, and kept in the user's cache."""

    def __init__(self, table: MeasureTable) -> None:
        self._table = table
        self._features = plan_features(table)
        self._places: Floats | None = None
        self._starting = threading.Lock()
        self._thread: threading.Thread | None = None

    def positions(self) -> tuple[Floats, bool]:
        """Return the position (n, 2) of each plan, and whether the positions are final rather than a preview."""
        with self._starting:
            if self._places is None:
                self._places = _read_kept(self._file, len(self._features))
            if self._places is None and len(self._features) <= _LARGE:
                self._make()
            elif self._places is None and self._thread is None:
                self._thread = threading.Thread(target=self._make, daemon=True)
                self._thread.start()
        places = self._places
        return (self._first_sight, not self._is_being_made) if places is None else (places, True)

    @cached_property
    def titles(self) -> list[str]:
        """The plans' names on pages."""
        return [self._table.title(row) for row in range(len(self._table))]

    @property
    def _is_being_made(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _make(self) -> None:
        places = lay_out_by_similarity(self._features)
        self._places = places
        stream = io.BytesIO()
        np.save(stream, places)
        try:
            write_atomically(self._file, stream.getvalue())
        except OSError as error:
            _LOG.warning("%s: cannot be written (%s); the map is made again next time", self._file, error.strerror)

    @property
    def _file(self) -> Path:
        return cache_folder("maps", _VERSION) / f"{hashlib.sha256(self._features.tobytes()).hexdigest()}.npy"

    @cached_property
    def _first_sight(self) -> Floats:
        return _to_unit_square(_components(self._features)[:, :2])


def _read_kept(file: Path, count: int) -> Floats | None:
    """Return the map of ``count`` plans in a file of the cache, or None if no valid file exists."""
    try:
        found = np.asarray(np.load(file, allow_pickle=False), dtype=np.float64)
    except (OSError, ValueError, EOFError):
        return None
    return found if found.shape == (count, 2) and np.isfinite(found).all() else None


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
        pull = np.clip(2.0 * apart / (1.0 + square), -_LONGEST_STEP, _LONGEST_STEP)
        moved = -_sum_by_row(one, pull, count) + _sum_by_row(other, pull, count)
        for _ in range(_STRANGERS):
            stranger = rng.integers(0, count, count)
            apart = places - places[stranger]
            square = np.sum(apart**2, axis=1, keepdims=True)
            moved += np.clip(
                _NEIGHBOURS * apart / ((_LEAST_SQUARE + square) * (1.0 + square)), -_LONGEST_STEP, _LONGEST_STEP
            )
        places = places + 0.1 * rate * np.clip(moved, -10 * _LONGEST_STEP, 10 * _LONGEST_STEP)
    return _to_unit_square(places)


def _to_unit_square(places: Floats) -> Floats:
    """Return positions in the unit square; plans far from the others lie at its edge."""
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
