"""Find what a page claims: numbers that somebody measured or counted, and words that promise.

R1  What stands in code, links, pictures, footers and headings claims nothing.
R2  A length, an area, an angle, a resolution, a frequency, a number of pixels or steps, a version, a date, a commit and
    the number of a section, a rule or a seed are dimensions and names, and no figures.
R3  A bound that somebody chose is no figure: "at most 200 plans". A time or memory within a bound is one.
R4  In a sentence, a figure is a number with the unit of what is measured: a share, a time, memory, a rate, how many
    times, points, or a count of the things that these pages count (``COUNTED``).
R5  In a table, each number of each column but the first is a figure, unless the table explains: its last heading is one
    of ``EXPLAINS``, or its first one of ``NAMES``.
R6  A promise is one of the words ``PROMISES``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

NUMBER: Final = r"(?<![\w.,/-])-?\d[\d,]*(?:\.\d+)?(?![\w]|\.\d)"
COUNTED: Final = (
    "plans houses homes files levels rooms doors tests maps models storeys episodes groups faces requests clients "
    "users repositories boxes scans cases clouds circles formats"
)
MONTHS: Final = "January February March April May June July August September October November December"
EXPLAINS: Final = {
    "meaning",
    "content",
    "effect",
    "adds",
    "defaults",
    "from",
    "what it does",
    "a plan breaks it if",
    "licence",
}
NAMES: Final = {
    "key",
    "option",
    "argument",
    "`motion=`",
    "`actions=`",
    "`observation=`",
    "message",
    "array",
    "task",
    "id",
}
PROMISES: Final = re.compile(
    r"\b(never|always|exact|exactly|same bytes|nothing is lost|every input ends)\b", re.IGNORECASE
)


def _any(words: str) -> str:
    return "(?:" + "|".join(words.split()) + ")"


_CODE: Final = re.compile(r"`[^`]*`|!\[[^\]]*\]\([^)]*\)|\]\([^)]*\)")
_NAME: Final = _any(
    "Python NumPy gymnasium release version PufferLib section sections line lines rule Table seed seeds numba tomlkit "
    "CycloneDDS number python ROS RFC"
)
_DIMENSION: Final = _any("m m2 m² cm mm px px/m pixels cells degrees Hz m/s rad inches feet steps beams rays mm² cm²")
_NUMBERS: Final = r"-?\d[\d,.]*(?:(?:,| to| x| or| and|, and) -?\d[\d,.]*)*"
_NO_FIGURE: Final = re.compile(
    rf"""\b[0-9a-f]{{7,40}}\b | \b\d{{4}}-\d\d-\d\d\b | \b(?:19|20)\d\d\b | \b\d{{1,2}}\ {_any(MONTHS)}\b
    | \b{_NAME}\ v?{_NUMBERS} | {_NUMBERS}\ ?{_DIMENSION}\b(?!\ (?:a|per)\ second) | \d[\d,]*\ x\ \d[\d,]*
    | (?:at\ most|at\ least|up\ to|more\ than|less\ than|fewer\ than|the\ first|first|after)
        \ {_NUMBERS}(?![\d,.]*\ ?(?:s|ms|min|MB|GB|kB|%|hours|minutes|seconds)\b)(?!\d)
    | \b\w+\ =\ {_NUMBERS}
    | 95%\ intervals?""",
    re.VERBOSE,
)
_FIGURE: Final = re.compile(
    rf"""(?P<figure>{NUMBER})(?:(?:\ to|\ and|\ or|,|,\ and)\ {NUMBER})*\ ?
    (?:%|(?:ms|us|s|min|minutes?|seconds?|hours?|microseconds|milliseconds?|kB|MB|GB|times\ as|points?)\b|of\ \d
      |(?:steps|frames|frontiers|requests|waypoints)\ (?:a|per)\ second|(?:[\w-]+\ )?{_any(COUNTED)}\b)""",
    re.VERBOSE,
)


@dataclass(frozen=True)
class Block:
    """A paragraph, an entry of a list or a table, with the heading above it and the number of its first line."""

    page: str
    heading: str
    line: int
    text: str

    @property
    def said(self) -> str:
        """The text without code, links and dimensions."""
        return _NO_FIGURE.sub(" ", _CODE.sub(" ", self.text.replace("\n", " ")))

    @property
    def figures(self) -> list[str]:
        """The numbers in it that were measured or counted."""
        if not self.text.startswith("|"):
            return [match["figure"] for match in _FIGURE.finditer(self.said)]
        head, _, *rows = ([cell.strip() for cell in row.strip("|").split("|")] for row in self.text.splitlines())
        if head[-1] in EXPLAINS or head[0] in NAMES:
            return []
        cells = [_NO_FIGURE.sub(" ", _CODE.sub(" ", cell)) for row in rows for cell in row[1:]]
        return [number for cell in cells for number in re.findall(NUMBER, cell)]

    @property
    def promises(self) -> list[str]:
        """The words in it that promise."""
        return [word.lower() for word in PROMISES.findall(_CODE.sub(" ", self.text.replace("\n", " ")))]


def read_blocks(page: Path, name: str) -> Iterator[Block]:
    """Yield the blocks of a page, without those that show code."""
    heading, lines, at, fenced = "", list[str](), 0, False
    for number, line in enumerate([*page.read_text().splitlines(), ""], start=1):
        fence = line.lstrip().startswith(("```", ":::"))
        fenced ^= line.lstrip().startswith("```")
        apart = not line.strip() or fence or fenced or line.startswith("#")
        item = re.match(r"\s*(?:[-*]|\d+\.) ", line) is not None
        if lines and (apart or item or line.lstrip().startswith("|") != lines[0].startswith("|")):
            yield Block(name, heading, at, "\n".join(lines))
            lines = []
        if line.startswith("#") and not fenced:
            heading = line.lstrip("# ")
        elif not apart:
            if not lines:
                at = number
            lines.append(line.strip())
