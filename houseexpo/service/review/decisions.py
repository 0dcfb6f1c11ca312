"""Store reviewers' decisions in a log and in ``overrides.toml`` beside it, for any number of people at once.

R1  Decisions are stored one at a time, under a lock among threads and processes; the system releases it when its owner
    ends.
R2  The new ``overrides.toml`` is written under a temporary name, then the line is added to the log, then the file is
    renamed; only then is the request answered. If the disk is full, nothing changes.
R3  If the process was killed between the line and the renaming, the next one finds the file as it was before the line,
    and completes the change. A file that a person has changed in the meantime matches neither state and is kept.
R4  A decision is refused if somebody has decided on the plan since the reviewer loaded it; the message describes that
    decision. Names do not matter: two people may use the same name, and one person may have two pages open.
R5  An undo reverts the reviewer's latest decision of which something is left: others may have taken it out. Later
    decisions of others remain, or the undo is refused. An undone decision can be redone until the reviewer makes
    another decision.
R6  Links are not followed: a data set may come from strangers, and its links may lead to any file of this user.
R7  A build reads the file, from this page or from a terminal: ``manifest.json`` beside it holds what it was made with.
    What is the same there does not wait for a build.
"""

from __future__ import annotations

import hashlib
import math
import os
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from threading import RLock
from typing import Any

import msgspec

from houseexpo.corrections import Override
from houseexpo.corrections.decision_log import Action, DecisionLog, LogLine
from houseexpo.corrections.vocabulary import FILE_WORDS, UNITS_M, Word
from houseexpo.errors import ConfigError
from houseexpo.files import PARTIAL, hold_file_lock, sync_folder, without_mark
from houseexpo.plan.ids import is_of_input
from houseexpo.service.review.changes import (
    DecidedOtherwiseError,
    changed_value,
    check_points,
    decision_changes,
    describe_log_line,
    replacement,
)
from houseexpo.service.review.toml_edit import edit_table

_SIZES = ("units", "scale", "distance", "storey_height")
_INSTEAD = {key: tuple(other for other in _SIZES if other != key) for key in _SIZES}
"""Each of these keys states the size of the model; setting one removes the others."""
_MOVING = {*_SIZES, "up"}
"""Each of these keys moves the file's walls to other coordinates in metres."""


def _growth(line: LogLine) -> float:
    """Return the factor by which a file grows with a statement of its scale or its unit, 0 if it is not known."""
    moving = {key: pair for key, pair in line.changes.items() if key in _MOVING}
    if set(moving) == {"scale"}:
        before, after = (1.0 if value is None else float(value) for value in moving["scale"])
        return after / before
    if set(moving) == {"units"} and None not in moving["units"]:
        before, after = (UNITS_M[value] if value in UNITS_M else float(value) for value in moving["units"])
        return after / before
    return 0.0


class _Made(msgspec.Struct):
    """What is read of a manifest: the statements of each input or plan."""

    overrides: dict[str, dict[str, Any]]


