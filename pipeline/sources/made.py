"""The names of sources that are made: ``procedural:COUNT``, ``procedural:COUNT?style=home``."""

from __future__ import annotations

import re
from dataclasses import dataclass

_NAME = re.compile(r"procedural:(\d+)(?:\?style=(plain|home))?", re.ASCII)


@dataclass(frozen=True)
class Made:
    """How many houses, of which style."""

    count: int
    style: str


def made_of(source: str) -> Made | None:
    """Return what such a name asks for, None where it is none."""
    found = _NAME.fullmatch(source)
    return None if found is None else Made(int(found[1]), found[2] or "plain")
