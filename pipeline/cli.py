"""The commands ``build`` and ``inspect``: they read the command line, run the work, and show the outcome.

What is heavy is imported where a command runs, so that ``houseexpo --help`` answers at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pipeline.batch.disk import printable
from pipeline.cli_build import Work, build_all, build_one_shard, verify_all
from pipeline.cli_cluster import assemble_all
from pipeline.cli_parts import ended_cleanly, named_manifest, settings_of, show_inspection, show_unheard

REJECTED = 1
"""An exit code: the house that is inspected gives no plan."""

Up = Literal["auto", "y", "z"]

_FILES = "How files are read"
_PLANS = "What the plans are like"
_FOLDER = "What OUT holds"
_RUN = "How the work is done"

_Config = Annotated[
    Path | None,
    typer.Option(
        help="Manifest: sources and parameters, a TOML file; or one that comes with houseexpo, by its name: demo.",
        show_default=False,
        callback=named_manifest,
    ),
]
_Overrides = Annotated[
    Path | None,
    typer.Option(help="Corrections by hand.", rich_help_panel=_PLANS, show_default="overrides.toml beside --config"),
]
_Seed = Annotated[
    int | None,
    typer.Option(min=0, help="Seed of all that is drawn at random.", rich_help_panel=_PLANS, show_default="0"),
]
_Up = Annotated[Up | None, typer.Option(help="Up axis of mesh files.", rich_help_panel=_FILES, show_default="auto")]
_Units = Annotated[
    str | None,
    typer.Option(
        help="Units of mesh files: m, cm, mm, in, ft, or metres in a unit.", rich_help_panel=_FILES, show_default="auto"
    ),
]
_Scale = Annotated[
    float | None, typer.Option(help="Scale of model houses: 20 for 1:20.", rich_help_panel=_FILES, show_default="1")
]
_StoreyHeight = Annotated[
    float | None,
    typer.Option(
        help="Height of a storey in metres; the scale follows from it.", rich_help_panel=_FILES, show_default=False
    ),
]
_ModelPath = Annotated[
    str | None,
    typer.Option(help="Folders with Gazebo models, divided as in PATH.", rich_help_panel=_FILES, show_default=False),
]
_Furniture = Annotated[
    bool | None,
    typer.Option("--furniture/--no-furniture", help="Furniture is an obstacle too.", rich_help_panel=_PLANS),
]


_KeepStages = Annotated[
    bool | None,
    typer.Option(
        "--keep-stages/--no-keep-stages", help="Keep a picture of each plan's stages.", rich_help_panel=_PLANS
    ),
]
_MinQuality = Annotated[
    float | None,
    typer.Option(min=0, max=1, help="Reject plans less sure than this.", rich_help_panel=_PLANS, show_default="0"),
]


def build(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SOURCE",
            help="A mesh, an IFC file, a folder of such files, a SUNCG root, or procedural:COUNT for homes that "
            "are made; with --verify, a data set.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        str | None, typer.Option(help="The data set folder; a path, s3://... or gs://...", show_default=False)
    ] = None,
    config: _Config = None,
    overrides: Annotated[
        Path | None,
        typer.Option(
            help="Corrections by hand.",
            rich_help_panel=_PLANS,
            show_default="overrides.toml beside --config, and in OUT",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes.", rich_help_panel=_RUN, show_default="one a core")
    ] = None,
    limit: Annotated[
        int | None, typer.Option(min=1, help="Take the first N inputs only.", rich_help_panel=_RUN, show_default=False)
    ] = None,
    seed: _Seed = None,
    up: _Up = None,
    units: _Units = None,
    scale: _Scale = None,
    storey_height: _StoreyHeight = None,
    furniture: _Furniture = None,
    add: Annotated[
        bool, typer.Option("--add", help="Keep plans of other sources that OUT holds.", rich_help_panel=_FOLDER)
    ] = False,
    replace_others: Annotated[
        bool, typer.Option("--replace", help="Remove what else OUT holds of builds.", rich_help_panel=_FOLDER)
    ] = False,
    model_path: _ModelPath = None,
    min_quality: _MinQuality = None,
    keep_stages: _KeepStages = None,
    rehash: Annotated[
        bool, typer.Option("--rehash", help="Read all inputs to see whether they changed.", rich_help_panel=_FOLDER)
    ] = False,
    verify: Annotated[
        bool, typer.Option("--verify", help="Check the hashes of a data set; build nothing.", rich_help_panel=_FOLDER)
    ] = False,
    shard: Annotated[
        str | None,
        typer.Option(
            help="Do one part of N: 7/256; houseexpo assemble ends it.", rich_help_panel=_RUN, show_default=False
        ),
    ] = None,
    executor: Annotated[
        Literal["local", "ray"], typer.Option(help="local: this machine; ray: a Ray cluster.", rich_help_panel=_RUN)
    ] = "local",
    address: Annotated[
        str | None, typer.Option(help="Address of a Ray cluster.", rich_help_panel=_RUN, show_default=False)
    ] = None,
) -> None:
    """Build a data set of floor plans from 3D houses.

    Every input ends as a plan, a rejection with its reason, or a duplicate.

    A build that was interrupted goes on where it stopped. Ends with 4 if nothing became a plan.
    """
    if verify:
        verify_all([*(sources or ()), *([out] if out else [])])
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
        "keep_stages": keep_stages,
    }
    others = "add" if add else "replace" if replace_others else "refuse"
    work = Work(config, given, overrides, out, workers, executor, address, rehash)
    with ended_cleanly() as check:
        if shard is not None:
            code = build_one_shard(work, shard, check)
        elif "://" in out:
            code = build_one_shard(work, "0/1", check) or assemble_all(out, check, partial=False)
        else:
            code = build_all(work, others, check)
    if code:
        raise typer.Exit(code)


def inspect(
    source: Annotated[str, typer.Argument(help="A house or a folder of houses, as build takes them.")],
    out: Annotated[Path, typer.Option(help="Folder for the pictures.", show_default=False)],
    id_: Annotated[
        str | None, typer.Option("--id", help="Which house or level, by its id.", show_default="the first house")
    ] = None,
    level: Annotated[int, typer.Option(min=0, help="Which level, counted from the lowest.")] = 0,
    config: _Config = None,
    overrides: _Overrides = None,
    seed: _Seed = None,
    up: _Up = None,
    units: _Units = None,
    scale: _Scale = None,
    storey_height: _StoreyHeight = None,
    furniture: _Furniture = None,
    model_path: _ModelPath = None,
    replace: Annotated[bool, typer.Option("--replace", help="Write over files that houseexpo did not write.")] = False,
) -> None:
    """Show what each stage makes of one house: a PNG for each, and all on one sheet.

    Ends with 1 where the house is rejected.
    """
    from pipeline.inspection import inspect_house
    from pipeline.overrides import load_overrides

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
    with ended_cleanly():
        words = load_overrides(config, overrides)
        found = inspect_house(settings_of(config, given), words, level, out, id_, replace=replace)
    show_inspection(found, source, out)
    show_unheard(found, tuple(words))
    if found.rejection is not None:
        raise typer.Exit(REJECTED)
