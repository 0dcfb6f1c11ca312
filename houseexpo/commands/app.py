"""Build and run the command ``houseexpo``, which finds its subcommands through entry points.

A command is loaded when it is called or when ``--help`` lists the commands. If one cannot be loaded, it reports that
and does not affect the others.
"""

from __future__ import annotations

import errno
import logging
import sys
from collections.abc import Callable
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, Any, Final

import typer
from typer.core import TyperCommand, TyperGroup

from houseexpo import __version__
from houseexpo.commands.printing import current_command_line
from houseexpo.errors import INTERRUPTED, NOT_DONE, HouseExpoError, MissingDependencyError, find_transient_fault
from houseexpo.progress import discard_further
from houseexpo.words import suggest_name

GROUP = "houseexpo.commands"
"""The group of entry points: functions that typer can call, or a ``typer.Typer`` of several, by the commands' names."""

_OURS: Final = ("houseexpo", "pipeline", "stats")
"""The packages whose log messages are shown."""

_SETTINGS = {"help_option_names": ["-h", "--help"]}


class _Command(TyperCommand):
    """A command that refuses empty words: an unset variable of a script would name the current folder as a path."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        given, _, _ = self.make_parser(ctx).parse_args(list(args))
        params: list[Any] = self.params
        for param in params:
            words = given.get(param.name)
            if "" in (words if isinstance(words, list | tuple) else [words]):
                raise typer.BadParameter(
                    "expected a value, found an empty word; check the variable that it comes from", ctx=ctx, param=param
                )
        return super().parse_args(ctx, args)


class _Commands(TyperGroup):
    """The commands of the entry points; an error that houseexpo raises becomes one red line and exit code 2."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002  # click's signature
        known = [name for names in PANELS.values() for name in names]
        return sorted(_entries(), key=lambda name: (known.index(name) if name in known else len(known), name))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        entry = _entries().get(cmd_name)
        return None if entry is None else _command(entry)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command; if it is unknown, suggest a similar one."""
        if args and not args[0].startswith("-") and args[0] not in _entries():
            ctx.fail(f"No such command {args[0]!r}{suggest_name(args[0], _entries())}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except BrokenPipeError:  # `houseexpo info plans | head -1`: the reader has closed the pipe
            discard_further(sys.stdout)
            raise typer.Exit(0) from None
        except KeyboardInterrupt:
            typer.echo(f"interrupted; the same command again: {current_command_line()}", err=True)
            raise typer.Exit(INTERRUPTED) from None
        except (HouseExpoError, OSError) as error:  # OSError: a folder that cannot be written, a full disk
            typer.secho(f"houseexpo: {_message_of(error)}", fg=typer.colors.RED, err=True)
            raise typer.Exit(2 if find_transient_fault(error) is None else NOT_DONE) from None


def _message_of(error: Exception) -> str:
    """Return the message of an error; for errors of the system, the file, the problem and what to do."""
    if not isinstance(error, OSError) or isinstance(error, HouseExpoError) or not error.strerror:
        return str(error)
    where = f"{error.filename}: " if error.filename else ""
    return f"{where}{error.strerror[0].lower()}{error.strerror[1:]}; {_TO_DO.get(error.errno or 0, 'check the path')}"


_TO_DO: Final = {
    errno.ENOSPC: "make room on the disk, and run the same command again",
    errno.EDQUOT: "make room on the disk, and run the same command again",
    errno.EACCES: "choose a place that you may write to, or change its permissions",
    errno.EPERM: "choose a place that you may write to, or change its permissions",
    errno.EROFS: "choose a place that can be written",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
    errno.EADDRINUSE: "choose another port",
}

PANELS: Final = {
    "Make plans": ("demo", "build", "inspect", "assemble", "slurm", "fetch"),
    "Look at plans": ("info", "show", "serve", "review", "stats", "validate"),
    "Use and pass on": ("export", "split", "release", "labels", "fit"),
    "Simulate": ("play", "record", "replay", "ros", "benchmark", "train", "observe", "collect", "prepare"),
}
"""The commands in the groups of ``--help``; others, such as those of plug-ins, come after them."""


def help_panel(command: str) -> str:
    """Return the group of a command in ``--help``."""
    return next((panel for panel, names in PANELS.items() if command in names), "More")


def make_app() -> typer.Typer:
    """Build the command."""
    app = typer.Typer(
        name="houseexpo",
        cls=_Commands,
        help="Turn 3D house models into 2D floor plans, in bulk.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings=_SETTINGS,
    )
    app.callback()(_root)
    return app


def main(*command: str) -> None:
    """Run the command line with ``command`` before the arguments (``python -m pipeline`` runs ``houseexpo build``)."""
    make_app()(args=[*command, *sys.argv[1:]], prog_name="houseexpo")


def _entries() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _command(entry: EntryPoint) -> Any:  # a click command, made by typer
    function = _load_command(entry)
    if isinstance(function, typer.Typer):
        return _group(entry.name, function)
    alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False, context_settings=_SETTINGS)
    broken = function.__name__ == "cannot_be_loaded"
    settings = {"ignore_unknown_options": True, "allow_extra_args": True} if broken else {}
    alone.command(entry.name, cls=_Command, context_settings={**_SETTINGS, **settings})(function)
    found: Any = typer.main.get_command(alone)
    found.params += _verbosity_options()
    found.epilog = examples_text(entry.name)
    found.rich_help_panel = help_panel(entry.name)
    return found


def _group(name: str, commands: typer.Typer) -> Any:
    """Return a command with subcommands."""
    for registered in commands.registered_commands:
        registered.cls = _Command
    found: Any = typer.main.get_group(commands)
    found.name = name
    found.rich_help_panel = help_panel(name)
    for command in (found, *found.commands.values()):
        command.context_settings = {**_SETTINGS, **command.context_settings}
        command.params = [each for each in command.params if not each.name.endswith("_completion")]
        command.params += _verbosity_options()
    return found


def _verbosity_options() -> list[Any]:
    """Return the options -v and -q of a command, so that they may also follow its name."""
    alone = typer.Typer(add_completion=False)
    alone.command()(_declare_verbosity)
    found = typer.main.get_command(alone).params
    for option in found:
        option.expose_value = False  # its callback handles it, not the command
    return found


def _load_command(entry: EntryPoint) -> Callable[..., Any] | typer.Typer:
    """Return a command's function or Typer; if it cannot be loaded, a function that reports why."""
    package = entry.module.partition(".")[0]
    spec = PathFinder.find_spec(package)  # finds it without importing it
    if spec is not None and spec.submodule_search_locations is None and entry.module != package:
        return _command_that_fails(
            entry, f"{spec.origin} hides the installed package {package!r}; run it from another folder"
        )
    try:
        function: Callable[..., Any] | typer.Typer = entry.load()
    except Exception as error:  # noqa: BLE001  # whatever a plug-in does, the others work
        return _command_that_fails(entry, f"{type(error).__name__}: {error}")
    return function


