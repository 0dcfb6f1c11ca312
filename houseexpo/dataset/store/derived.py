"""Cache results for plans (``values``) by the plans' bytes, so that they are found again in any data set."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from functools import partial
from typing import Any, Final

import msgspec

from houseexpo.dataset.store.catalogue import Catalogue
from houseexpo.dataset.store.values import Values
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.processes import in_processes
from houseexpo.progress import watched

Measure = Callable[[FloorPlan], Any]

_CHUNK: Final = 16


def derived(catalogue: Catalogue, rows: Sequence[int], name: str, measure: Measure, workers: int = 1) -> list[Any]:
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
    digests = [catalogue.digest(row) for row in rows]
    with closing(Values()) as values:
        known = values.known(name)
        missing = {digest: row for digest, row in zip(digests, rows, strict=True) if digest not in known}
        found = _computed(((digest, catalogue.read(row)) for digest, row in missing.items()), measure, workers)
        for digest, value in watched(found, f"measuring {catalogue.path.name}", len(missing)):
            known[digest] = value
            values.keep(name, digest, value)
    return [msgspec.json.decode(known[digest]) for digest in digests]


def kept(catalogue: Catalogue, rows: Sequence[int], name: str) -> list[Any]:
    """Return the cached values of ``name``, None for a plan without one."""
    with closing(Values()) as values:
        known = values.known(name)
    if not known:
        return [None] * len(rows)
    found = (known.get(catalogue.digest(row)) for row in rows)
    return [None if value is None else msgspec.json.decode(value) for value in found]


def _computed(plans: Iterable[tuple[str, bytes]], measure: Measure, workers: int) -> Iterator[tuple[str, bytes]]:
    work = partial(_measured, measure)
    if workers <= 1:
        yield from map(work, plans)
        return
    yield from in_processes(work, plans, workers, _CHUNK)


def _measured(measure: Measure, item: tuple[str, bytes]) -> tuple[str, bytes]:
    digest, data = item
    return digest, msgspec.json.encode(measure(decode(data)))
