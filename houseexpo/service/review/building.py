"""Build a data set again with what was decided, and see what came of it: ``houseexpo build`` in a process of its own.

R1  One build of a data set at a time. It goes on when the browser goes away, and ends with the server.
R2  The plans decided on are kept as they were before, in memory, to be shown beside what became of them.
R3  What is decided while it is built counts as decided after it.
R4  A build that fails changes nothing of what was decided; its last lines say why.
R5  Where the last build kept the plans of others (``--add``), those are built again before it, with the same decisions.
R6  What runs is what was shown: whoever begins a build says which commands they saw. A data set that this user did not
    build in this place is not built by what it says of itself (``houseexpo.dataset.build_record``).
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
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Lock, Thread
from typing import Any, Final, Literal

import msgspec

from houseexpo.dataset import open_dataset
from houseexpo.dataset.build_record import BuildRecord, built_here, recorded_build
from houseexpo.errors import NO_PLAN, ConfigError, HouseExpoError
from houseexpo.service.collection import Collection
from houseexpo.service.records import read_records
from houseexpo.service.review.changes import DecidedOtherwiseError
from houseexpo.service.review.decisions import Decisions

Phase = Literal["idle", "building", "built", "failed", "stopped"]
_LINES: Final = 60
_MAX_SHOWN: Final = 400
"""Plans that are kept as they were; more are built, but not shown."""
_MAX_LOOKS: Final = 100


class Outcome(msgspec.Struct, frozen=True):
    """What became of a plan that was decided on; ``why`` says where there is none any more."""

    plan: str
    became: Literal["changed", "the same", "gone", "new"]
    why: str = ""


class Building:
    """Builds one data set again; threads may share it."""

    def __init__(self, collection: Collection, decisions: Decisions) -> None:
        self.root, self._collection, self._decisions = collection.path, collection, decisions
        self.phase: Phase = "idle"
        self.outcomes: list[Outcome] = []
        self.before: dict[str, bytes] = {}
        self._lines: deque[str] = deque(maxlen=_LINES)
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False
        self._lock = Lock()

    def refusal(self) -> str:
        """Return why it cannot be built again, or "" if it can."""
        root = self.root
        if not (root / "manifest.json").is_file():
            return f"{root.name} comes from no houseexpo build: decisions are kept, nothing is built again"
        record = recorded_build(root)
        if record is None:
            return f"{root.name} does not say how it was built; run its houseexpo build once more, then it does"
        if not built_here(root, record):
            typed = "; ".join(record.typed(root.resolve()))
            return (
                f"{root.name} was built in another place or by somebody else, so what it says of its build is not run "
                f"from here. Look at it and, if it is what you want, run it once in a terminal: {typed}"
            )
        return ""

    def status(self) -> dict[str, Any]:
        """Return how it stands, as plain values."""
        return {
            "phase": self.phase,
            "refusal": (refusal := self.refusal()),
            **({} if refusal else self._shown(self._record())),
            "waiting": len(self._decisions.since_build()),
            "lines": list(self._lines),
            "outcomes": msgspec.to_builtins(self.outcomes),
        }

    def start(self, reviewer: str, confirmed: str) -> None:
        """Begin to build.

        Parameters
        ----------
        confirmed
            What ``status`` said under "confirm" when the commands were shown (R6).

        Raises
        ------
        DecidedOtherwiseError
            Other commands were shown.
        ConfigError
            It cannot be built again, cannot be started, or is being built (R1).
        """
        if why := self.refusal():
            raise ConfigError(why)
        record = self._record()
        if not built_here(self.root, record) or confirmed != self._shown(record)["confirm"]:
            raise DecidedOtherwiseError("these are not the commands that were shown; look at them and confirm them")
        with self._lock:
            if self.phase == "building":
                raise ConfigError(f"{self.root.name} is being built already; wait until that has ended")
            upto = self._decisions.last()  # before the build reads the file: what comes later waits for the next one
            touched, dataset = self._decisions.since_build(), self._collection.dataset
            before = {name: dataset.raw(name) for name in touched[:_MAX_SHOWN] if name in dataset}  # R2
            commands = self._commands(record)
            try:
                self._process = _begun(commands[0])
            except OSError as error:
                raise ConfigError(f"{self.root.name}: houseexpo build cannot be started ({error.strerror})") from None
            self.before, self.outcomes, self.phase, self._stopped = before, [], "building", False
            self._lines.clear()
            atexit.register(self.stop)
        Thread(target=self._follow, args=(commands[1:], touched[:_MAX_SHOWN], reviewer, upto), daemon=True).start()

    def stop(self) -> None:
        """End a build as Ctrl-C does: what is done is kept."""
        process = self._process
        self._stopped = self._stopped or self.phase == "building"
        if process is not None and process.poll() is None:
            with suppress(ProcessLookupError):  # it has ended meanwhile
                os.killpg(process.pid, signal.SIGINT)

    def _shown(self, record: BuildRecord) -> dict[str, Any]:
        """Return the commands as a person reads them, and what stands for them when they are confirmed."""
        typed = record.typed(self.root.resolve())
        return {"commands": typed, "confirm": hashlib.sha256("\n".join(typed).encode()).hexdigest()[:16]}

    def _commands(self, record: BuildRecord) -> list[list[str]]:
        """Return the builds to run, one after another: those whose plans the last one kept, and that one (R5)."""
        return [[sys.executable, "-P", "-m", "houseexpo", *words] for words in record.commands(self.root.resolve())]

    def _record(self) -> BuildRecord:
        record = recorded_build(self.root)
        if record is None:
            raise ConfigError(f"{self.root.name}: the record of its build is gone; run its houseexpo build once more")
        return record

    def _follow(self, rest: Sequence[Sequence[str]], touched: Sequence[str], reviewer: str, upto: int) -> None:
        try:
            self._finish(rest, touched, reviewer, upto)
        except Exception as error:  # noqa: BLE001  # a phase that stays "building" would keep every later build out
            self.stop()
            words = str(error) if isinstance(error, HouseExpoError) else f"{type(error).__name__}: {error}"
            self._lines.append(words)
            self.phase = "failed"
        finally:
            atexit.unregister(self.stop)

    def _heard(self) -> bool:
        """Keep what the build at work says until it ends; tell whether it ended well."""
        process = self._process
        assert process is not None  # noqa: S101  # it was begun
        assert process.stdout is not None  # noqa: S101  # it is a pipe
        with process.stdout as lines:
            self._lines.extend(line.rstrip() for line in lines)
        return process.wait() in {0, NO_PLAN}

    def _finish(self, rest: Sequence[Sequence[str]], touched: Sequence[str], reviewer: str, upto: int) -> None:
        dataset, manifest = self._collection.dataset, _look(self.root)
        ended_well = self._heard()
        for command in rest:
            if not ended_well or self._stopped:
                ended_well = False
                break
            self._process = _begun(command)
            ended_well = self._heard()
        if not ended_well:
            self.phase = "stopped" if self._stopped else "failed"  # R4
            return
        found = outcomes(self.root, self.before, touched)
        for _ in range(_MAX_LOOKS):  # the pages open what was built when they look next
            self._collection.look()
            if _look(self.root) == manifest or self._collection.dataset is not dataset:
                break
            time.sleep(0.1)
        self._decisions.built(reviewer, upto)
        self.outcomes, self.phase = found, "built"  # together: a page that asks meanwhile shows it as being built


def _begun(command: Sequence[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(  # noqa: S603  # what was recorded when it was built, by this user
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        errors="replace", start_new_session=True,
    )  # fmt: skip


def _look(root: Path) -> int:
    try:
        return (root / "manifest.json").stat().st_mtime_ns
    except OSError:
        return 0


def outcomes(root: Path, before: Mapping[str, bytes], touched: Sequence[str]) -> list[Outcome]:
    """Say what became of plans, and which are new of the same houses.

    Parameters
    ----------
    before
        JSON of the plans that there were, by id.
    touched
        Ids of the plans decided on.
    """
    dataset = open_dataset(root)
    reasons = _reasons(root)
    found = []
    for name in touched:
        if name in dataset:
            same = before.get(name) == dataset.raw(name)
            found.append(Outcome(name, "new" if name not in before else "the same" if same else "changed"))
        else:
            found.append(Outcome(name, "gone", reasons.get(name, "no longer among the plans")))
    return found


def _reasons(root: Path) -> dict[str, str]:
    """Return why ids are no plans, by id."""
    found = read_records(root)
    reasons = {each.id: f"{each.reason.replace('_', ' ')}: {each.detail}" for each in found.refused}
    return reasons | {each.id: f"a duplicate of {each.kept_id}" for each in found.repeated}
