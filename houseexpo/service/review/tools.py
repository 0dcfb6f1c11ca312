"""List the words of a storey as the tools of the Review page: their keys, and the input that each needs.

Everything comes from the vocabulary (``houseexpo.corrections.vocabulary.WORDS``), so a new word has a tool.

R1  Well-known words have fixed keys. Another word has its first free letter, else the alphabet's first free letter.
R2  The input of a word follows from its syntax: its points, "..." for further points, a text for a label.
R3  Ends and corners snap to walls; points that name the region around them do not.
"""

from __future__ import annotations

from string import ascii_lowercase
from typing import Final

import msgspec

from houseexpo.corrections.vocabulary import WORDS, Word

_TAKEN: Final = frozenset("kxnuybjfghqvz")
"""Keys of decisions on a whole plan, of the build, of undo and redo, of the next house without a plan, of layers."""
_KNOWN: Final = {
    "door": "d",
    "entrance": "e",
    "opening": "p",
    "wall": "w",
    "no_door": "t",
    "no_room": "r",
    "room": "i",
    "one_room": "o",
    "label": "l",
}


class Tool(msgspec.Struct, frozen=True):
    """A word on the page.

    Attributes
    ----------
    title
        The word as people read it.
    says
        Its statement about a storey.
    points
        The least number of points.
    more
        Whether it takes further points.
    text
        Whether it asks for a label too.
    snaps
        Whether its points snap.
    """

    word: str
    key: str
    title: str
    says: str
    points: int
    more: bool
    text: bool
    snaps: bool


def tools() -> list[Tool]:
    """Return a tool for each word, in the order of the vocabulary."""
    keys: dict[str, str] = {word: key for word, key in _KNOWN.items() if word in WORDS}
    for word in WORDS:
        if word not in keys:  # R1
            keys[word] = next(key for key in (*word, *ascii_lowercase) if _is_free(key, keys))
    return [_tool(word, keys[word]) for word in WORDS]


def _is_free(key: str, keys: dict[str, str]) -> bool:
    return key in ascii_lowercase and key not in _TAKEN and key not in keys.values()


def _tool(word: Word, key: str) -> Tool:
    form = WORDS[word]  # R2
    written, title = form.written, word.replace("_", " ").capitalize()
    points = max(written.count("[x, y"), 1)
    snaps = points > 1 and "around" not in form.says  # R3
    return Tool(word, key, title, form.says, points, "..." in written, '"' in written, snaps)
