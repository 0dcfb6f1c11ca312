"""Cache results for plans by the plans' bytes (``houseexpo.disk_cache``), so that any data set finds them again.

The key of a value is the SHA-1 of the plan's JSON and the name of the computation. The value is found again in any data
set that contains the same plan, and never for a plan that has changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from functools import partial
from typing import Any, Final

import msgspec

from houseexpo.dataset.store.catalogue import Catalogue
from houseexpo.disk_cache import DiskCache
from houseexpo.errors import PlanError
from houseexpo.files import cache_folder
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.processes import map_in_processes
from houseexpo.progress import show_progress

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
