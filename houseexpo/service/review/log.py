"""What was decided, a line of JSON for each decision, only ever added to.

R1  A line is on the disk before anybody is told that it is noted.
R2  A line that was cut off was never answered: it is passed over, and the next one starts on a line of its own.
R3  Nothing is taken back in the log: an undo is a line that names the line that it undoes.
R4  A log that is one file with another, as in a copy made of hard links, becomes a file of its own first.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec

from houseexpo.files import sync_folder, write_whole

Action = Literal["keep", "drop", "door", "no_room", "note", "undo", "build"]


class Line(msgspec.Struct, frozen=True, omit_defaults=True):
    """A decision.

    Parameters
    ----------
    number
        Counts from 1 on.
    time
        UTC, ISO 8601.
    plan
        Its id; "" for a build.
    changes
        What became of keys of the plan's table: before and after, or None if there is none.
    undoes
        Of an undo, the number of what it undoes.
    upto
        Of a build, the number of the last line that it was told of; None in logs of before this was noted, where it is
        the line before its own.
    file
        SHA-256 of ``overrides.toml`` before and after.
    """

    number: int
    time: str
    reviewer: str
    plan: str
    action: Action
    changes: dict[str, tuple[Any, Any]] = {}
    undoes: int = 0
    file: tuple[str, str] = ("", "")
    upto: int | None = None


@dataclass
class Log:
    """The file, and the lines read of it so far; whoever adds holds the lock of ``Decisions``."""

    path: Path
    lines: list[Line] = field(default_factory=list)
    undone: set[int] = field(default_factory=set)
    _read_to: int = 0
    _inode: int = 0

    def catch_up(self) -> None:
        """Read what was added since, by whomever; all of it where the file is another one."""
        try:
            with self.path.open("rb") as stream:
                found = os.fstat(stream.fileno())
                if found.st_ino != self._inode or found.st_size < self._read_to:
                    self.lines.clear()
                    self.undone.clear()
                    self._read_to, self._inode = 0, found.st_ino
                stream.seek(self._read_to)
                data = stream.read()
        except FileNotFoundError:
            self.lines.clear()
            self.undone.clear()
            self._read_to = 0
            return
        whole = data[: data.rfind(b"\n") + 1]
        self._read_to += len(whole)
        for line in _decoded(whole):
            self.lines.append(line)
            if line.undoes:
                self.undone.add(line.undoes)

    def add(self, line: Line) -> None:
        """Put a line on the disk (R1, R2).

        Raises
        ------
        OSError
            It cannot be written; nothing is left of it then.
        """
        is_new = not self.path.exists()
        if not is_new and self.path.stat().st_nlink > 1:  # R4
            write_whole(self.path, self.path.read_bytes(), durable=True)
        descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o644)
        try:
            size = os.fstat(descriptor).st_size
            torn = size > 0 and os.pread(descriptor, 1, size - 1) != b"\n"
            data = b"\n" * torn + msgspec.json.encode(line) + b"\n"
            try:
                while data:  # a full disk takes a part, and refuses the rest
                    data = data[os.write(descriptor, data) :]
                os.fsync(descriptor)
            except OSError:
                os.ftruncate(descriptor, size)
                raise
        finally:
            os.close(descriptor)
        if is_new:
            sync_folder(self.path.parent)

    @property
    def active(self) -> Iterator[Line]:
        """The decisions that are not undone, in order."""
        return (line for line in self.lines if line.action not in {"undo", "build"} and line.number not in self.undone)


def _decoded(data: bytes) -> Iterator[Line]:
    for text in data.splitlines():
        try:
            yield msgspec.json.decode(text, type=Line)
        except msgspec.DecodeError:
            continue
