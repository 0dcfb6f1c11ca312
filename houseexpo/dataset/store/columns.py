"""Columns of a data set: those of its index, and those that published plans lack and that are computed and kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.dataset.store.catalogue import Catalogue, nearest
from houseexpo.dataset.store.derived import derived, kept
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan

Rows = npt.NDArray[np.int64]


def column(catalogue: Catalogue, rows: Rows, name: str, *, compute: bool = True) -> list[Any]:
    """Return a column of the index for some rows; what published plans lack is computed where it is absent.

    ``compute`` False: what would have to be computed is None.
    """
    if name not in catalogue.table.column_names:
        raise ConfigError(f"column: {nearest(name, catalogue.table.column_names)}")
    values: list[Any] = catalogue.table.column(name).take(rows).to_pylist()
    if name in _MEASURES and compute:
        _fill(catalogue, rows, values, *_MEASURES[name])
    elif name in _MEASURES:
        missing = [i for i, value in enumerate(values) if value is None]
        for i, value in zip(missing, kept(catalogue, rows[missing].tolist(), _MEASURES[name][0]), strict=True):
            values[i] = value
    return values


def shares(catalogue: Catalogue, rows: Rows, radius: float) -> npt.NDArray[np.float64]:
    """Return the share of the biggest piece in which a disc can stand; measured where the index does not record it."""
    key = f"{radius:.2f}"
    values: list[float | None] = [None] * len(rows)
    if float(key) == radius:
        recorded = catalogue.table.column("navigability").take(rows).to_pylist()
        values = [reach[key]["largest_share"] if reach and reach.get(key) else None for reach in recorded]
    _fill(catalogue, rows, values, f"share at {radius!r} m, 1", partial(_share, radius))
    return np.array(values, dtype=np.float64)


def known_label(word: str) -> str:
    """Return the label that a word stands for, spelt in any way; ConfigError where it is none."""
    from houseexpo.plan.categories import LABELS, canonical

    found = canonical(word)
    if found is None:
        raise ConfigError(f"select: labels: {nearest(word, LABELS)}")
    return found


def within(values: npt.NDArray[np.float64], limits: Any, name: str) -> npt.NDArray[np.bool_]:
    """Whether each value is the number given, or lies between the two given; None leaves an end open."""
    low, high = (limits, limits) if isinstance(limits, int | float) else limits
    if low is not None and high is not None and low > high:
        raise ConfigError(f"select: {name}: expected from <= to, found {low} > {high}")
    inside = np.ones(len(values), dtype=bool)
    if low is not None:
        inside &= values >= low
    if high is not None:
        inside &= values <= high
    return inside


def _fill(catalogue: Catalogue, rows: Rows, values: list[Any], name: str, measure: Callable[[FloorPlan], Any]) -> None:
    missing = [i for i, value in enumerate(values) if value is None]
    if not missing:
        return
    found = derived(catalogue, rows[missing].tolist(), name, measure)
    for i, value in zip(missing, found, strict=True):
        values[i] = value


def _share(radius: float, plan: FloorPlan) -> float:
    return plan.navigability(radius).largest_share


def _navigability(plan: FloorPlan) -> dict[str, dict[str, float]]:
    from houseexpo.analysis.navigability import navigability

    return {radius: asdict(found) for radius, found in navigability(plan).items()}


def _doors(plan: FloorPlan) -> int:
    return len(plan.divided.doors)


_MEASURES: Final[dict[str, tuple[str, Callable[[FloorPlan], Any]]]] = {
    "navigability": ("navigability, 2", _navigability),
    "n_doors": ("doors found, 1", _doors),
}
"""Under which name the values are kept (another way of computing needs another name), and how they are computed."""
