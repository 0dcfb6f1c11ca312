"""Describe the files that an input was read from by size, time and SHA-256, and tell whether they are unchanged."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from glob import escape
from pathlib import Path

from houseexpo.files import sha256_of
from pipeline.batch.disk import path_from_text, path_to_text
from pipeline.batch.entry import FileRecord
from pipeline.rejection import Rejection
from pipeline.sources import reader
from pipeline.sources.files import record_opened_files
from pipeline.values import Input

ABSENT = -1


class InputFiles:
    """The files that an input is read from: its own, and those that its reader opens beside it."""

    def __init__(self, item: Input) -> None:
        self._item, self._path = item, Path(item.path)
        self._folder = self._path if self._path.is_dir() else self._path.parent  # a SUNCG root, or where its file lies
        self._began_ns = time.time_ns()
        self._opened: set[str] = set()

    @contextmanager
    def recorded(self) -> Iterator[None]:
        """Note what is opened meanwhile in the input's own folder, its source's, and those named for models."""
        options = dict(self._item.options)
        named = [options.get("root", ""), *options.get("model_path", "").split(os.pathsep)]
        is_made = self._item.key and not self._path.exists()  # where it is read
        folders = [] if is_made else [self._folder, *map(Path, filter(None, named))]
        with record_opened_files(*folders) as self._opened:
            yield

    def described(self) -> list[FileRecord]:
        """Return what the files hold that were opened, and the input's own, which not every reader opens in Python."""
        own = [] if self._item.key and not self._path.is_file() else [self._path.name]
        return self._contents([path_to_text(name) for name in sorted({*self._opened, *own})])

    def described_unread(self) -> list[FileRecord]:
        """Return records for a reader that cannot tell what it read: of the input's files, or all in its folders."""
        if self._item.key:
            files = self._folder.glob(f"*/{escape(self._item.key)}/*")
            self._opened = {str(file.relative_to(self._folder)) for file in files}
        return self.described()

    def own_sha256(self) -> str:
        """Return the SHA-256 of the input's own file, or of its part of a file of many houses; "" if it has none."""
        try:
            return self._sha256_of(self._path) if self._path.is_file() else ""
        except (OSError, Rejection):
            return ""

    def look_like(self, known: Sequence[FileRecord]) -> bool:
        """Tell whether files have the size and the time that they had; nothing is read."""
        return all(_look(self._folder / path_from_text(file.name)) == (file.size, file.mtime_ns) for file in known)

    def if_unchanged(self, known: Sequence[FileRecord]) -> list[FileRecord] | None:
        """Return the files' present records if their contents are unchanged, else None; all files are read."""
        now = self._contents([file.name for file in known])
        return now if [file.sha256 for file in now] == [file.sha256 for file in known] else None

    def _contents(self, names: Sequence[str]) -> list[FileRecord]:
        """Return files as they look now."""
        found = []
        for name in names:
            file = self._folder / path_from_text(name)
            size, mtime_ns = _look(file)
            try:
                digest = self._sha256_of(file)
            except (OSError, Rejection):
                found.append(FileRecord(name, ABSENT, 0, ""))
            else:
                found.append(FileRecord(name, size, mtime_ns if mtime_ns < self._began_ns else 0, digest))
        return found

    def _sha256_of(self, file: Path) -> str:
        """Return the SHA-256 of a file, or of this house's part of a file that holds many houses."""
        part = getattr(reader(self._item.reader), "read_house_bytes", None) if self._item.key else None
        if part is None or file != self._path:
            return sha256_of(file)
        return hashlib.sha256(part(self._item)).hexdigest()


def _look(file: Path) -> tuple[int, int]:
    try:
        found = file.stat()
    except OSError:
        return ABSENT, 0
    return found.st_size, found.st_mtime_ns
