"""Show a build's progress on standard error: how far each part is, and the outcomes so far.

In a terminal these are bars that vanish at the end; elsewhere, as in a log, plain lines now and then. A part that is
done at once leaves no line.
"""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from types import TracebackType

from rich.console import Console, RenderableType
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from houseexpo.commands.printing import make_console
from houseexpo.progress import EVERY_S, is_quiet, is_verbose
from houseexpo.words import count_noun
from pipeline.batch.entry import Entry

_REASONS = 3
LISTED = 8
"""How many things of a kind are named one by one."""
_LOG = logging.getLogger("pipeline")


@dataclass
class OutcomeCounts:
    """The outcomes so far: plans, rejections by reason, and with ``-v`` the slowest input."""

    plans: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    longest: tuple[float, str] = (0.0, "")

    def add(self, entry: Entry) -> None:
        """Count the outcome of an input."""
        self.plans += len(entry.plans)
        self.reasons.update(refused.reason for refused in entry.refused)
        self.longest = max(self.longest, (entry.seconds, entry.file))

    def __str__(self) -> str:
        """Return the tally in one line, or an empty text before the first outcome."""
        if not self.plans and not self.reasons:
            return ""
        counts = [f"{name} {count}" for name, count in self.reasons.most_common(_REASONS)]
        if len(self.reasons) > _REASONS:
            counts.append("...")
        refused = f", {self.reasons.total()} rejected ({', '.join(counts)})" if counts else ""
        seconds, file = self.longest
        longest = f", longest {seconds:.1f} s: {file}" if file and is_verbose() else ""
        return f"{count_noun(self.plans, 'plan')}{refused}{longest}"


def make_display(check: Callable[[], None]) -> ProgressDisplay:
    """Return what shows a build on standard error, or nothing if the commands are quiet (``-q``)."""
    return ProgressDisplay(make_console(stderr=True, quiet=is_quiet()), check)


class ProgressDisplay:
    """Shows a build on a console; ``check`` is called at every step and may end the build."""

    def __init__(self, console: Console, check: Callable[[], None]) -> None:
        """Nothing is shown before the ``with``."""
        self.tally = OutcomeCounts()
        self._check = check
        self._shown: _Bars | _Lines = _Bars(console, self.tally) if console.is_terminal else _Lines(console, self.tally)

    def __enter__(self) -> ProgressDisplay:
        """Begin to show."""
        self._shown.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""
        self._shown.stop()

    def progress(self, what: str, done: int, total: int) -> None:
        """Show how much of a part is done, and of how much."""
        self._check()
        self._shown.show(what, done, total)

    def note_outcome(self, entry: Entry) -> None:
        """Count the outcome of an input, and log it (``-v``; with ``-vv`` each stage's seconds too)."""
        self.tally.add(entry)
        for plan in entry.plans:
            _LOG.info("%s: %s: plan, %.2f s", plan.id, entry.file, entry.seconds)
        for refused in entry.refused:
            _LOG.info("%s: %s: %s: %s: %s", refused.id, entry.file, refused.stage, refused.reason, refused.detail)
        _LOG.debug("%s: %s", entry.file, ", ".join(f"{name} {took:.3f} s" for name, took in entry.stages.items()))


class _Bars(Progress):
    """A bar for each part, with the tally under them."""

    def __init__(self, console: Console, tally: OutcomeCounts) -> None:
        self.tally = tally
        self.named: dict[str, int] = {}
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
        rest = (TextColumn("{task.fields[rate]}"), TimeRemainingColumn())
        super().__init__(*columns, *rest, console=console, transient=True)

    def get_renderables(self) -> Iterable[RenderableType]:
        yield self.make_tasks_table(self.tasks)
        if line := str(self.tally):
            yield Text(line, style="dim", no_wrap=True, overflow="ellipsis")

    def show(self, what: str, done: int, total: int) -> None:
        if what not in self.named:
            self.named[what] = self.add_task(what, total=total, rate="")
        task = next(task for task in self.tasks if task.id == self.named[what])
        rate = f"{task.speed:.1f}/s" if task.speed and total > 1 else ""
        self.update(task.id, completed=done, total=total, rate=rate)


@dataclass
class _Part:
    """A part of the build at the time of its first progress report."""

    began: float
    done: int
    said: float
    ended: bool = False


class _Lines:
    """A line for each part now and then, and when it is done if a line was said before."""

    def __init__(self, console: Console, tally: OutcomeCounts) -> None:
        self.console, self.tally = console, tally
        self.parts: dict[str, _Part] = {}

    def start(self) -> None:
        pass

    def stop(self) -> None:
        pass

    def show(self, what: str, done: int, total: int) -> None:
        now = time.monotonic()
        part = self.parts.setdefault(what, _Part(now, done, now))
        is_end = done >= total and not part.ended and (part.said > part.began or is_verbose())
        if not is_end and now - part.said < EVERY_S:
            return
        part.said, part.ended = now, part.ended or is_end
        rate = (done - part.done) / max(now - part.began, 1e-9)
        pace = f", {rate:.1f} a second, {(total - done) / rate:.0f} s left" if rate and not is_end else ""
        tally = f"; {self.tally}" if str(self.tally) else ""
        line = f"{what}: {done} of {total}{pace}{tally}"
        self.console.print(line, markup=False, highlight=False, soft_wrap=True)
