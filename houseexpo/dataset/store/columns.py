"""Read columns of a data set, and check the conditions of ``select`` on them.

Published plans do not record all columns; the missing values are computed once and cached.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict
from functools import partial
from numbers import Real
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo.dataset.store.catalogue import Catalogue
from houseexpo.disk_cache import DiskCache
from houseexpo.errors import ConfigError, PlanError
from houseexpo.files import cache_folder
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.processes import map_in_processes
from houseexpo.progress import show_progress
from houseexpo.words import unknown_name_message

Measure = Callable[[FloorPlan], Any]

_PLANS_SENT: Final = 16  # plans that are sent to a process at once
_VALUES_FILE: Final = "values-1.sqlite"


def measure_cached(
    catalogue: Catalogue, rows: Sequence[int], name: str, measure: Measure, workers: int = 1
) -> list[Any]:
    """Return ``measure(plan)`` for each row, computed if it is not cached yet.

    Parameters
    ----------
    name
        The name of the values. Change it, or a version in it, when their meaning changes.
    measure
        A function from a plan to values that JSON can hold. With several workers it must be picklable.
    workers
        Number of processes. With more than one, a script needs ``if __name__ == "__main__"``.
    """
    digests = [bytes.fromhex(catalogue.digest(row)) for row in rows]
    with closing(DiskCache(cache_folder() / _VALUES_FILE)) as values:
        known = values.items(name)
        missing = {digest: row for digest, row in zip(digests, rows, strict=True) if digest not in known}
        plans = ((digest, catalogue.ids[row], catalogue.read(row)) for digest, row in missing.items())
        found = _compute(plans, measure, workers)
        for digest, value in show_progress(found, f"measuring {catalogue.path.name}", len(missing)):
            known[digest] = value
            values.put(name, digest, value)
    return [msgspec.json.decode(known[digest]) for digest in digests]


def cached_values(catalogue: Catalogue, rows: Sequence[int], name: str) -> list[Any]:
    """Return the cached values of ``name``, None for a plan without one."""
    known = DiskCache(cache_folder() / _VALUES_FILE).items(name)
    if not known:
        return [None] * len(rows)
    found = (known.get(bytes.fromhex(catalogue.digest(row))) for row in rows)
    return [None if value is None else msgspec.json.decode(value) for value in found]


def _compute(
    plans: Iterable[tuple[bytes, str, bytes]], measure: Measure, workers: int
) -> Iterator[tuple[bytes, bytes]]:
    work = partial(_measure_encoded, measure)
    if workers <= 1:
        yield from map(work, plans)
        return
    yield from map_in_processes(work, plans, workers, _PLANS_SENT)


def _measure_encoded(measure: Measure, item: tuple[bytes, str, bytes]) -> tuple[bytes, bytes]:
    digest, plan_id, data = item
    try:
        plan = decode(data)
    except PlanError as error:
        raise error.within(plan=plan_id) from None
    return digest, msgspec.json.encode(measure(plan))


_log = logging.getLogger(__name__)

Rows = npt.NDArray[np.int64]

_FOUND: Final = ("rooms", "doors")
"""Columns that are empty for plans that record no rooms, such as published ones; both are found at once."""

_FOUND_NAME: Final = "rooms and doors found, 1"

_COUNTS: Final = ("rooms", "source_rooms", "doors")
"""The conditions for which ``select`` also takes a single number; an area is hardly ever equal to one."""


def read_column(catalogue: Catalogue, rows: Rows, name: str, *, compute: bool = True) -> list[Any]:
    """Return a column of the index for some rows; values that published plans lack are computed if not cached.

    With ``compute=False``, they are None instead.
    """
    if name not in catalogue.table.column_names:
        raise ConfigError(f"column: {unknown_name_message(name, catalogue.table.column_names)}")
    values: list[Any] = catalogue.table.column(name).take(rows).to_pylist()
    if name == "navigability":
        _fill(catalogue, rows, values, "navigability, 2", _navigability, compute=compute)
    elif name in _FOUND:
        counts: list[Any] = [None if value is None else {name: value} for value in values]
        if name == "rooms":
            _count_recorded(catalogue, rows, counts)
        _fill(catalogue, rows, counts, _FOUND_NAME, _found, compute=compute)
        values = [None if count is None else count[name] for count in counts]
    return values


def read_table(catalogue: Catalogue, rows: Rows) -> Any:
    """Return the index for some rows, with the rooms and doors of published plans that were found before."""
    import pyarrow as pa

    table = catalogue.table.take(rows)
    for name in _FOUND:
        if table.column(name).null_count:
            at = table.schema.get_field_index(name)
            values = read_column(catalogue, rows, name, compute=False)
            table = table.set_column(at, table.schema.field(at), pa.array(values, table.schema.field(at).type))
    return table


def warn_if_unknown(catalogue: Catalogue, rows: Rows, name: str, condition: str) -> None:
    """Warn that no plan can meet a condition since none has a value in a column."""
    if len(rows) and np.isnan(catalogue.numbers(name)[rows]).all():
        _log.warning("select: %s: no plan has a value in the column %r, so none is selected", condition, name)


def largest_area_shares(catalogue: Catalogue, rows: Rows, radius: float) -> npt.NDArray[np.float64]:
    """Return the share of the largest connected area for a disc; it is measured if the index does not record it."""
    key = f"{radius:.2f}"
    values: list[float | None] = [None] * len(rows)
    if float(key) == radius:
        recorded = catalogue.table.column("navigability").take(rows).to_pylist()
        values = [reach[key]["largest_share"] if reach and reach.get(key) else None for reach in recorded]
    _fill(catalogue, rows, values, f"share at {radius!r} m, 1", partial(_share, radius))
    return np.array(values, dtype=np.float64)


def parse_label(word: str) -> str:
    """Return the label that a word spells in any way; raise ConfigError if it is not a label."""
    from houseexpo.plan.room_labels import LABELS, canonical

    found = canonical(word)
    if found is None:
        raise ConfigError(f"select: labels: {unknown_name_message(word, LABELS)}")
    return found


def parse_labels(words: Iterable[str]) -> set[str]:
    """Return the labels that words spell; a single string is one label; raise ConfigError for a mapping."""
    if isinstance(words, Mapping):
        raise ConfigError(
            f"select: labels: expected labels that must occur, found a mapping, {words!r}; to count them, use "
            "where=lambda plan: sum(room.label == 'Bedroom' for room in plan.divided.rooms) == 2"
        )
    return {parse_label(word) for word in ([words] if isinstance(words, str) else words)}


def required_share(robot_radius: float | None, min_connected: float | None) -> float:
    """Return the share that the largest connected area must have; raise ConfigError for an invalid combination."""
    if robot_radius is None and min_connected is not None:
        raise ConfigError("select: min_connected needs a robot_radius")
    if robot_radius is not None and not (_is_number(robot_radius) and 0 <= robot_radius < math.inf):
        raise ConfigError(f"select: robot_radius: expected metres, 0 or more, found {robot_radius!r}")
    return 1.0 if min_connected is None else check_least_share(min_connected, "min_connected")


def check_least_share(value: float, name: str) -> float:
    """Return a number from 0 to 1; raise ConfigError for anything else."""
    if not (_is_number(value) and 0 <= value <= 1):
        raise ConfigError(f"select: {name}: expected 0 to 1, found {value!r}")
    return value


def are_within_limits(values: npt.NDArray[np.float64], limits: Any, name: str) -> npt.NDArray[np.bool_]:
    """Return whether each value lies within the limits, None for no limit; for a count, a single number is allowed."""
    low, high = _ends(limits, name)
    if low is not None and high is not None and low > high:
        raise ConfigError(f"select: {name}: expected from <= to, found {low} > {high}")
    inside = np.ones(len(values), dtype=bool)
    if low is not None:
        inside &= values >= low
    if high is not None:
        inside &= values <= high
    return inside


def _ends(limits: Any, name: str) -> tuple[float | None, float | None]:
    is_count = name in _COUNTS
    try:
        low, high = (limits, limits) if is_count and _is_number(limits) else limits
    except (TypeError, ValueError):
        low = high = math.nan
    if not all(end is None or _is_number(end) for end in (low, high)):
        single = "a number, or " if is_count else ""
        raise ConfigError(f"select: {name}: expected {single}(from, to), None for an open end; found {limits!r}")
    return low, high


def _is_number(value: object) -> bool:
    """Return whether this is a number, possibly of NumPy, and not NaN."""
    return not isinstance(value, bool) and isinstance(value, Real) and not math.isnan(value)


def _fill(
    catalogue: Catalogue,
    rows: Rows,
    values: list[Any],
    name: str,
    measure: Callable[[FloorPlan], Any],
    *,
    compute: bool = True,
) -> None:
    """Fill in the values that are None, from the cache or, with ``compute``, by measuring.

    They are cached under ``name``, which must change with the computation.
    """
    missing = [i for i, value in enumerate(values) if value is None]
    if not missing:
        return
    of = rows[missing].tolist()
    found = measure_cached(catalogue, of, name, measure) if compute else cached_values(catalogue, of, name)
    for i, value in zip(missing, found, strict=True):
        values[i] = value


def _count_recorded(catalogue: Catalogue, rows: Rows, counts: list[Any]) -> None:
    """Fill in the rooms that plans record although the index, of the last version, lacks them.

    The doors of such a plan are in the index. Reading a plan takes less than a millisecond.
    """
    has_doors = catalogue.table.column("doors").is_valid().take(rows).to_pylist()
    lacking = [i for i, count in enumerate(counts) if count is None and has_doors[i]]
    found: list[Any] = [None] * len(lacking)
    _fill(catalogue, rows[lacking], found, _FOUND_NAME, _found)
    for i, count in zip(lacking, found, strict=True):
        counts[i] = count


def _share(radius: float, plan: FloorPlan) -> float:
    return plan.navigability(radius).largest_share


def _navigability(plan: FloorPlan) -> dict[str, dict[str, float]]:
    from houseexpo.analysis.navigability import navigability

    return {radius: asdict(found) for radius, found in navigability(plan).items()}


def _found(plan: FloorPlan) -> dict[str, int]:
    return {"rooms": len(plan.divided.rooms), "doors": len(plan.divided.doors)}
