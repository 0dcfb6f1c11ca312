"""Rebuild a data set with the decisions of a review, in its own process, and say how each decided plan changed.

R1  A data set has one build at a time. It continues when the browser is closed, and it ends with the server.
R2  The old versions of plans with decisions, and of the other plans of their inputs, are kept in memory, to be shown
    beside the new versions. Another plan of an input is named only if it has changed.
R3  A decision made during a build counts as made after it.
R4  A failed build leaves the decisions unchanged; its last lines give the reason.
R5  If the last build kept plans of earlier ones (``--add``), those are rebuilt first, with the same decisions.
R6  Only commands that the reviewer has seen are run: a request to build states the digest of the shown commands. The
    record of a build by another user or in another place is not run (``houseexpo.dataset.build_record``).
"""

from __future__ import annotations

import atexit
import hashlib
import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Lock, Thread
from types import MappingProxyType
from typing import Any, Final, Literal

import msgspec

from houseexpo.dataset import open_dataset
from houseexpo.dataset.build_record import BuildRecord, is_own_build, read_build_record
from houseexpo.errors import NO_PLAN, ConfigError, HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.ids import parts_of
from houseexpo.service.build_lists import read_build_lists
from houseexpo.service.collection import Collection
from houseexpo.service.review.changes import DecidedOtherwiseError
from houseexpo.service.review.decisions import DecisionStore

Became = Literal["changed", "the same", "gone", "no plan", "new"]
Phase = Literal["idle", "building", "built", "failed", "stopped"]
_LINES: Final = 60
"""The number of last lines of a build's output to keep."""
_MAX_SHOWN: Final = 400
"""The most plans to keep for comparison (R2); further plans are built, but not shown."""
_MAX_LOOKS: Final = 100
_LOOK_S: Final = 0.1
"""After a build, the data set is reopened within this number of looks, this many seconds apart."""


_SAME_M2: Final = 0.1
"""A plan whose area differs less from the shown one is as shown, m2: the page shows tenths."""


class DecidedPlan(msgspec.Struct, frozen=True):
    """The result for a plan with decisions; ``why`` is the reason if the plan is gone, or if there was and is none.

    ``effects`` are sentences about the corrections with an effect, ``idle`` the reasons why others had no effect.
    ``shown`` says what the page showed, if the plan was built otherwise.
    """

    plan: str
    became: Became
    why: str = ""
    effects: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()
    shown: str = ""


