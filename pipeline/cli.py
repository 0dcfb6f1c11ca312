"""The commands ``build`` and ``inspect``: they read the command line, call, and show what came of it.

What is heavy is imported where a command runs, so that ``houseexpo --help`` answers at once.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from pipeline.batch.disk import printable
from pipeline.interrupts import EXIT_CODE as INTERRUPTED
from pipeline.interrupts import interruptible

if TYPE_CHECKING:
    from pipeline.config_file import BuildConfig

DAMAGED, NOT_DONE = 1, 3
"""Exit codes, beside 0, 2 (the command cannot be carried out) and that of Ctrl-C."""

Up = Literal["auto", "y", "z"]

_Config = Annotated[
    Path | None, typer.Option(help="Manifest: sources and parameters, a TOML file.", show_default=False)
]
_Seed = Annotated[int | None, typer.Option(min=0, help="Seed of all that is drawn at random.", show_default="0")]
_Up = Annotated[Up | None, typer.Option(help="Up axis of mesh files.", show_default="auto")]
_Units = Annotated[
    str | None, typer.Option(help="Units of mesh files: m, cm, mm, in, ft, or metres in a unit.", show_default="auto")
]
_Scale = Annotated[float | None, typer.Option(help="Scale of model houses: 20 for 1:20.", show_default="1")]
_StoreyHeight = Annotated[
    float | None, typer.Option(help="Height of a storey in metres; the scale follows from it.", show_default=False)
]
_ModelPath = Annotated[
    str | None, typer.Option(help="Folders with Gazebo models, divided as in PATH.", show_default=False)
]
_Furniture = Annotated[bool | None, typer.Option("--furniture/--no-furniture", help="Furniture is an obstacle too.")]


_MinQuality = Annotated[
    float | None, typer.Option(min=0, max=1, help="Reject plans less sure than this.", show_default="0")
]


def build(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SOURCE",
            help="A mesh, a folder, an IFC file, a SUNCG root or procedural:COUNT; with --verify, a data set.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The data set folder.", show_default=False)] = None,
    config: _Config = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes.", show_default="one a core")] = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Take the first N inputs only.", show_default=False)] = None,
    seed: _Seed = None,
    up: _Up = None,
    units: _Units = None,
    scale: _Scale = None,
    storey_height: _StoreyHeight = None,
    furniture: _Furniture = None,
    add: Annotated[bool, typer.Option("--add", help="Keep plans of other sources that OUT holds.")] = False,
    replace_others: Annotated[bool, typer.Option("--replace", help="Remove what else OUT holds of builds.")] = False,
    model_path: _ModelPath = None,
    min_quality: _MinQuality = None,
    rehash: Annotated[bool, typer.Option("--rehash", help="Read all inputs to see whether they changed.")] = False,
    verify: Annotated[bool, typer.Option("--verify", help="Check the hashes of a data set; build nothing.")] = False,
) -> None:
    """Build a data set of floor plans from 3D houses.

    Every input ends as a plan, a rejection with its reason, or a duplicate.

    A build that was interrupted goes on where it stopped.
    """
    if verify:
        _verify([*map(Path, sources or ()), *([out] if out else [])])
        return
    if out is None:
        raise typer.BadParameter("missing; name the data set folder", param_hint="--out")
    if printable(str(out)) != str(out):
        raise typer.BadParameter("its name is no UTF-8; choose another", param_hint="--out")
    if add and replace_others:
        raise typer.BadParameter("expected --add or --replace, found both")
    given = {
        "sources": tuple(sources or ()),
        "limit": limit,
        "seed": seed,
        "up": up,
        "units": units,
        "scale": scale,
        "storey_height": storey_height,
        "furniture": furniture,
        "model_path": model_path,
        "min_quality": min_quality,
    }
    others = "add" if add else "replace" if replace_others else "refuse"
    last_words = f"interrupted; what is done is kept, and this goes on with the rest: {shlex.join(_command())}"
    try:
        with interruptible(last_words) as check:
            not_done = _build(config, given, out, workers, others, rehash, check)
    except KeyboardInterrupt:
        typer.echo(last_words, err=True)
        raise typer.Exit(INTERRUPTED) from None
    if not_done:
        raise typer.Exit(NOT_DONE)


def _build(
    config: Path | None,
    given: dict[str, Any],
    out: Path,
    workers: int | None,
    others: str,
    rehash: bool,
    check: Callable[[], None],
) -> int:
    """Build, show what came of it, and return how many inputs are not done yet."""
    from rich.console import Console

    from houseexpo.workers import cores
    from pipeline.batch.build import build as run_build
    from pipeline.batch.folder import Others
    from pipeline.display import Display
    from pipeline.overrides import load_overrides
    from pipeline.report import longest_table, notes_lines, outcome_table, plans_line, reasons_lines
    from pipeline.report_page import write_report

    check()
    settings = _settings(config, given)
    console = Console()
    with Display(Console(stderr=True), check) as display:
        data_set = run_build(
            settings,
            out,
            overrides=load_overrides(config),
            workers=workers or cores(),
            progress=display.progress,
            others=Others(others),
            rehash=rehash,
            ended=display.ended,
        )
        if not data_set.unchanged:
            write_report(data_set, display.progress)
    if data_set.unchanged:
        console.print("nothing to do: the data set stands as its inputs are")
    console.print(outcome_table(data_set.stats))
    if len(data_set.entries) > 1 and not data_set.unchanged:
        console.print(longest_table(data_set))
    for note in notes_lines(data_set):
        console.print(note, markup=False, highlight=False)
    if (line := plans_line(data_set.stats)) is not None:
        console.print(line, highlight=False)
    for line in reasons_lines(data_set):
        console.print(line, style="red", markup=False, highlight=False)
    if data_set.not_done:
        console.print(
            f"not done yet: {data_set.not_done}; build again when what kept them from it has passed", style="yellow"
        )
    for what, path in {
        "data set": out,
        "pictures": out / ".build/pictures",
        "report": out / ".build/report.html",
    }.items():
        console.print(f"[bold]{what:10}[/]{path}", highlight=False, soft_wrap=True)
    return data_set.not_done


def _verify(folders: list[Path]) -> None:
    """Check data sets; ends with 1 where something is damaged."""
    from pipeline.batch.verify import verify

    if not folders:
        raise typer.BadParameter("name the data set", param_hint="--verify")
    wrong = [f"{folder}: {line}" for folder in folders for line in verify(folder)]
    for line in wrong:
        typer.secho(line, fg=typer.colors.RED)
    if wrong:
        typer.echo(f"{len(wrong)} files are not as they were written; the build's own command writes them again")
        raise typer.Exit(DAMAGED)
    typer.echo("every file is as it was written")


def _command() -> list[str]:
    return ["houseexpo", *sys.argv[1:]] if Path(sys.argv[0]).name != "__main__.py" else sys.orig_argv


def inspect(
    source: Annotated[str, typer.Argument(help="One house: a mesh, an IFC file, a SUNCG root or procedural:1.")],
    out: Annotated[Path, typer.Option(help="Folder for the pictures.", show_default=False)],
    level: Annotated[int, typer.Option(min=0, help="Which level, counted from the lowest.")] = 0,
    config: _Config = None,
    seed: _Seed = None,
    up: _Up = None,
    units: _Units = None,
    scale: _Scale = None,
    storey_height: _StoreyHeight = None,
    furniture: _Furniture = None,
    model_path: _ModelPath = None,
) -> None:
    """Show what each stage makes of one house: a PNG for each, and all on one sheet.

    Ends with 1 where the house is rejected.
    """
    from rich.console import Console
    from rich.markup import escape

    from pipeline.inspection import inspect_house
    from pipeline.overrides import load_overrides
    from pipeline.quality import main_grounds

    given = {
        "sources": (source,),
        "seed": seed,
        "up": up,
        "units": units,
        "scale": scale,
        "storey_height": storey_height,
        "furniture": furniture,
        "model_path": model_path,
    }
    console = Console()
    found = inspect_house(_settings(config, given), load_overrides(config), level, out)
    console.print(str(found.shown or source), highlight=False, soft_wrap=True, markup=False)
    for name in found.pictures:
        console.print(f"  {out / name}", style="dim", highlight=False, soft_wrap=True)
    if found.rejection is not None:
        console.print("[red]rejected[/]", escape(str(found.rejection)), highlight=False, soft_wrap=True)
        raise typer.Exit(1)
    verdict = ""
    if found.quality is not None:
        grounds = "; ".join(main_grounds(found.quality))
        verdict = f"quality {found.quality.score:.2f}" + (f" ({grounds})" if grounds else "")
    console.print("[green]plan[/]", verdict, highlight=False, soft_wrap=True)


def _settings(config: Path | None, given: dict[str, Any]) -> BuildConfig:
    """Return the manifest's settings, or the defaults, with what the command line gives in their place."""
    from pipeline.config_file import BuildConfig, load_config

    settings = BuildConfig() if config is None else load_config(config)
    chosen = {name: value for name, value in given.items() if value not in (None, ())}
    return replace(settings, build=replace(settings.build, **chosen))
