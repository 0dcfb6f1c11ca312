"""Keep bytes under names and keys in one SQLite file of the user's cache, for measures of plans and for worlds.

R1  A file has a version in its name, so that a file in another layout is never read.
R2  A damaged file is made anew. An entry with a wrong checksum is absent.
R3  If the file cannot be read or written (a full disk, a read-only folder), entries stay in memory, with one warning.
R4  Entries are written together, at the latest after seconds. Threads and processes may share a file. A process that
    was forked opens it again, and leaves the connection that it inherited as it is.
R5  When a file becomes too large, the oldest half of its entries is deleted.
"""

from __future__ import annotations

import logging
import os
import sqlite3
import time
import weakref
import zlib
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Final, TypeVar

_WRITE_S: Final = 2.0  # seconds between two writes
_TIMEOUT_S: Final = 60.0  # seconds that another process may hold the file
_FILE_BYTES: Final = 4_000_000_000  # worlds of 35,000 plans at one resolution take 70 MB
_CHECKSUM_BYTES: Final = 4
_Entries = dict[tuple[str, bytes], bytes]
_INHERITED: Final[list[sqlite3.Connection]] = []
_LOG = logging.getLogger(__name__)
_T = TypeVar("_T")


class DiskCache:
    """The entries of a file, each found by a name and a key; with ``None``, they are only in memory."""

    def __init__(self, file: Path | None) -> None:
        self._file = file
        self._database: tuple[int, sqlite3.Connection] | None = None  # with the process that opened it
        self._fresh: _Entries = {}
        self._written = time.monotonic()
        self.close = weakref.finalize(self, _write_last, file, self._fresh)

    def get(self, name: str, key: bytes) -> bytes | None:
        """Return a value, None if it is absent."""
        value = self._fresh.get((name, key))
        return self._read("name = ? AND key = ?", name, key).get(key) if value is None else value

    def items(self, name: str) -> dict[bytes, bytes]:
        """Return all values under a name, by their keys."""
        fresh = {key: value for (other, key), value in self._fresh.items() if other == name}
        return self._read("name = ?", name) | fresh

    def keys(self, name: str) -> set[bytes]:
        """Return the keys under a name; their values may be damaged."""
        asked = "SELECT CAST(key AS BLOB) FROM entries WHERE name = ?"
        rows = self._use(lambda database: database.execute(asked, (name,)).fetchall()) or []
        return {key for (key,) in rows} | {key for other, key in self._fresh if other == name}

    def put(self, name: str, key: bytes, value: bytes) -> None:
        """Add a value, which is written at once or within a few seconds (R4)."""
        self._fresh[name, key] = value
        if time.monotonic() - self._written > _WRITE_S:
            self.flush()

    def flush(self) -> None:
        """Write the entries that are not written yet."""
        self._written = time.monotonic()
        if not (entries := dict(self._fresh)):
            return
        if self._use(lambda database: _insert(database, entries)):
            for place in entries:
                self._fresh.pop(place, None)

    def write(self, name: str, values: Mapping[bytes, bytes]) -> None:
        """Write values at once; raise sqlite3.Error or OSError if that is impossible."""
        if self._file is not None:
            with closing(_open(self._file)) as database:
                _insert(database, {(name, key): value for key, value in values.items()})

    def _read(self, condition: str, *values: str | bytes) -> dict[bytes, bytes]:
        columns = "CAST(key AS BLOB), CAST(value AS BLOB)"  # damage may change a value's type
        asked = f"SELECT {columns} FROM entries WHERE {condition}"  # noqa: S608  # the conditions stand above
        rows = self._use(lambda database: database.execute(asked, values).fetchall()) or []
        return {key: data[_CHECKSUM_BYTES:] for key, data in rows if data == _verify(data[_CHECKSUM_BYTES:])}  # R2

    def _use(self, work: Callable[[sqlite3.Connection], _T]) -> _T | None:
        """Call ``work`` with the open file; if the file cannot be used (R3), return None and do not use it again."""
        if self._file is None:
            return None
        try:
            try:
                return work(self._open(self._file))
            except sqlite3.Error as error:
                if not _is_damaged(error):
                    raise
            self._database = None
            self._file.unlink(missing_ok=True)  # R2
            return work(self._open(self._file))
        except (sqlite3.Error, OSError) as error:
            _LOG.warning("%s: cannot be used (%s); its entries stay in memory", self._file, error)
            self._file = self._database = None
            return None

    def _open(self, file: Path) -> sqlite3.Connection:
        process = os.getpid()
        if self._database is not None and self._database[0] != process:
            _INHERITED.append(self._database[1])  # R4
            self._database = None
        if self._database is None:
            self._database = process, _open(file)
        return self._database[1]


def _open(file: Path) -> sqlite3.Connection:
    database = sqlite3.connect(file, timeout=_TIMEOUT_S, check_same_thread=False)
    try:
        database.execute(
            "CREATE TABLE IF NOT EXISTS entries (name TEXT, key BLOB, value BLOB, PRIMARY KEY (name, key))"
        )
    except sqlite3.Error as error:
        database.close()
        if not _is_damaged(error):
            raise
        file.unlink(missing_ok=True)
        return _open(file)
    return database


def _insert(database: sqlite3.Connection, entries: _Entries) -> bool:
    rows = ((name, key, _verify(value)) for (name, key), value in entries.items())
    with database:
        database.executemany("INSERT OR REPLACE INTO entries VALUES (?, ?, ?)", rows)
        if _used_bytes(database) > _FILE_BYTES:  # R5
            database.execute("DELETE FROM entries WHERE rowid <= (SELECT (min(rowid) + max(rowid)) / 2 FROM entries)")
    return True


def _used_bytes(database: sqlite3.Connection) -> int:
    pages, free, size = (
        int(database.execute(f"PRAGMA {of}").fetchone()[0]) for of in ("page_count", "freelist_count", "page_size")
    )
    return (pages - free) * size


def _verify(value: bytes) -> bytes:
    """Return a value behind its checksum."""
    return zlib.crc32(value).to_bytes(_CHECKSUM_BYTES, "big") + value


def _write_last(file: Path | None, entries: _Entries) -> None:
    """Write at the end of a program; what cannot be written will be made again."""
    if file is not None and entries:
        with suppress(sqlite3.Error, OSError), closing(_open(file)) as database:
            _insert(database, entries)


def _is_damaged(error: sqlite3.Error) -> bool:
    """Return whether the error means that the file is corrupt or another database, and not a fault of the moment."""
    code: int = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_MISUSE)
    return code & 0xFF in {sqlite3.SQLITE_ERROR, sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}
