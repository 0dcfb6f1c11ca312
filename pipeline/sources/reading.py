"""Which files a reader reads: what a result depends on.

Python tells of every file that is opened (its audit event ``open``), so that a reader need not keep a list, and a
library that opens a second file by itself is heard too. What is read otherwise, by a library in C++ or by asking
whether a file exists, a reader reports by ``report``.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_CODE = (".py", ".pyc", ".so", ".nbi", ".nbc")
"""A folder of houses may hold the program too: its own files are no part of a house."""

_listening: list[tuple[tuple[str, ...], set[str]]] = []
_hooked: list[bool] = []


@contextmanager
def recorded(*folders: Path) -> Iterator[set[str]]:
    """Collect what is opened within the folders, found or not: named from the first of them, or in full."""
    if not _hooked:
        sys.addaudithook(_hear)
        _hooked.append(True)
    names: set[str] = set()
    _listening.append((tuple(os.path.abspath(folder) + os.sep for folder in folders), names))  # noqa: PTH100 - links stay
    try:
        yield names
    finally:
        _listening.pop()


def report(path: str | os.PathLike[str]) -> None:
    """Say that what is being read depends on this file, or on its absence."""
    for folders, names in _listening:
        full = os.path.abspath(path)  # noqa: PTH100
        if full.startswith(folders) and not full.endswith(_CODE):
            names.add(full.removeprefix(folders[0]))


def _hear(event: str, arguments: tuple[object, ...]) -> None:
    if event == "open" and _listening and isinstance(path := arguments[0], str | bytes | os.PathLike):
        report(os.fsdecode(path))
