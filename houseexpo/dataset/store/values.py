"""Values that were computed of plans, in one SQLite file of the user's cache.

R1  A value belongs to the SHA-1 of the plan's JSON and to the name under which it was computed: it is found again in
    any data set that holds the same plan, and never for one that has changed.
R2  What is done stays done where a run is stopped.
R3  The file is a cache. Where it is damaged it is made anew; where it cannot be read or written (a full disk), nothing
    is known, nothing is kept, and a warning in the log says so.
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
    """The file; one process may have it open several times, and several processes at once."""

    def __init__(self) -> None:
        self._file = cache_folder() / f"derived-{VERSION}.sqlite"
        self._database: sqlite3.Connection | None = None
        self._committed = time.monotonic()
        self._database = self._tried(lambda: _opened(self._file))

    def known(self, name: str) -> dict[str, bytes]:
        """Return what is kept under a name, by the plans' digests."""
        if (database := self._database) is None:
            return {}
        asked = "SELECT plan, value FROM derived WHERE name = ?"
        return self._tried(lambda: dict(database.execute(asked, (name,)))) or {}

    def keep(self, name: str, digest: str, value: bytes) -> None:
        """Write a value, now or within some seconds (R2)."""
        if (database := self._database) is None:
            return

        def write() -> None:
            database.execute("INSERT OR REPLACE INTO derived VALUES (?, ?, ?)", (name, digest, value))
            if time.monotonic() - self._committed > _COMMIT_S:
                database.commit()
                self._committed = time.monotonic()

        self._tried(write)

    def close(self) -> None:
        """Write what is not written yet."""
        if (database := self._database) is not None:
            self._tried(database.commit)
            database.close()

    def _tried(self, work: Callable[[], _T]) -> _T | None:
        """Do some work; where the file cannot be used (R3), return None, and leave it alone from now on."""
        try:
            return work()
        except sqlite3.Error as error:
            _LOG.warning("%s: cannot be used (%s); what is measured is not kept", self._file, error)
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
    """Whether the file is no database, or has lost its order; errors of a class of their own mean something else."""
    return type(error) is sqlite3.DatabaseError
