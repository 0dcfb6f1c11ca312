"""Keep the log of review decisions: read its lines of JSON, and append one line for each decision.

R1  A line is on the disk before its request is answered.
R2  A truncated line was never answered: it is skipped, and the next entry starts on a new line.
R3  Lines are not removed: an undo is a line that names the line that it undoes.
R4  A log that shares its file with a copy (hard links) is separated from it before a line is added.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec

from houseexpo.corrections.vocabulary import WORDS, Word, author_key, word_values
from houseexpo.errors import ConfigError
from houseexpo.files import sync_folder, write_atomically

Action = Literal["keep", "drop", Word, "note", "leave", "file", "move", "remove", "undo", "build"]


class LogLine(msgspec.Struct, frozen=True, omit_defaults=True):
    """A decision.

    Parameters
    ----------
    number
        The position in the log, from 1.
    time
        UTC, ISO 8601.
    plan
        The plan's id; "" for a build.
    changes
        The values of keys of the plan's table before and after; None for no value.
    undoes
        For an undo, the number of the line that it undoes.
    redoes
        For a decision that was undone and is made again, the number of the line that undid it.
    about
        The key of the question that the decision answers (``review.questions``), "" if it answers none. For "leave",
        all questions that are not asked again, one a line.
    upto
        For a build, the number of the last line that it included; None in older logs, which means the line before.
    file
        SHA-256 of ``overrides.toml`` before and after.
    source
        SHA-256 of the plan's file at the time of the decision, "" if unknown.
    answer
        For "leave", the answer that confirms the plan, in words; "" if the question was left.
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
    redoes: int = 0
    about: str = ""
    source: str = ""
    answer: str = ""

    @property
    def new_keys(self) -> set[str]:
        """Return the statements that the line adds, by ``author_key``."""
        return _added((key, *pair) for key, pair in self.changes.items())

    @property
    def old_keys(self) -> set[str]:
        """Return the statements that the line takes out, by ``author_key``."""
        return _added((key, *pair[::-1]) for key, pair in self.changes.items())


def _added(changes: Iterable[tuple[str, Any, Any]]) -> set[str]:
    found: set[str] = set()
    for key, before, after in changes:
        if after is not None:
            found |= set(_author_keys(key, after)) - set(_author_keys(key, before))
    return found


def _author_keys(key: str, value: Any) -> list[str]:
    word = next((word for word in WORDS if word == key), None)
    try:
        return [author_key(key, each) for each in (word_values(word, value) if word and value else [value])]
    except ConfigError:  # another version may have written the line; skip it
        return []


@dataclass
class DecisionLog:
    """The log file and the lines read so far; to add a line, hold the lock of ``DecisionStore``."""

    path: Path
    lines: list[LogLine] = field(default_factory=list)
    undone: set[int] = field(default_factory=set)
    _read_to: int = 0
    _inode: int = 0

    def catch_up(self) -> None:
        """Read the lines that were added since, by any process, or all lines if the file was replaced."""
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
        for line in _decode_lines(whole):
            self.lines.append(line)
            if line.undoes:
                self.undone.add(line.undoes)

    def add(self, line: LogLine) -> None:
        """Write a line to the disk (R1, R2).

        Raises
        ------
        OSError
            The line cannot be written; the log is unchanged.
        """
        is_new = not self.path.exists()
        if not is_new and self.path.stat().st_nlink > 1:  # R4
            write_atomically(self.path, self.path.read_bytes(), durable=True)
        descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o644)
        try:
            size = os.fstat(descriptor).st_size
            torn = size > 0 and os.pread(descriptor, 1, size - 1) != b"\n"
            data = b"\n" * torn + msgspec.json.encode(line) + b"\n"
            try:
                while data:  # a full disk accepts a part and refuses the rest
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
    def active(self) -> Iterator[LogLine]:
        """The decisions that are not undone, in order."""
        return (line for line in self.lines if line.action not in {"undo", "build"} and line.number not in self.undone)

    def authors(self, plan: str | None = None) -> dict[str, dict[str, tuple[str, str]]]:
        """Return who made each statement, and when, by plan and ``author_key``; one that is moved keeps its time.

        Only the statements about ``plan`` are looked at, if it is given: a page asks at each answer.
        """
        found: dict[str, dict[str, tuple[str, str]]] = {}
        for line in self.active:
            if plan is not None and line.plan != plan:
                continue
            own = found.setdefault(line.plan, {})
            before = [own[key][1] for key in line.old_keys if key in own] if line.action == "move" else []
            own.update(dict.fromkeys(line.new_keys, (line.reviewer, min(before, default=line.time))))
        return found

    def undone_by(self, reviewer: str) -> list[tuple[LogLine, LogLine]]:
        """Return the undos that a reviewer can redo, each with the line that it undid, the latest last.

        After a new decision, the reviewer can redo nothing.
        """
        by_number = {line.number: line for line in self.lines}
        found: list[tuple[LogLine, LogLine]] = []
        for line in self.lines:
            if line.reviewer != reviewer or line.action == "build":
                continue
            if line.undoes in by_number:
                found.append((line, by_number[line.undoes]))
            elif line.redoes:
                found = [pair for pair in found if pair[0].number != line.redoes]
            else:
                found.clear()
        return found


def _decode_lines(data: bytes) -> Iterator[LogLine]:
    for text in data.splitlines():
        try:
            yield msgspec.json.decode(text, type=LogLine)
        except msgspec.DecodeError:
            continue