class Rebuild:
    """Rebuilds one data set; threads may share it."""

    def __init__(self, collection: Collection, decisions: DecisionStore) -> None:
        self.root, self._collection, self._decisions = collection.path, collection, decisions
        self.phase: Phase = "idle"
        self.outcomes: list[DecidedPlan] = []
        self.before: dict[str, bytes] = {}
        self._lines: deque[str] = deque(maxlen=_LINES)
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False
        self._lock = Lock()

    def why_not_possible(self) -> str:
        """Return why the data set cannot be rebuilt, "" if it can."""
        root = self.root
        if not (root / "manifest.json").is_file():
            return f"{root.name} was not made by houseexpo build, so it cannot be rebuilt here; decisions are saved"
        record = read_build_record(root)
        if record is None:
            return f"{root.name} has no record of its build; run its houseexpo build once more to create it"
        if not is_own_build(root, record):
            typed = "; ".join(record.shell_lines(root.resolve()))
            return (
                f"{root.name} was built in another place or by somebody else, so its recorded commands are not run "
                f"from here. Check them and, if they are what you want, run them once in a terminal: {typed}"
            )
        return ""

    def status(self) -> dict[str, Any]:
        """Return the state of the build as plain values."""
        return {
            "phase": self.phase,
            "refusal": (refusal := self.why_not_possible()),
            **({} if refusal else self._commands_to_confirm(self._record())),
            "waiting": len(self._decisions.since_build()),
            "lines": list(self._lines),
            "outcomes": msgspec.to_builtins(self.outcomes),
        }

    def start(self, reviewer: str, confirmed: str, shown: Mapping[str, FloorPlan] = MappingProxyType({})) -> None:
        """Start a build.

        Parameters
        ----------
        confirmed
            The value "confirm" of ``status`` at the time the commands were shown (R6).
        shown
            The plans with decisions as the page shows them, by id, as far as they are known.

        Raises
        ------
        DecidedOtherwiseError
            Other commands were shown.
        ConfigError
            The data set cannot be rebuilt, the build cannot be started, or one is running (R1).
        """
        if why := self.why_not_possible():
            raise ConfigError(why)
        record = self._record()
        if not is_own_build(self.root, record) or confirmed != self._commands_to_confirm(record)["confirm"]:
            raise DecidedOtherwiseError("the commands have changed since they were shown; check and confirm them again")
        with self._lock:
            if self.phase == "building":
                raise ConfigError(f"{self.root.name} is already being built; wait until that build has ended")
            upto = self._decisions.last()  # before the build reads the file: later decisions wait for the next build
            touched, dataset = self._decisions.since_build(), self._collection.dataset
            touched = touched[:_MAX_SHOWN]
            before = {name: dataset.raw(name) for name in _with_others(touched, dataset.ids) if name in dataset}  # R2
            commands = self._commands(record)
            try:
                self._process = _start_process(commands[0])
            except OSError as error:
                raise ConfigError(f"{self.root.name}: houseexpo build cannot be started ({error.strerror})") from None
            self.before, self.outcomes, self.phase, self._stopped = before, [], "building", False
            self._lines.clear()
            atexit.register(self.stop)
        finish = partial(self._finish, commands[1:], touched, reviewer, upto, shown)
        Thread(target=self._follow, args=(finish,), daemon=True).start()

    def commands(self) -> list[list[str]]:
        """Return the commands of the builds that made the data set; raise ConfigError if they may not be run (R6)."""
        if why := self.why_not_possible():
            raise ConfigError(why)
        return self._commands(self._record())

    def stop(self) -> None:
        """Interrupt a build as Ctrl-C does: finished houses are kept."""
        process = self._process
        self._stopped = self._stopped or self.phase == "building"
        if process is not None and process.poll() is None:
            with suppress(ProcessLookupError):  # it has ended in the meantime
                os.killpg(process.pid, signal.SIGINT)

    def _commands_to_confirm(self, record: BuildRecord) -> dict[str, Any]:
        """Return the commands in readable form, and the digest by which they are confirmed."""
        typed = record.shell_lines(self.root.resolve())
        return {"commands": typed, "confirm": hashlib.sha256("\n".join(typed).encode()).hexdigest()[:16]}

    def _commands(self, record: BuildRecord) -> list[list[str]]:
        """Return the commands of the builds, in order: those whose plans the last one kept, then the last one (R5)."""
        return [[sys.executable, "-P", "-m", "houseexpo", *words] for words in record.commands(self.root.resolve())]

    def _record(self) -> BuildRecord:
        record = read_build_record(self.root)
        if record is None:
            raise ConfigError(f"{self.root.name}: the record of its build is gone; run its houseexpo build once more")
        return record

    def _follow(self, finish: Callable[[], None]) -> None:
        try:
            finish()
        except Exception as error:  # noqa: BLE001  # a phase that stays "building" would block every later build
            self.stop()
            words = str(error) if isinstance(error, HouseExpoError) else f"{type(error).__name__}: {error}"
            self._lines.append(words)
            self.phase = "failed"
        finally:
            atexit.unregister(self.stop)

    def _ended_well(self) -> bool:
        """Collect the output of the running build until it ends; return whether it succeeded."""
        process = self._process
        assert process is not None  # noqa: S101  # it was begun
        assert process.stdout is not None  # noqa: S101  # it is a pipe
        with process.stdout as lines:
            self._lines.extend(line.rstrip() for line in lines)
        return process.wait() in {0, NO_PLAN}

    def _finish(
        self,
        rest: Sequence[Sequence[str]],
        touched: Sequence[str],
        reviewer: str,
        upto: int,
        shown: Mapping[str, FloorPlan],
    ) -> None:
        dataset, manifest = self._collection.dataset, _look(self.root)
        ended_well = self._ended_well()
        for command in rest:
            if not ended_well or self._stopped:
                ended_well = False
                break
            self._process = _start_process(command)
            ended_well = self._ended_well()
        if not ended_well:
            self.phase = "stopped" if self._stopped else "failed"  # R4
            return
        found = compare_decided_plans(self.root, self.before, touched, shown)
        for _ in range(_MAX_LOOKS):  # the pages reopen the data set at their next look
            self._collection.look()
            if _look(self.root) == manifest or self._collection.dataset is not dataset:
                break
            time.sleep(_LOOK_S)
        self._decisions.note_build(reviewer, upto)
        self.outcomes, self.phase = found, "built"  # set last, so that pages show "building" until then