def _as_made(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table as a manifest states it."""
    found: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(asdict(Override(**table))))  # lists, no tuples
    return found


class NothingHereError(ConfigError):
    """A reviewer has nothing to undo on the given plans; ``plan`` is the plan of the reviewer's latest decision."""

    def __init__(self, reviewer: str, plan: str) -> None:
        super().__init__(f"{reviewer} has nothing to undo on this plan; the latest decision is on {plan}")
        self.plan = plan


@dataclass(frozen=True)
class PlanDecisions:
    """The decisions on a plan: the latest one, and the actions that are not undone."""

    last: LogLine
    actions: tuple[Action, ...]


class DecisionStore:
    """The decisions on a data set; ``file`` is its ``overrides.toml``, which need not exist yet."""

    def __init__(self, file: Path) -> None:
        self.file = file.parent.resolve() / file.name
        self.log = DecisionLog(self.file.with_suffix(".log.jsonl"))
        self._lock = self.file.with_name(f".{self.file.stem}.lock")
        self._thread = RLock()

    def check(self) -> None:
        """Raise ConfigError if decisions cannot be written, before somebody makes one."""
        self._check_links()
        needed = [self.file.parent, *(file for file in (self.log.path, self._lock) if file.exists())]
        if not all(map(_may_write, needed)):
            raise ConfigError(
                f"{self.file}: decisions go to this file, and it cannot be written; copy the data set to a folder that "
                "you may write to, or serve it without --review"
            )

    def by_plan(self) -> dict[str, PlanDecisions]:
        """Return the decisions by plan."""
        with self._thread:
            self._catch_up()
            found: dict[str, PlanDecisions] = {}
            for line in self.log.active:
                if line.action == "leave":
                    continue
                before = found[line.plan].actions if line.plan in found else ()
                found[line.plan] = PlanDecisions(line, (*before, line.action))
            return found

    def latest(self) -> dict[str, LogLine]:
        """Return the last line about each plan, including undos."""
        with self._thread:
            self._catch_up()
            return {line.plan: line for line in self.log.lines}

    def table(self, plan: str) -> dict[str, Any]:
        """Return a plan's table of ``overrides.toml``; raise ConfigError if a person wrote invalid values."""
        table = _tables(self._text()).get(plan, {})
        place = f"{self.file.name}: {plan}"
        if not isinstance(table, dict):
            raise ConfigError(f"{place}: expected a table [{plan}], found {table!r}; correct the file first")
        check_points(table, place)
        return table

    def tables(self) -> dict[str, Any]:
        """Return all tables of ``overrides.toml``."""
        return _tables(self._text())

    def decide(
        self,
        plan: str,
        action: Action,
        reviewer: str,
        value: Any = None,
        seen: int = 0,
        *,
        more: Sequence[Any] = (),
        then: Sequence[tuple[Word, Any]] = (),
        gone: Sequence[tuple[Word, Any]] = (),
        source: str = "",
        answer: str = "",
        question: str = "",
    ) -> LogLine:
        """Store a decision; it is on the disk when this returns.

        Parameters
        ----------
        value
            The value of a word, in metres along the source's plan axes; the text of a note or drop; or the key of
            the skipped question.
        seen
            The number of the last line about the plan that the reviewer has seen.
        more
            Further values of the word, or further skipped questions; all of them are one decision.
        then
            Other words of the decision, with their values.
        gone
            Earlier words that the decision takes out, with their values.
        source
            SHA-256 of the plan's file.
        answer
            The answer that confirms the plan, in words, for "leave".
        question
            The key of the question that the decision answers, "" if it answers none.

        Raises
        ------
        DecidedOtherwiseError
            Somebody else decided on the plan in the meantime (R4).
        ConfigError
            ``overrides.toml`` cannot be read, changed or written.
        """
        with self._hold_lock():
            self._check_seen(plan, seen)
            about = "\n".join([value, *more]) if action == "leave" else question
            changes = decision_changes(self.table(plan), action, value, more, then, gone=gone)
            return self._note(plan, action, reviewer, changes, about=about, source=source, answer=answer)

    def say_of_file(self, name: str, key: str, value: Any, reviewer: str) -> LogLine:
        """Store a statement about a whole file under the file's id; the value None removes the key.

        Raises
        ------
        ConfigError
            ``overrides.toml`` cannot be read, changed or written.
        """
        with self._hold_lock():
            table = self.table(name)
            changes = {key: (table.get(key), value)}
            if value is not None:
                changes |= {other: (table[other], None) for other in _INSTEAD.get(key, ()) if other in table}
            return self._note(name, "file", reviewer, changes)

    def left(self, plan: str) -> dict[str, str]:
        """Return the answer to each question about a plan that is not asked again, "" if it was left."""
        with self._thread:
            self._catch_up()
            about = [line for line in self.log.active if line.plan == plan and line.action == "leave"]
            return {question: line.answer for line in about for question in line.about.split("\n")}

    def sources(self, plan: str) -> dict[str, str]:
        """Return the SHA-256 of the file for which each statement about a plan was made, by ``author_key``."""
        with self._thread:
            self._catch_up()
            return {key: line.source for line in self.log.active if line.plan == plan for key in line.new_keys}

    def times(self, plan: str) -> dict[str, str]:
        """Return when each statement about a plan was made, by ``author_key``."""
        with self._thread:
            self._catch_up()
            return {key: at for key, (_, at) in self.log.authors(plan).get(plan, {}).items()}

    def said_before_size(self, plan: str, file: str) -> tuple[int, dict[str, float]]:
        """Return the last line about the size or the axis of a plan's file, and what was said of the plan before it.

        The number of the line is 0 if there is none; the statements are named by ``author_key``. Their points are in
        metres of the file as it was read at that time; each has the factor by which the file has grown since, 0 if it
        is not known.
        """
        with self._thread:
            self._catch_up()
            active = list(self.log.active)
            sizes = {
                line.number: _growth(line)
                for line in active
                if line.plan == file and not _MOVING.isdisjoint(line.changes)
            }
            since = {key: line.number for line in active if line.plan == plan for key in line.new_keys}
            last = max(sizes, default=0)
            return last, {
                key: math.prod(by for number, by in sizes.items() if number > at)
                for key, at in since.items()
                if at < last
            }

    def replace(
        self, plan: str, word: Word, old: Any, new: Any, *, reviewer: str, seen: int = 0, source: str = ""
    ) -> LogLine:
        """Replace one value of a word by another, or remove it if ``new`` is None; see ``decide``.

        Raises
        ------
        DecidedOtherwiseError
            Somebody else decided on the plan in the meantime (R4), or the table does not contain ``old``.
        ConfigError
            ``overrides.toml`` cannot be read, changed or written.
        """
        with self._hold_lock():
            self._check_seen(plan, seen)
            changes = replacement(self.table(plan), word, old, new)
            return self._note(plan, "remove" if new is None else "move", reviewer, changes, source=source)

    def _check_seen(self, plan: str, seen: int) -> None:
        """R4."""
        latest = self.latest().get(plan)
        if latest is not None and latest.number > seen:
            raise DecidedOtherwiseError(
                f"{plan}: {describe_log_line(latest)} in the meantime; look again before you decide"
            )

    def undo(self, reviewer: str, plans: Sequence[str] = ()) -> LogLine:
        """Undo a reviewer's latest decision (R5), only among decisions on ``plans`` if they are given.

        Raises
        ------
        NothingHereError
            The reviewer has decisions to undo, but not on these plans.
        ConfigError
            The reviewer has no decision to undo, or others have changed its value since.
        """
        with self._hold_lock():
            own = [line for line in self.log.active if line.reviewer == reviewer and self._holds(line)]
            if not own:
                raise ConfigError(f"{reviewer} has no decision left to undo")
            here = [line for line in own if line.plan in plans] if plans else own
            if not here:
                raise NothingHereError(reviewer, own[-1].plan)
            line = here[-1]
            table = self.table(line.plan)
            back = {key: changed_value(line, key, table.get(key), *pair[::-1]) for key, pair in line.changes.items()}
            return self._note(line.plan, "undo", reviewer, back, undoes=line.number)

    def _holds(self, line: LogLine) -> bool:
        """Return whether an undo of a decision would change something: not if somebody has taken out what it said."""
        with suppress(ConfigError):  # what somebody has written otherwise is told when it is undone
            table = self.table(line.plan)
            now = [changed_value(line, key, table.get(key), *pair[::-1]) for key, pair in line.changes.items()]
            return not now or any(before != after for before, after in now)
        return True

    def redo(self, reviewer: str) -> LogLine:
        """Redo the decision that a reviewer undid last; raise ConfigError if there is nothing to redo."""
        with self._hold_lock():
            undone = self.log.undone_by(reviewer)
            if not undone:
                raise ConfigError(f"{reviewer} has undone nothing that can be made again")
            undo, line = undone[-1]
            table = self.table(line.plan)
            again = {key: changed_value(line, key, table.get(key), *pair) for key, pair in line.changes.items()}
            same: dict[str, Any] = {"about": line.about, "source": line.source, "answer": line.answer}
            return self._note(line.plan, line.action, reviewer, again, redoes=undo.number, **same)

    def question_of(self, number: int) -> str:
        """Return the question that the decision in a line of the log answers, the first if there are several."""
        with self._thread:
            return next((line.about for line in self.log.lines if line.number == number), "").split("\n")[0]

    def history(self, plan: str, storey: str = "") -> list[tuple[LogLine, bool]]:
        """Return the decisions on a plan, its storey and its file in order, and whether each is in force.

        A decision that was made again appears once.
        """
        with self._thread:
            self._catch_up()
            undos = {line.number: line.undoes for line in self.log.lines if line.undoes}
            again = {undos.get(line.redoes, 0) for line in self.log.lines if line.redoes}
            return [
                (line, line.number not in self.log.undone)
                for line in self.log.lines
                if (line.plan in {plan, storey or plan} or (line.action == "file" and is_of_input(plan, line.plan)))
                and line.action != "undo"
                and line.number not in again
            ]

    def note_build(self, reviewer: str, upto: int) -> LogLine:
        """Record that the data set was built with the decisions up to a line; later ones wait for the next build."""
        with self._hold_lock():
            return self._note("", "build", reviewer, {}, upto=upto)

    def last(self) -> int:
        """Return the number of the last line, or 0 if there is none."""
        with self._thread:
            self._catch_up()
            return self.log.lines[-1].number if self.log.lines else 0

    def since_build(self) -> list[str]:
        """Return the plans with decisions or undos that the last build did not include."""
        return sorted(self._waiting())

    def file_changed(self, name: str) -> bool:
        """Return whether a statement about the whole file of a plan was made or undone since the last build."""
        waiting = self._waiting().items()
        return any(is_of_input(name, place) and not keys.isdisjoint(FILE_WORDS) for place, keys in waiting)

    def _waiting(self) -> dict[str, set[str]]:
        """Return the keys of each plan that the last build did not include (R7)."""
        with self._thread:
            self._catch_up()
            built, found = self._built(), dict[str, set[str]]()
            for line in self.log.lines:
                if line.number > built and line.changes:
                    found.setdefault(line.plan, set()).update(line.changes)
            made = self._made_with() if found else None
            if made is None:
                return found
            tables = self.tables()
            for name, keys in [*found.items()]:
                with suppress(ConfigError, TypeError):  # a person may have written what no build takes
                    now, then = _as_made(tables.get(name, {})), made.get(name) or _as_made({})
                    keys -= {key for key in keys if now[key] == then.get(key)}
                if not keys:
                    del found[name]
            return found

    def _made_with(self) -> dict[str, dict[str, Any]] | None:
        """Return the statements with which the data set was made (R7), None if it does not say."""
        try:
            return msgspec.json.decode((self.file.parent / "manifest.json").read_bytes(), type=_Made).overrides
        except (OSError, msgspec.MsgspecError):
            return None

    def _built(self) -> int:
        """Return the number of the last line that a build has included."""
        builds = [line for line in self.log.lines if line.action == "build"]
        return max((line.number if line.upto is None else line.upto for line in builds), default=0)

    def _catch_up(self) -> None:
        self._check_links()
        self.log.catch_up()

    def _check_links(self) -> None:
        """Raise ConfigError if a link, a folder or a device has the name of a file that is read or written (R6)."""
        for file in (self.file, self.log.path, self._lock):
            if file.is_symlink() or (file.exists() and not file.is_file()):
                what = "a link" if file.is_symlink() else "a folder" if file.is_dir() else "a device or a pipe"
                raise ConfigError(f"{file}: expected a file or nothing, found {what}; remove it")

    @contextmanager
    def _hold_lock(self) -> Iterator[None]:
        self._check_links()
        with self._thread, hold_file_lock(self._lock, self.file):  # R1
            self._catch_up()
            for left in self.file.parent.glob(f"{PARTIAL}{self.file.name}-*"):
                left.unlink(missing_ok=True)
            self._complete_last_change()
            yield

    def _complete_last_change(self) -> None:
        """Complete the change of the last line if it was interrupted (R3)."""
        text = self._text()
        last = self.log.lines[-1] if self.log.lines else None
        if last is not None and last.changes and last.file[0] != last.file[1] and _hash(text) == last.file[0]:
            self._write_partial(self._edit_text(text, last.plan, last.changes)).replace(self.file)
            sync_folder(self.file.parent)

    def _note(
        self,
        plan: str,
        action: Action,
        reviewer: str,
        changes: Mapping[str, tuple[Any, Any]],
        *,
        undoes: int = 0,
        redoes: int = 0,
        about: str = "",
        upto: int | None = None,
        source: str = "",
        answer: str = "",
    ) -> LogLine:
        changes = {key: pair for key, pair in changes.items() if pair[0] != pair[1]}
        before = self._text()
        after = self._edit_text(before, plan, changes) if changes else before
        number = (self.log.lines[-1].number if self.log.lines else 0) + 1
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = LogLine(
            number,
            now,
            reviewer,
            plan,
            action,
            changes,
            undoes,
            (_hash(before), _hash(after)),
            upto,
            redoes,
            about,
            source,
            answer,
        )
        partial = self._write_partial(after) if changes else None  # R2
        try:
            self.log.add(line)
        except OSError:
            if partial:
                partial.unlink(missing_ok=True)
            raise
        if partial:
            partial.replace(self.file)
            sync_folder(self.file.parent)
        self.log.catch_up()
        return line

    def _text(self) -> str:
        self._check_links()
        try:
            return without_mark(self.file.read_bytes()).decode()
        except FileNotFoundError:
            return ""
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"{self.file.name}: cannot be read ({error}); correct it first") from None

    def _edit_text(self, text: str, plan: str, changes: Mapping[str, tuple[Any, Any]]) -> str:
        try:
            return edit_table(text, plan, {key: after for key, (_, after) in changes.items()})
        except ConfigError as error:
            raise ConfigError(f"{self.file.name}: {error}") from None

    def _write_partial(self, text: str) -> Path:
        """Write the new content to the disk under a temporary name."""
        descriptor, partial = tempfile.mkstemp(dir=self.file.parent, prefix=f"{PARTIAL}{self.file.name}-")
        try:
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(text.encode())
                stream.flush()
                os.fchmod(stream.fileno(), self.file.stat().st_mode & 0o777 if self.file.exists() else 0o644)
                os.fsync(stream.fileno())
        except OSError:
            Path(partial).unlink(missing_ok=True)
            raise
        return Path(partial)


@lru_cache(maxsize=1)
def _tables(text: str) -> dict[str, Any]:
    """Return the tables of a file; nobody changes them. One answer of the page asks for them up to 18 times."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"overrides: expected TOML, found {error}; correct the file first") from None


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _may_write(path: Path) -> bool:
    return os.access(path, os.W_OK)
