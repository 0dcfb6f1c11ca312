"""Append a line to ``journal.jsonl`` for each input that is done, never change one, and return an input's last.

A line that a crash cut short, or that was damaged later, is passed over: its input is done again. In memory stands only
where each input's line begins.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec

from houseexpo.files import write_atomically
from pipeline.batch.entry import Entry

_SYNC_S = 1.0
"""Lines are brought to the disk at least this often while they come."""


class _Head(msgspec.Struct):
    input: str
    source: str
    gone: bool = False


class _Place(NamedTuple):
    """Where an input's last line begins, which source lists it, and whether that still does."""

    offset: int
    source: int
    gone: bool


class Journal:
    """An open journal; ``close`` brings it to the disk."""

    def __init__(self, file: Path) -> None:
        self._places: dict[bytes, _Place] = {}
        self._sources: list[str] = []
        if file.exists() and file.stat().st_nlink > 1:  # a copy made of hard links: what is added is not the other's
            write_atomically(file, file.read_bytes(), durable=True)
        self._stream: BinaryIO = file.open("a+b")
        self._index()
        self._synced = time.monotonic()

    def get(self, name: str) -> Entry | None:
        """Return the last entry of an input."""
        place = self._places.get(bytes.fromhex(name))
        return None if place is None else self._read(place.offset)

    def put(self, entry: Entry) -> None:
        """Append an entry."""
        self._note(entry.input, entry.source, entry.gone, self._stream.seek(0, os.SEEK_END))
        self._stream.write(msgspec.json.encode(entry) + b"\n")
        self._stream.flush()
        if time.monotonic() - self._synced > _SYNC_S:
            self.sync()

    def sync(self) -> None:
        """Bring all lines to the disk."""
        os.fsync(self._stream.fileno())
        self._synced = time.monotonic()

    def close(self) -> None:
        """End; nothing is lost."""
        with suppress(OSError):
            self.sync()
        self._stream.close()

    def sources(self) -> list[str]:
        """Return the sources that list an input, sorted."""
        return sorted({self._sources[place.source] for place in self._places.values() if not place.gone})

    def names(self, *sources: str) -> Iterator[str]:
        """Yield the inputs that these sources list."""
        wanted = {i for i, source in enumerate(self._sources) if source in sources}
        for name, place in list(self._places.items()):
            if place.source in wanted and not place.gone:
                yield name.hex()

    def current(self) -> Iterator[Entry]:
        """Yield the entry of each input that is listed."""
        for place in sorted(self._places.values()):
            if not place.gone and (entry := self._read(place.offset)) is not None:
                yield entry

    def _index(self) -> None:
        self._stream.seek(0)
        offset, line = 0, b"\n"
        for line in self._stream:
            with suppress(msgspec.DecodeError, ValueError):
                head = msgspec.json.decode(line, type=_Head)
                self._note(head.input, head.source, head.gone, offset)
            offset += len(line)
        if not line.endswith(b"\n"):  # cut short: what comes next begins a line of its own
            self._stream.write(b"\n")

    def _note(self, name: str, source: str, gone: bool, offset: int) -> None:
        if source not in self._sources:
            self._sources.append(source)
        self._places[bytes.fromhex(name)] = _Place(offset, self._sources.index(source), gone)

    def _read(self, offset: int) -> Entry | None:
        self._stream.seek(offset)
        try:
            return msgspec.json.decode(self._stream.readline(), type=Entry)
        except msgspec.DecodeError:
            return None
