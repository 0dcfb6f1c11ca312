"""Show on standard error how many items of a loop are done: a bar on a terminal, else a line at most every 10 s."""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Iterable, Iterator
from typing import TextIO, TypeVar

T = TypeVar("T")

EVERY_S = 10.0
"""Seconds between two lines if there is no terminal."""


def show_progress(items: Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """Yield the items and show how many of ``total`` are done, unless ``is_quiet``.

    A terminal shows a bar, which disappears at the end. Elsewhere, work shorter than ``EVERY_S`` writes no line.
    """
    if is_quiet():
        yield from items
        return
    if not sys.stderr.isatty():
        yield from _in_lines(items, what, total)
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import track

    yield from track(items, description=escape(what), total=total, console=Console(stderr=True), transient=True)


def _in_lines(items: Iterable[T], what: str, total: int | None) -> Iterator[T]:
    last = time.monotonic()
    for done, item in enumerate(items):  # the items before this one are done
        if time.monotonic() - last >= EVERY_S:
            last = time.monotonic()
            try:
                sys.stderr.write(f"{what}: {done:,}" + ("\n" if total is None else f" of {total:,}\n"))
                sys.stderr.flush()
            except BrokenPipeError:  # the work goes on without a reader (`2>&1 | head`)
                discard_further(sys.stderr)
        yield item


def discard_further(stream: TextIO) -> None:
    """Discard what else is written to standard output or standard error, since its reader has gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def is_verbose() -> bool:
    """Return whether the logger ``houseexpo`` reports each action (``houseexpo -v``)."""
    return logging.getLogger("houseexpo").getEffectiveLevel() <= logging.INFO


def is_quiet() -> bool:
    """Return whether the logger ``houseexpo`` reports errors only (``houseexpo -q``)."""
    return logging.getLogger("houseexpo").level > logging.WARNING
