"""What a build asks of a disk beside whole files, and paths as text."""

from __future__ import annotations

import os
from pathlib import Path

from houseexpo.files import PARTIAL


def sweep(folder: Path) -> None:
    """Remove what interrupted writes left."""
    for file in folder.glob(f"{PARTIAL}*"):
        file.unlink(missing_ok=True)


def to_text(path: str) -> str:
    """Return a path as text that JSON can hold, whatever its bytes are; ``from_text`` undoes it."""
    return os.fsencode(path).decode("latin-1")


def from_text(text: str) -> str:
    """Return the path of ``to_text``."""
    return os.fsdecode(text.encode("latin-1"))


def printable(text: str) -> str:
    """Return text for people: bytes of a file name that are no UTF-8 are shown as a question mark in a lozenge."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace") if not _is_clean(text) else text


def _is_clean(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
