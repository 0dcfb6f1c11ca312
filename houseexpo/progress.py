"""How far something long is, on standard error: a bar on a terminal; elsewhere, as in a log, a line now and then."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")

EVERY_S = 10.0
"""Seconds between two lines where there is no terminal."""


def watched(items: Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """Yield the items, and show how many of ``total`` are done; nothing where ``is_quiet``.

    On a terminal that is a bar, which vanishes at the end. What takes less than ``EVERY_S`` leaves no line elsewhere.
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
    for done, item in enumerate(items):  # those before this one are done
        if time.monotonic() - last >= EVERY_S:
            last = time.monotonic()
            sys.stderr.write(f"{what}: {done:,}" + ("\n" if total is None else f" of {total:,}\n"))
            sys.stderr.flush()
        yield item


def is_verbose() -> bool:
    """Whether the logger ``houseexpo`` is told to say what is done (``houseexpo -v``)."""
    return logging.getLogger("houseexpo").getEffectiveLevel() <= logging.INFO


def is_quiet() -> bool:
    """Whether the logger ``houseexpo`` is told to report errors only (``houseexpo -q``)."""
    return logging.getLogger("houseexpo").level > logging.WARNING
