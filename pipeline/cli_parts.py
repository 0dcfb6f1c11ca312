"""What the commands share: settings, progress, a clean end on Ctrl-C, and what is shown at the end."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from pipeline.batch.passing import passing_fault
from pipeline.interrupts import EXIT_CODE as INTERRUPTED
from pipeline.interrupts import interruptible

if TYPE_CHECKING:
    from pipeline.batch.assemble import DataSet
    from pipeline.config_file import BuildConfig

NOT_DONE = 3
"""The exit code where a fault of the moment kept some inputs from being done, or a shard has not done them yet."""


def settings_of(config: Path | None, given: Mapping[str, Any]) -> BuildConfig:
    """Return the manifest's settings, or the defaults, with what the command line gives in their place."""
    from pipeline.config_file import BuildConfig, load_config

    settings = BuildConfig() if config is None else load_config(config)
    chosen = {name: value for name, value in given.items() if value not in (None, ())}
    return replace(settings, build=replace(settings.build, **chosen))


@contextmanager
def ended_cleanly() -> Iterator[Callable[[], None]]:
    """End with the command that goes on where Ctrl-C comes (130), or a fault of the moment (3), such as a full disk.

    Yields ``interruptible``'s function.
    """
    goes_on = f"what is done is kept, and this goes on with the rest: {shlex.join(_command())}"
    last_words = f"interrupted; {goes_on}"
    try:
        with interruptible(last_words) as check:
            yield check
    except KeyboardInterrupt:
        typer.echo(last_words, err=True)
        raise typer.Exit(INTERRUPTED) from None
    except OSError as error:
        if (fault := passing_fault(error)) is None:
            raise
        where = f" ({fault.filename})" if fault.filename else ""
        typer.secho(f"stopped: {fault.strerror or fault}{where}; when that has passed: {goes_on}", fg="red", err=True)
        raise typer.Exit(NOT_DONE) from None


def show_outcomes(data_set: DataSet, out: str) -> None:
    """Say what came of a build, and where it is."""
    from rich.console import Console

    from pipeline.report import longest_table, notes_lines, outcome_table, plans_line, reasons_lines

    console = Console()
    if data_set.unchanged:
        console.print("nothing to do: the data set stands as its inputs are")
    console.print(outcome_table(data_set.stats))
    if len(data_set.entries) > 1 and not data_set.unchanged:
        console.print(longest_table(data_set))
    for note in notes_lines(data_set):
        console.print(note, markup=False, highlight=False)
    if (line := plans_line(data_set.stats)) is not None:
        console.print(line, highlight=False)
    for line in reasons_lines(data_set, out):
        console.print(line, style="red", markup=False, highlight=False)
    if data_set.not_done:
        console.print(
            f"not done yet: {data_set.not_done}; build again when what kept them from it has passed", style="yellow"
        )
    for what, path in {
        "data set": out,
        "pictures": f"{out}/.build/pictures",
        "report": f"{out}/.build/report.html",
    }.items():
        console.print(f"[bold]{what:10}[/]{path}", highlight=False, soft_wrap=True)


def _command() -> list[str]:
    return ["houseexpo", *sys.argv[1:]] if Path(sys.argv[0]).name != "__main__.py" else sys.orig_argv
