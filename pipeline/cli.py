"""The commands ``build`` and ``inspect``: they read the command line, call, and show what came of it.

What is heavy is imported where a command runs, so that ``houseexpo --help`` answers at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from pipeline.batch.disk import printable
from pipeline.cli_cluster import assemble_all
from pipeline.cli_parts import NOT_DONE, ended_cleanly, settings_of, show_outcomes

if TYPE_CHECKING:
    from pipeline.executors.outcome import Executor

DAMAGED = 1
"""An exit code, beside 0, 2 (the command cannot be carried out), NOT_DONE and that of Ctrl-C."""

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
    out: Annotated[
        str | None, typer.Option(help="The data set folder; a path, s3://... or gs://...", show_default=False)
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
    rehash: Annotated[bool, typer.Option("--rehash", help="Read all inputs to see whether they changed.")] = False,
    verify: Annotated[bool, typer.Option("--verify", help="Check the hashes of a data set; build nothing.")] = False,
    shard: Annotated[
        str | None, typer.Option(help="Do one part of N: 7/256; houseexpo assemble ends it.", show_default=False)
    ] = None,
    executor: Annotated[Literal["local", "ray"], typer.Option(help="Who does the work.")] = "local",
    address: Annotated[str | None, typer.Option(help="Address of a Ray cluster.", show_default=False)] = None,
) -> None:
    """Build a data set of floor plans from 3D houses.

    Every input ends as a plan, a rejection with its reason, or a duplicate.

    A build that was interrupted goes on where it stopped.
    """
    if verify:
        _verify([*map(Path, sources or ()), *([Path(out)] if out else [])])
        return
    if out is None:
        raise typer.BadParameter("missing; name the data set folder", param_hint="--out")
    if printable(out) != out:
        raise typer.BadParameter("its name is no UTF-8; choose another", param_hint="--out")
    if add and replace_others:
        raise typer.BadParameter("expected --add or --replace, found both")
    if (add or replace_others) and (shard or "://" in out):
        raise typer.BadParameter("--add and --replace are for a build into a folder as a whole; choose another --out")
    if address is not None and executor != "ray":
        raise typer.BadParameter("is for --executor ray", param_hint="--address")
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
    work = _Work(config, given, out, workers, executor, address, rehash)
    with ended_cleanly() as check:
        if shard is not None:
            not_done = _build_shard(work, shard, check)
        elif "://" in out:
            not_done = _build_shard(work, "0/1", check) or assemble_all(out, check, partial=False)
        else:
            not_done = _build(work, others, check)
    if not_done:
        raise typer.Exit(NOT_DONE)


@dataclass(frozen=True)
class _Work:
    """What a build was asked for; ``given`` are the options that take the place of the manifest's."""

    config: Path | None
    given: Mapping[str, Any]
    out: str
    workers: int | None
    executor: str
    address: str | None
    rehash: bool

    def execute(self) -> Executor:
        """Return the executor."""
        from functools import partial

        from houseexpo.workers import cores
        from pipeline.executors import local, ray

        if self.executor == "ray":
            return partial(ray.run, address=self.address)
        return partial(local.run, workers=self.workers or cores())


def _build(work: _Work, others: str, check: Callable[[], None]) -> int:
    """Build, show what came of it, and return how many inputs are not done yet."""
    from rich.console import Console

    from pipeline.batch.build import build as run_build
    from pipeline.batch.folder import Others
    from pipeline.display import Display
    from pipeline.overrides import load_overrides
    from pipeline.report_page import write_report

    check()
    with Display(Console(stderr=True), check) as display:
        data_set = run_build(
            settings_of(work.config, work.given),
            Path(work.out),
            overrides=load_overrides(work.config),
            workers=work.workers or 1,
            progress=display.progress,
            others=Others(others),
            rehash=work.rehash,
            execute=work.execute(),
            ended=display.ended,
        )
        if not data_set.unchanged:
            write_report(data_set, display.progress)
    show_outcomes(data_set, work.out)
    return data_set.not_done


def _build_shard(work: _Work, shard: str, check: Callable[[], None]) -> int:
    """Do one shard, say what came of it, and return how many of its inputs are not done yet."""
    from rich.console import Console

    from pipeline.batch.shard_build import begin, build_shard
    from pipeline.batch.shards import Shard
    from pipeline.display import Display
    from pipeline.overrides import load_overrides

    check()
    asked = Shard.of(shard)
    begun = begin(settings_of(work.config, work.given), work.out, asked.count, load_overrides(work.config))
    with Display(Console(stderr=True), check) as display:
        done = build_shard(
            begun,
            work.out,
            asked,
            execute=work.execute(),
            progress=display.progress,
            rehash=work.rehash,
            ended=display.ended,
        )
    typer.echo(f"shard {asked}: {done.inputs - len(done.not_done)} of {done.inputs} houses are done")
    for name, why in list(done.not_done.items())[:8]:
        typer.secho(f"{name}: {why}; run the shard again when it has passed", fg=typer.colors.YELLOW)
    return len(done.not_done)


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
    found = inspect_house(settings_of(config, given), load_overrides(config), level, out)
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
