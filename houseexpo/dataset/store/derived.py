"""What is computed of plans and kept: values by the plan's bytes, in one SQLite file of the user's cache.

A value belongs to the SHA-1 of the plan's JSON and to the name under which it was computed; so it is found again in
any data set that holds the same plan, and never for one that has changed. What is done stays done where a run is
stopped.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from functools import partial
from typing import Any, Final

import msgspec

from houseexpo.dataset.store.cache import VERSION, cache_folder
from houseexpo.dataset.store.catalogue import Catalogue
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.processes import in_processes
from houseexpo.progress import watched

Measure = Callable[[FloorPlan], Any]

_COMMIT_S: Final = 2.0
_CHUNK: Final = 16


def derived(catalogue: Catalogue, rows: Sequence[int], name: str, measure: Measure, workers: int = 1) -> list[Any]:
    """Return ``measure(plan)`` for each row, computed where it is not known yet.

    Parameters
    ----------
    name
        What the values are called; another meaning needs another name, or a version in it.
    measure
        From a plan to plain values (what JSON can hold); with several workers, a function that can be pickled.
    workers
        Processes. With more than one, a script needs its ``if __name__ == "__main__"``.
    """
    digests = [catalogue.digest(row) for row in rows]
    with closing(_open()) as database:
        known = _known(database, name)
        missing = {digest: row for digest, row in zip(digests, rows, strict=True) if digest not in known}
        written = time.monotonic()
        found = _computed(((digest, catalogue.read(row)) for digest, row in missing.items()), measure, workers)
        for digest, value in watched(found, f"measuring {catalogue.path.name}", len(missing)):
            known[digest] = value
            database.execute("INSERT OR REPLACE INTO derived VALUES (?, ?, ?)", (name, digest, value))
            if time.monotonic() - written > _COMMIT_S:
                database.commit()
                written = time.monotonic()
        database.commit()
    return [msgspec.json.decode(known[digest]) for digest in digests]


def kept(catalogue: Catalogue, rows: Sequence[int], name: str) -> list[Any]:
    """Return what was computed under ``name`` before, None for a plan of which it was not."""
    with closing(_open()) as database:
        known = _known(database, name)
    if not known:
        return [None] * len(rows)
    found = (known.get(catalogue.digest(row)) for row in rows)
    return [None if value is None else msgspec.json.decode(value) for value in found]


def _open() -> sqlite3.Connection:
    database = sqlite3.connect(cache_folder() / f"derived-{VERSION}.sqlite", timeout=60)
    database.execute("CREATE TABLE IF NOT EXISTS derived (name TEXT, plan TEXT, value BLOB, PRIMARY KEY (name, plan))")
    return database


def _known(database: sqlite3.Connection, name: str) -> dict[str, bytes]:
    return dict(database.execute("SELECT plan, value FROM derived WHERE name = ?", (name,)))


def _computed(plans: Iterable[tuple[str, bytes]], measure: Measure, workers: int) -> Iterator[tuple[str, bytes]]:
    work = partial(_measured, measure)
    if workers <= 1:
        yield from map(work, plans)
        return
    yield from in_processes(work, plans, workers, _CHUNK)


def _measured(measure: Measure, item: tuple[str, bytes]) -> tuple[str, bytes]:
    digest, data = item
    return digest, msgspec.json.encode(measure(decode(data)))
