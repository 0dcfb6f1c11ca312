"""The commands ``build`` and ``inspect``: they read the command line, call, and show what came of it.

What is heavy is imported where a command runs, so that ``houseexpo --help`` answers at once.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from pipeline.config_file import BuildConfig

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
    out: Annotated[Path, typer.Option(help="The data set folder.", show_default=False)],
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SOURCE",
            help="A mesh, a folder, an IFC file, a SUNCG root or procedural:COUNT.",
            show_default=False,
        ),
    ] = None,
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
) -> None:
    """Build a data set of floor plans from 3D houses.

    Every input ends as a plan, a rejection with its reason, or a duplicate.

    A build that was interrupted goes on where it stopped.
    """
    from rich.console import Console

    from houseexpo.workers import cores
    from pipeline.build import build as run_build
    from pipeline.overrides import load_overrides
    from pipeline.report import outcome_table, plans_line, reasons_lines
    from pipeline.report_page import write_report
    from pipeline.store import Others

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
    settings = _settings(config, given)
    if add and replace_others:
        raise typer.BadParameter("expected --add or --replace, found both")
    others = Others.ADD if add else Others.REPLACE if replace_others else Others.REFUSE
    console = Console()
    with _progress(Console(stderr=True)) as bar:
        overrides, show = load_overrides(config), _shown(bar)
        data_set = run_build(
            settings, out, overrides=overrides, workers=workers or cores(), progress=show, others=others
        )
        write_report(data_set, show)
    console.print(outcome_table(data_set.stats))
    if (line := plans_line(data_set.stats)) is not None:
        console.print(line, highlight=False)
    for line in reasons_lines(data_set):
        console.print(line, style="red", markup=False, highlight=False)
    for what, path in {
        "data set": out,
        "pictures": out / ".build/pictures",
        "report": out / ".build/report.html",
    }.items():
        console.print(f"[bold]{what:10}[/]{path}", highlight=False, soft_wrap=True)


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


def _progress(console: Console) -> Progress:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        console=console,
    )


def _shown(bar: Progress) -> Any:
    """Return the callback of a build that keeps a bar for each thing it does."""
    tasks: dict[str, Any] = {}

    def show(what: str, done: int, total: int) -> None:
        if what not in tasks:
            tasks[what] = bar.add_task(what, total=total, rate="")
        speed = next(task.speed for task in bar.tasks if task.id == tasks[what])
        bar.update(tasks[what], completed=done, rate=f"{speed:.1f}/s" if speed and total > 1 else "")

    return show
