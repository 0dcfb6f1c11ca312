"""Write ``docs/commands.md``, the page of all commands, from the code: ``python docs/scripts/commands.py``."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from houseexpo.commands.app import PANELS, help_panel, make_app

PAGE = Path(__file__).parents[1] / "commands.md"
HEAD = """# Commands

This page lists all commands and options. `houseexpo COMMAND --help` shows the same. With `-v` a command reports what it
does, with `-vv` in more detail; with `-q` it shows no progress and no notes, and a build prints errors only. After
`houseexpo --install-completion`, your shell completes commands, options, formats and policies.

| exit code | meaning |
|---|---|
| 0 | success |
| 1 | the command worked, and found a fault: a rejection, a damaged file, plans that were left out |
| 2 | the command cannot be carried out; the message says why |
| 3 | a transient fault, such as a full disk, kept some of the work from being done; run the command again |
| 4 | nothing became a plan |
| 130 | the command was interrupted (Ctrl-C) |
"""


def page() -> str:
    """Return the page."""
    group: Any = typer.main.get_command(make_app())
    names = group.list_commands(None)
    parts = [HEAD]
    for panel in (*PANELS, "More"):
        within = [name for name in names if help_panel(name) == panel]
        parts += [f"## {panel}\n"] * bool(within)
        for name in within:
            command = group.get_command(None, name)
            if hasattr(command, "commands"):
                parts += [_section(f"{name} {part}", command.commands[part]) for part in command.commands]
            else:
                parts.append(_section(name, command))
    return "\n".join(parts)


def _section(name: str, command: Any) -> str:
    lines = [f"### houseexpo {name}", "", inspect.cleandoc(command.help or ""), ""]
    rows = list(_rows(command))
    if rows:
        lines += ["| argument or option | meaning | default |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


def _rows(command: Any) -> Iterator[str]:
    for parameter in command.params:
        if {"--help", "--verbose", "--quiet"} & set(parameter.opts) or getattr(parameter, "hidden", False):
            continue
        is_option = parameter.param_type_name == "option"
        what = ", ".join(f"`{name}`" for name in (*parameter.opts, *parameter.secondary_opts)) if is_option else ""
        what = what or f"`{(parameter.metavar or parameter.name.upper()).strip('[]')}`"
        shown = parameter.show_default
        default = shown if isinstance(shown, str) else _default(parameter) if shown is not False else ""
        yield "| " + " | ".join(each.replace("|", "\\|") for each in (what, parameter.help or "", default)) + " |"


def _default(parameter: Any) -> str:
    value = parameter.default
    if value is None or callable(value) or isinstance(value, bool) or parameter.required:
        return "" if value is not True else "yes"
    return " x ".join(map(str, value)) if isinstance(value, (tuple, list)) else str(value)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