def _command_that_fails(entry: EntryPoint, why: str) -> Callable[..., Any]:
    def cannot_be_loaded() -> None:
        raise MissingDependencyError(f"{entry.name} cannot be loaded: {why}")

    cannot_be_loaded.__doc__ = f"Cannot be loaded: {why}."
    return cannot_be_loaded


class _PlainFormatter(logging.Formatter):
    """Says what happened, without the module's name: "note: ..." or, from ERROR on, "error: ..."."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of a record."""
        return f"{'error' if record.levelno >= logging.ERROR else 'note'}: {super().format(record)}"


_WITH_MODULE = logging.Formatter("%(levelname)s %(name)s: %(message)s")


def _set_up_logs(verbose: int, *, quiet: bool) -> None:
    """Send the log messages of our packages to standard error, from WARNING on.

    ``-q`` shows only errors and no progress bars, ``-v`` each action, ``-vv`` everything.
    """
    level = logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_WITH_MODULE if verbose else _PlainFormatter())
    for name in _OURS:
        logger = logging.getLogger(name)
        logger.setLevel(level)
        logger.handlers[:] = [handler]
        logger.propagate = False


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"houseexpo {__version__}")
        raise typer.Exit


def _set_verbose(times: int) -> None:
    if times:
        _set_up_logs(times, quiet=False)


