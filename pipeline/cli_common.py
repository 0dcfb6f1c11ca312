"""Provide what the commands share: settings from options, a clean end on Ctrl-C, and what they print at the end."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from houseexpo.commands.printing import current_command_line, make_console, print_name_and_text
from houseexpo.errors import INTERRUPTED, NO_PLAN, NOT_DONE, ConfigError, find_transient_fault
from houseexpo.progress import is_quiet, is_verbose

if TYPE_CHECKING:
    from pipeline.batch.assemble import BuildResult
    from pipeline.config_file import BuildConfig
    from pipeline.inspection import Inspection


def resolve_manifest(given: Path | None) -> Path | None:
    """Return the manifest file that the command line names by its path or by its bundled name."""
    from pipeline.config_file import find_manifest

    return None if given is None else find_manifest(given)


_LIMITS = {"seconds": "seconds", "memory": "memory_gb"}
"""Options of a build that are limits, and their keys in a manifest."""


def load_build_config(config: Path | None, given: Mapping[str, Any]) -> BuildConfig:
    """Return the manifest's settings, or the defaults, with what the command line gives in their place.

    Model folders that are given count from the folder that the command is run in, wherever the settings are used. The
    file of weights is read.
    """
    from pipeline.config_file import BuildConfig, absolute_folders, load_config
    from pipeline.stages.logistic import read_model_weights

    settings = BuildConfig() if config is None else load_config(config)
    chosen = {name: value for name, value in given.items() if value not in (None, ())}
    if "model_path" in chosen:
        chosen["model_path"] = absolute_folders(chosen["model_path"], Path())
    if "weights" in chosen:
        chosen["weights"] = str(Path(chosen["weights"]).absolute())
    limits = {limit: chosen.pop(name) for name, limit in _LIMITS.items() if name in chosen}
    settings = replace(settings, limits=replace(settings.limits, **limits))
    if "keep_copies" in chosen:
        dedupe = replace(settings.stages.dedupe, off=chosen.pop("keep_copies"))
        settings = replace(settings, stages=replace(settings.stages, dedupe=dedupe))
    settings = replace(settings, build=replace(settings.build, **chosen))
    for folder in filter(None, settings.build.model_path.split(os.pathsep)):
        if not Path(folder).is_dir():
            raise ConfigError(f"model_path: expected a folder, found none at {folder}; check the path")
    if settings.build.weights:
        weights = read_model_weights(Path(settings.build.weights))
        settings = replace(settings, stages=replace(settings.stages, weights=weights))
    return settings


@contextmanager
def end_cleanly() -> Iterator[Callable[[], None]]:
    """On Ctrl-C (exit code 130) or a transient fault such as a full disk (3), print the command that continues.

    Yields ``handle_ctrl_c``'s function.
    """
    goes_on = f"what is done is kept, and this goes on with the rest: {current_command_line()}"
    last_words = f"interrupted; {goes_on}"
    try:
        with handle_ctrl_c(last_words) as check:
            yield check
    except KeyboardInterrupt:
        typer.echo(last_words, err=True)
        raise typer.Exit(INTERRUPTED) from None
    except OSError as error:
        if (fault := find_transient_fault(error)) is None:
            raise
        where = f" ({fault.filename})" if fault.filename else ""
        typer.secho(f"stopped: {fault.strerror or fault}{where}; when that has passed: {goes_on}", fg="red", err=True)
        raise typer.Exit(NOT_DONE) from None


def show_outcomes(data_set: BuildResult, rows: Sequence[Mapping[str, Any]], out: str) -> int:
    """Show the outcome of a build whose index has these rows; return the exit code."""
    from pipeline.terminal_report import print_outcome

    print_outcome(data_set, rows, out, make_console(quiet=is_quiet()), verbose=is_verbose())
    if data_set.not_done:
        return NOT_DONE
    if data_set.is_fruitless:
        typer.secho(f"nothing became a plan; {out}/rejected.jsonl says why", fg=typer.colors.RED, err=True)
        return NO_PLAN
    return 0


def show_inspection(found: Inspection, source: str, out: Path) -> None:
    """Say which house and level was inspected, where its pictures are, and the outcome."""
    from pipeline.quality import main_grounds_in_words
    from pipeline.terminal_report import ADVICE, describe_oddity

    printed = make_console()
    printed.print(str(found.shown or source), highlight=False, soft_wrap=True)
    for name in found.pictures:
        printed.print(f"  {out / name}", style="dim", highlight=False, soft_wrap=True)
    if found.rejection is not None:
        print_name_and_text(printed, "rejected", str(found.rejection), "red")
        return
    quality = ""
    if found.quality is not None:
        grounds = "; ".join(main_grounds_in_words(found.quality))
        quality = f"quality {found.quality.score:.2f}" + (f" ({grounds})" if grounds else "")
    print_name_and_text(printed, "plan", quality, "green")
    if found.plan is not None and (odd := describe_oddity(len(found.plan.rooms), found.plan.area)):
        print_name_and_text(printed, "implausible", f"{odd}; {ADVICE}", "yellow")


def show_unapplied_corrections(found: Inspection) -> None:
    """Say which corrections by hand belong to other houses than the inspected one."""
    from houseexpo.plan.ids import is_of_input
    from houseexpo.words import unknown_name_message

    corrected = found.shown.corrected if found.shown else ()
    if found.shown is None or not corrected or any(is_of_input(name, found.shown.house) for name in corrected):
        return
    typer.secho(
        f"no correction by hand is of this house: {unknown_name_message(found.shown.house, corrected)}; of a folder, "
        "inspect takes the ids of its build: name the folder, and the house by --id",
        fg="yellow",
        err=True,
    )


# Ctrl-C ends a command cleanly and in time, also where a library swallows it while it is imported.


_ENDS_WITHIN_S = 4.0


@contextmanager
def handle_ctrl_c(last_words: str) -> Iterator[Callable[[], None]]:
    """Let Ctrl-C raise KeyboardInterrupt, and yield a function that raises it again if a library swallowed it.

    1. What does not end within some seconds is ended, with ``last_words``; the workers end with their parent.
    2. So is everything at once where Ctrl-C comes a second time.
    """
    asked = threading.Event()

    def end() -> None:
        sys.stderr.write(f"{last_words}\n")
        sys.stderr.flush()
        os._exit(INTERRUPTED)

    deadline = threading.Timer(_ENDS_WITHIN_S, end)
    deadline.daemon = True

    def interrupt(*_: object) -> None:
        if asked.is_set():
            end()  # R2
        asked.set()
        deadline.start()  # R1
        raise KeyboardInterrupt

    def check() -> None:
        if asked.is_set():
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield check
    finally:
        deadline.cancel()
        signal.signal(signal.SIGINT, before)
