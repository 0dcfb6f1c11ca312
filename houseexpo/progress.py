"""A progress bar on standard error for what takes long; none where nobody watches."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")


def watched(items: Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """Yield the items; on a terminal a bar shows how many of ``total`` are done, and it vanishes at the end.

    There is none where ``is_quiet``.
    """
    if not sys.stderr.isatty() or is_quiet():
        yield from items
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import track

    yield from track(items, description=escape(what), total=total, console=Console(stderr=True), transient=True)


def is_quiet() -> bool:
    """Whether the logger ``houseexpo`` is told to report errors only (``houseexpo -q``)."""
    return logging.getLogger("houseexpo").level > logging.WARNING
