"""Cache of values computed from plans, in one SQLite file of the user's cache.

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
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

from houseexpo.dataset.store.cache import VERSION
from houseexpo.files import cache_folder

_COMMIT_S: Final = 2.0
_TIMEOUT_S: Final = 60.0
_LOG = logging.getLogger(__name__)
_T = TypeVar("_T")


class Values:
    """The open file. One process may open it several times, and so may several processes at once."""

    def __init__(self) -> None:
        self._file = cache_folder() / f"derived-{VERSION}.sqlite"
        self._database: sqlite3.Connection | None = None
        self._committed = time.monotonic()
        self._database = self._tried(lambda: _opened(self._file))

    def known(self, name: str) -> dict[str, bytes]:
        """Return the values under a name, by the plans' digests."""
        if (database := self._database) is None:
            return {}
        asked = "SELECT plan, value FROM derived WHERE name = ?"
        return self._tried(lambda: dict(database.execute(asked, (name,)))) or {}

    def keep(self, name: str, digest: str, value: bytes) -> None:
        """Save a value, at once or within a few seconds (R2)."""
        if (database := self._database) is None:
            return

        def write() -> None:
            database.execute("INSERT OR REPLACE INTO derived VALUES (?, ?, ?)", (name, digest, value))
            if time.monotonic() - self._committed > _COMMIT_S:
                database.commit()
                self._committed = time.monotonic()

        self._tried(write)

    def close(self) -> None:
        """Write all values that have not been written yet, and close the file."""
        if (database := self._database) is not None:
            self._tried(database.commit)
            database.close()

    def _tried(self, work: Callable[[], _T]) -> _T | None:
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


def _opened(file: Path) -> sqlite3.Connection:
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
        return _opened(file)
    return database


def _is_damaged(error: sqlite3.Error) -> bool:
    """Return whether the error means that the file is not a database or is corrupt; subclasses mean other faults."""
    return type(error) is sqlite3.DatabaseError