def _start_process(command: Sequence[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(  # noqa: S603  # commands that this user ran and confirmed
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        errors="replace", start_new_session=True,
    )  # fmt: skip


def _look(root: Path) -> int:
    try:
        return (root / "manifest.json").stat().st_mtime_ns
    except OSError:
        return 0


def compare_decided_plans(
    root: Path,
    before: Mapping[str, bytes],
    touched: Sequence[str],
    shown: Mapping[str, FloorPlan] = MappingProxyType({}),
) -> list[DecidedPlan]:
    """Return the result for each plan with decisions, and for each other plan of their inputs that changed (R2).

    Parameters
    ----------
    before
        The JSON of the plans before the build, by id.
    touched
        The ids of plans with decisions.
    shown
        Plans with decisions as the page showed them, by id.
    """
    dataset = open_dataset(root)
    reasons = _reasons(root)
    found = []
    ids = [*dataset.ids, *reasons]
    named = [each for name in touched for each in _ids_of(name, ids)]
    for name in _with_others(named, [*before]):
        if name in dataset:
            same = before.get(name) == dataset.raw(name)
            became: Became = "new" if name not in before else "the same" if same else "changed"
            if named.count(name) or not same:
                plan = dataset[name]
                other = _shown_otherwise(shown.get(name, plan), plan)
                found.append(DecidedPlan(name, became, "", *_effects(plan), other))
        else:
            was: Became = "gone" if name in before else "no plan"
            found.append(DecidedPlan(name, was, reasons.get(name, "it is not in the data set")))
    return found


def _ids_of(name: str, ids: Sequence[str]) -> list[str]:
    """Return the ids of the plans of a file or a level with decisions, or the id of a plan."""
    if name in ids:
        return [name]
    return [each for each in ids if name in {parts_of(each).of_input, parts_of(each).of_level}] or [name]


def _with_others(names: Sequence[str], ids: Sequence[str]) -> list[str]:
    """Return names of plans, then those of the other plans of their inputs."""
    inputs = {parts_of(name).of_input for name in names}
    return list(dict.fromkeys([*names, *(each for each in ids if parts_of(each).of_input in inputs)]))


def _shown_otherwise(shown: FloorPlan, built: FloorPlan) -> str:
    """Return what the page showed of a plan that was built otherwise, "" if it was built as it was shown."""
    counts = [(len(plan.rooms), len(plan.doors)) for plan in (shown, built)]
    if counts[0] == counts[1] and abs(shown.area - built.area) <= _SAME_M2:
        return ""
    return f"it is not as it was shown: {counts[0][0]} rooms, {counts[0][1]} doors, {shown.area:.1f} m2"


def _effects(plan: FloorPlan) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what the corrections of a plan did, in words, and those that did nothing."""
    told = plan.provenance or {}
    lines: tuple[list[str], list[str]] = ([], [])
    for record in told.get("corrections", []):
        said = "; ".join([record["said"], *record.get("also", [])])
        lines[record["outcome"] == "none"].append(f"{record['word']} {record['value']}: {said}")
    lines[0].extend(told.get("followed", []))
    return tuple(lines[0]), tuple(lines[1])


def _reasons(root: Path) -> dict[str, str]:
    """Return the reasons why ids are not plans, by id."""
    found = read_build_lists(root)
    reasons = {each.id: f"{each.reason.replace('_', ' ')}: {each.detail}" for each in found.refused}
    return reasons | {each.id: f"a duplicate of {each.kept_id}" for each in found.repeated}
