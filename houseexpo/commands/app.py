"""The command ``houseexpo``: it finds its commands through entry points and owns nothing else."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from houseexpo import __version__
from houseexpo.errors import HouseExpoError

GROUP = "houseexpo.commands"
"""Entry points of this group are functions that typer can call; their names are the commands' names."""


class _Commands(TyperGroup):
    """Turns an error that houseexpo raises on purpose into one red line and exit code 2."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except (HouseExpoError, OSError) as error:  # OSError: a folder that cannot be written, a full disk
            typer.secho(f"houseexpo: {error}", fg=typer.colors.RED, err=True)
            raise typer.Exit(2) from None


def make_app() -> typer.Typer:
    """Build the command from every installed entry point, in the order of their names."""
    app = typer.Typer(
        name="houseexpo",
        cls=_Commands,
        help="Turn 3D house models into 2D floor plans, in bulk.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_root)  # keeps the commands' names even where only one is installed
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        app.command(entry.name)(entry.load())
    return app


def main(*command: str) -> None:
    """Run the command line; ``command`` is put before the arguments (``python -m pipeline`` is ``houseexpo build``)."""
    make_app()(args=[*command, *sys.argv[1:]])


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"houseexpo {__version__}")
        raise typer.Exit


def _root(
    _: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Say which version.")] = False,
) -> None:
    """Turn 3D house models into 2D floor plans, in bulk."""