def _set_quiet(asked: bool) -> None:
    if asked:
        _set_up_logs(0, quiet=True)


_MORE = "Report each action; -vv: report more."
_LESS = "Report only results and errors, without progress bars and notes; of a build only errors."


def _declare_verbosity(
    verbose: Annotated[
        int, typer.Option("--verbose", "-v", count=True, callback=_set_verbose, help=_MORE, show_default=False)
    ] = 0,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", callback=_set_quiet, help=_LESS)] = False,
) -> None:
    """Declare the options that every command has."""


def _root(
    _: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")] = False,
    verbose: Annotated[int, typer.Option("--verbose", "-v", count=True, help=_MORE, show_default=False)] = 0,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help=_LESS)] = False,
) -> None:
    """Turn 3D house models into 2D floor plans, in bulk."""
    _set_up_logs(verbose, quiet=quiet)


# Examples of the commands, which stand at the end of a command's ``--help``.


EXAMPLES: Final = {
    "demo": ("demo try",),
    "build": (
        "build house.glb --out plans/house",
        "build houses/ --out plans/houses --min-quality 0.8",
        "build map.yaml --out plans/map",
        "build houses/ --weights mine.toml --out plans/ours",
        "build procedural:20 --seed 7 --out plans/homes",
    ),
    "inspect": ("inspect house.glb --out pictures", "inspect houses/ --id villa_L1 --out pictures"),
    "assemble": ("assemble plans/shared",),
    "slurm": ("slurm houses.toml --shards 256 --out plans/all --submit",),
    "fetch": ("fetch --subset 100",),
    "info": ("info plans/demo", "info plans/house/json/try_house.json"),
    "show": ("show plans/demo --sample 12 --out plans.png", "show try_house --dataset plans/house --out house.svg"),
    "review": ("review house.ifc", "review plans/demo --port 8080"),
    "serve": ("serve plans/demo", "serve plans/demo plans/houses --port 8080"),
    "stats": ("stats plans/demo --out report.html", "stats plans/demo --list-bad --radius 0.3"),
    "validate": ("validate plans/demo",),
    "export": (
        "export plans/demo --to ros --out maps",
        "export plans/house --to glb --building house --out meshes",
        "export run --to onnx --out run",
    ),
    "split": ("split plans/demo --train 0.7 --val 0.1 --test 0.2",),
    "release": ("release plans/demo --out release",),
    "labels": ("labels plans/demo --out labels.jsonl",),
    "fit": ("fit labels.jsonl --out mine.toml",),
    "play": ("play plans/demo", "play map.yaml"),
    "record": ("record plans/demo --policy frontier --out run.gif",),
    "replay": ("replay run.mcap --out map",),
    "ros": ("ros plans/demo --map slam",),
    "train": ("train exploration plans/demo --out run", "train predictor --out predictor"),
    "observe": ("observe plans/demo --limit 1000 --out pairs",),
    "collect": ("collect plans/demo --policy frontier --out collected/frontier-v0",),
    "prepare": ("prepare plans/demo",),
}
"""Arguments that follow ``houseexpo``, by the name of the command."""


def examples_text(name: str) -> str | None:
    """Return the examples of a command as the end of its help, a paragraph for each line; None if it has none."""
    lines = [f"houseexpo {example}" for example in EXAMPLES.get(name, ())]
    return "\n\n".join(["Examples:" if len(lines) > 1 else "Example:", *lines]) if lines else None
