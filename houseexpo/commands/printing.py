"""Print the output of commands: tables for people, JSON for programs; a reader that closes the pipe causes no error."""

from __future__ import annotations

import json
import os
import shlex
import sys
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from houseexpo.progress import discard_further

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console
    from rich.table import Table


_PROBLEMS_PRINTED = 10
"""The number of problems that are printed one by one."""
_PIPED_WIDTH = 160
"""The columns of output to a file or a pipe: ids, files and rules stay whole, so that programs can find them."""
_PADDING = 3
"""The width around a column of a table: a space on both sides, and a line."""


def make_console(*, stderr: bool = False, quiet: bool = False) -> Console:
    """Return a console that prints nothing more after its reader has gone (``| head -1``); the command continues.

    Output to a file or a pipe is ``_PIPED_WIDTH`` wide unless COLUMNS says otherwise.

    Text in square brackets is printed literally, since paths, ids and labels may contain it. Styles are given by name.
    """
    from rich.console import Console

    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() or os.environ.get("COLUMNS") else _PIPED_WIDTH

    class PipedConsole(Console):
        def on_broken_pipe(self) -> None:  # rich would exit with code 1
            self.quiet = True
            discard_further(sys.stderr if self.stderr else sys.stdout)

    return PipedConsole(stderr=stderr, quiet=quiet, markup=False, width=width)


def print_name_and_text(out: Console, name: str, said: str, style: str = "bold") -> None:
    """Print a name, in bold or another style, and a text about it on the same line."""
    out.print(f"{name} ", style=style, end="", highlight=False)
    out.print(said, highlight=False, soft_wrap=True)


def new_table(title: str | None = None, *, header: bool = True) -> Table:
    """Return an empty table in the one style of all commands: a bold title and a rule under the heads, no frame."""
    from rich import box
    from rich.table import Table

    return Table(
        title=title,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD if header else None,
        padding=(0, 1),
        show_header=header,
    )


def print_table(out: Console, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table of names and numbers; columns that do not fit continue below, with the names repeated.

    Heads are broken between words. Only names may be broken within a word, if they need more than half of the screen.
    """
    names, *columns = ((head, cells) for head, *cells in zip(heads, *rows, strict=True))
    first = min(max(map(len, (names[0], *names[1]))), out.width // 2)
    widths = [max(map(len, (*head.split(), *cells))) for head, cells in columns]
    for part in _side_by_side(widths, out.width - first - _PADDING - 1):
        table = new_table()
        table.add_column(names[0], width=first, overflow="fold")
        for i in part:
            table.add_column(fill(columns[i][0], widths[i]), justify="right")
        for name, *cells in zip(names[1], *(columns[i][1] for i in part), strict=True):
            table.add_row(name, *cells)
        out.print(table)


def _side_by_side(widths: Sequence[int], room: int) -> list[list[int]]:
    """Return the columns' numbers in parts, each of which fits in ``room`` or has a single column."""
    parts: list[list[int]] = [[]]
    left = room
    for i, width in enumerate(widths):
        if width + _PADDING > left and parts[-1]:
            parts.append([])
            left = room
        parts[-1].append(i)
        left -= width + _PADDING
    return parts


def print_json(value: Any) -> None:  # any value that json accepts
    """Print a value as JSON, for other programs."""
    sys.stdout.write(json.dumps(value, indent=2, ensure_ascii=False) + "\n")


def current_command_line() -> str:
    """Return the running command as a line for a shell."""
    by_module = Path(sys.argv[0]).name == "__main__.py"
    return shlex.join(sys.orig_argv if by_module else ["houseexpo", *sys.argv[1:]])


def print_problems(out: Console, what: str, problems: Sequence[str]) -> None:
    """Print the first problems, each after ``what``, and the number of further ones."""
    for problem in problems[:_PROBLEMS_PRINTED]:
        out.print(f"{what}: {problem}", highlight=False, soft_wrap=True)
    if len(problems) > _PROBLEMS_PRINTED:
        out.print(f"and {len(problems) - _PROBLEMS_PRINTED} more", highlight=False)
