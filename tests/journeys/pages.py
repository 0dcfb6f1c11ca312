"""The lines that the documentation shows, for the journeys that run them."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def python_block(page: str, word: str) -> str:
    """The one block of Python of a page that contains a word."""
    [block] = [lines for lines in blocks(page, "python") if word in lines]
    return block


def commands(page: str, word: str, language: str = "") -> list[str]:
    """The ``houseexpo`` commands, without comments, of the one block of a page that contains a word.

    Blocks of "text" are those that run only with a file of the reader's.
    """
    [block] = [lines for lines in blocks(page, language) if word in lines]
    lines = [re.sub(r"\s+#.*", "", line) for line in block.splitlines() if line.startswith("houseexpo ")]
    return [command.strip() for line in lines for command in line.split("&&")]


def blocks(page: str | Path, language: str) -> list[str]:
    """The blocks of code in a language, "" for commands."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", (ROOT / page).read_text(), re.DOTALL | re.MULTILINE)
    return [lines for name, lines in found if name == language]
