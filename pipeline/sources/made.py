"""The names of sources that are made: ``procedural:COUNT``, and ``procedural:COUNT?style=test``."""

from __future__ import annotations

import re
from dataclasses import dataclass

HOME, TEST = "home", "test"
STYLES = {HOME: HOME, TEST: TEST, "plain": TEST}
"""The styles by the names that a source may give them; "plain" is what the style "test" was called before."""

_NAME = re.compile(r"procedural:(\d+)(?:\?style=(\w+))?", re.ASCII)


@dataclass(frozen=True)
class Made:
    """How many houses, of which style: sound homes, or houses with planted faults for tests."""

    count: int
    style: str

    @property
    def name(self) -> str:
        """The source's full name: it states the style, so that a data set says what went in."""
        return f"procedural:{self.count}?style={self.style}"


def made_of(source: str) -> Made | None:
    """Return what such a name asks for, or None if it is none."""
    found = _NAME.fullmatch(source)
    style = STYLES.get(found[2] or HOME) if found else None
    return Made(int(found[1]), style) if found and style else None
