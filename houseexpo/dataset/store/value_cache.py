"""Cache results for plans by the plans' bytes, in one SQLite file, so that they are found again in any data set.

R1  The key of a value is the SHA-1 of the plan's JSON and the name of the computation. The value is found again in any
    data set that contains the same plan, and never for a plan that has changed.
R2  Values that were computed remain if a run is stopped.
R3  The file is a cache. If it is damaged, it is created anew. If it cannot be read or written (a full disk), nothing is
    found or kept, and the log has a warning.
"""

from __future__ import annotations

import logging
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from houseexpo.dataset.store.cache import VERSION
from houseexpo.dataset.store.catalogue import Catalogue
from houseexpo.files import cache_folder
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.processes import map_in_processes
from houseexpo.progress import show_progress

Measure = Callable[[FloorPlan], Any]

_PLANS_SENT: Final = 16  # plans that are sent to a process at once
_COMMIT_S: Final = 2.0  # seconds between two commits
_TIMEOUT_S: Final = 60.0  # seconds that another process may hold the file
_LOG = logging.getLogger(__name__)
_T = TypeVar("_T")


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
    digests = [catalogue.digest(row) for row in rows]
    with closing(_Values()) as values:
        known = values.read(name)
        missing = {digest: row for digest, row in zip(digests, rows, strict=True) if digest not in known}
        found = _compute(((digest, catalogue.read(row)) for digest, row in missing.items()), measure, workers)
        for digest, value in show_progress(found, f"measuring {catalogue.path.name}", len(missing)):
            known[digest] = value
            values.keep(name, digest, value)
    return [msgspec.json.decode(known[digest]) for digest in digests]


def cached_values(catalogue: Catalogue, rows: Sequence[int], name: str) -> list[Any]:
    """Return the cached values of ``name``, None for a plan without one."""
    with closing(_Values()) as values:
        known = values.read(name)
    if not known:
        return [None] * len(rows)
    found = (known.get(catalogue.digest(row)) for row in rows)
    return [None if value is None else msgspec.json.decode(value) for value in found]


def _compute(plans: Iterable[tuple[str, bytes]], measure: Measure, workers: int) -> Iterator[tuple[str, bytes]]:
    work = partial(_measure_encoded, measure)
    if workers <= 1:
        yield from map(work, plans)
        return
    yield from map_in_processes(work, plans, workers, _PLANS_SENT)


def _measure_encoded(measure: Measure, item: tuple[str, bytes]) -> tuple[str, bytes]:
    digest, data = item
    return digest, msgspec.json.encode(measure(decode(data)))


class _Values:
    """The open file. One process may open it several times, and so may several processes at once."""

    def __init__(self) -> None:
        self._file = cache_folder() / f"derived-{VERSION}.sqlite"
        self._database: sqlite3.Connection | None = None
        self._committed = time.monotonic()
        self._database = self._try(lambda: _open(self._file))

    def read(self, name: str) -> dict[str, bytes]:
        """Return the values under a name, by the plans' digests."""
        if (database := self._database) is None:
            return {}
        asked = "SELECT plan, value FROM derived WHERE name = ?"
        return self._try(lambda: dict(database.execute(asked, (name,)))) or {}

    def keep(self, name: str, digest: str, value: bytes) -> None:
        """Save a value, at once or within a few seconds (R2)."""
        if (database := self._database) is None:
            return

        def write() -> None:
            database.execute("INSERT OR REPLACE INTO derived VALUES (?, ?, ?)", (name, digest, value))
            if time.monotonic() - self._committed > _COMMIT_S:
                database.commit()
                self._committed = time.monotonic()

        self._try(write)

    def close(self) -> None:
        """Write all values that have not been written yet, and close the file."""
        if (database := self._database) is not None:
            self._try(database.commit)
            database.close()

    def _try(self, work: Callable[[], _T]) -> _T | None:
        """Call ``work``; if the file cannot be used (R3), return None and do not use it again."""
        try:
            return work()
        except sqlite3.Error as error:
            _LOG.warning("%s: cannot be used (%s); measurements are not cached", self._file, error)
            if self._database is not None:
                self._database.close()
                self._database = None
            if _is_damaged(error):
                self._file.unlink(missing_ok=True)
            return None


def _open(file: Path) -> sqlite3.Connection:
    database = sqlite3.connect(file, timeout=_TIMEOUT_S)
    try:
        database.execute(
            "CREATE TABLE IF NOT EXISTS derived (name TEXT, plan TEXT, value BLOB, PRIMARY KEY (name, plan))"
        )
    except sqlite3.Error as error:
        database.close()
        if not _is_damaged(error):
            raise
        file.unlink(missing_ok=True)
        return _open(file)
    return database


def _is_damaged(error: sqlite3.Error) -> bool:
    """Return whether the error means that the file is not a database or is corrupt; subclasses mean other faults."""
    return type(error) is sqlite3.DatabaseError
