"""Define the commands ``houseexpo build`` and ``inspect``: read their options, run the work, and print the outcome.

What is heavy is imported where a command runs, so that ``houseexpo --help`` answers at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from houseexpo.errors import ANSWER_IS_NO
from pipeline.batch.disk import printable
from pipeline.cli_build import BuildRequest, build_and_show, build_one_shard, verify_or_exit, write_source_record
from pipeline.cli_cluster import assemble_and_show
from pipeline.cli_common import (
    end_cleanly,
    load_build_config,
    resolve_manifest,
    show_inspection,
    show_unapplied_corrections,
)

Up = Literal["auto", "y", "z"]

_FILES = "How files are read"
_PLANS = "What the plans are like"
_FOLDER = "What OUT holds"
_RUN = "How the work is done"

_Config = Annotated[
    Path | None,
    typer.Option(
        help="Manifest with sources and parameters: a TOML file, or the name of one in houseexpo, such as demo.",
        show_default=False,
        callback=resolve_manifest,
    ),
]
_Overrides = Annotated[
    Path | None,
    typer.Option(
        help="TOML file with corrections of single houses.",
        rich_help_panel=_PLANS,
        show_default="overrides.toml beside --config",
    ),
]
_Seed = Annotated[
    int | None,
    typer.Option(min=0, help="Random seed.", rich_help_panel=_PLANS, show_default="0"),
]
_Up = Annotated[Up | None, typer.Option(help="Up axis of mesh files.", rich_help_panel=_FILES, show_default="auto")]
_Units = Annotated[
    str | None,
    typer.Option(
        help="Unit of mesh files: m, cm, mm, in, ft, or its length in metres.",
        rich_help_panel=_FILES,
        show_default="auto",
    ),
]
_Scale = Annotated[
    float | None, typer.Option(help="Scale of a model: 20 for 1:20.", rich_help_panel=_FILES, show_default="1")
]
_StoreyHeight = Annotated[
    float | None,
    typer.Option(
        help="Height of a storey in metres, from which the scale is computed.",
        rich_help_panel=_FILES,
        show_default=False,
    ),
]
_Resolution = Annotated[
    float | None,
    typer.Option(
        help="Side of a cell of robots' maps, metres, where no map.yaml says it.",
        rich_help_panel=_FILES,
        show_default=False,
    ),
]
_ModelPath = Annotated[
    str | None,
    typer.Option(help="Folders with Gazebo models, separated as in PATH.", rich_help_panel=_FILES, show_default=False),
]
_Furniture = Annotated[
    bool | None,
    typer.Option("--furniture/--no-furniture", help="Treat furniture as an obstacle.", rich_help_panel=_PLANS),
]
_Weights = Annotated[
    Path | None,
    typer.Option(
        help="File of weights that houseexpo fit wrote, for houses of one kind.",
        rich_help_panel=_PLANS,
        show_default="those of houseexpo",
    ),
]
_KeepStages = Annotated[
    bool | None,
    typer.Option(
        "--keep-stages/--no-keep-stages", help="Keep a picture of each plan's stages.", rich_help_panel=_PLANS
    ),
]
_KeepCopies = Annotated[
    bool | None,
    typer.Option(
        "--keep-copies/--no-keep-copies", help="Keep plans with the same walls as others.", rich_help_panel=_FOLDER
    ),
]
_Seconds = Annotated[
    float | None,
    typer.Option(
        min=0.01, help="Processor time of one house, s; more is a rejection.", rich_help_panel=_RUN, show_default="300"
    ),
]
_Memory = Annotated[
    float | None,
    typer.Option(
        min=0.01, help="Memory of one worker, GiB; a house that needs more is rejected.", rich_help_panel=_RUN,
        show_default="4",
    ),
]  # fmt: skip
_MinQuality = Annotated[
    float | None,
    typer.Option(
        min=0, max=1, help="Reject plans with a lower quality, from 0 to 1.", rich_help_panel=_PLANS, show_default="0"
    ),
]


def build(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SOURCE",
            help="A file of a house (mesh, IFC, Gazebo, Sweet Home 3D, drawn plan, robot's map, ...), a folder of such "
            "files, a SUNCG root, or procedural:COUNT for made homes; with --verify, a data set.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        str | None, typer.Option(help="Folder of the data set: a path, s3://... or gs://...", show_default=False)
    ] = None,
    config: _Config = None,
    overrides: Annotated[
        Path | None,
        typer.Option(
            help="TOML file with corrections of single houses.",
            rich_help_panel=_PLANS,
            show_default="overrides.toml beside --config, and in OUT",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Number of processes.", rich_help_panel=_RUN, show_default="one per core")
    ] = None,
    seconds: _Seconds = None,
    memory: _Memory = None,
    limit: Annotated[
        int | None, typer.Option(min=1, help="Build only the first N inputs.", rich_help_panel=_RUN, show_default=False)
    ] = None,
    seed: _Seed = None,
    up: _Up = None,
    units: _Units = None,
    scale: _Scale = None,
    storey_height: _StoreyHeight = None,
    resolution: _Resolution = None,
    furniture: _Furniture = None,
    add: Annotated[
        bool, typer.Option("--add", help="Keep plans of other sources in OUT.", rich_help_panel=_FOLDER)
    ] = False,
    replace_others: Annotated[
        bool, typer.Option("--replace", help="Remove plans of other builds from OUT.", rich_help_panel=_FOLDER)
    ] = False,
    model_path: _ModelPath = None,
    weights: _Weights = None,
    min_quality: _MinQuality = None,
    keep_stages: _KeepStages = None,
    keep_copies: _KeepCopies = None,
    rehash: Annotated[
        bool,
        typer.Option(
            "--rehash", help="Read all inputs again to see whether they have changed.", rich_help_panel=_FOLDER
        ),
    ] = False,
    verify: Annotated[
        bool,
        typer.Option("--verify", help="Check the hashes of a data set, and build nothing.", rich_help_panel=_FOLDER),
    ] = False,
    shard: Annotated[
        str | None,
        typer.Option(
            help="Build one of N parts, such as 7/256; then run houseexpo assemble.",
            rich_help_panel=_RUN,
            show_default=False,
        ),
    ] = None,
    executor: Annotated[
        Literal["local", "ray"],
        typer.Option(help="Where to run: on this machine, or on a Ray cluster.", rich_help_panel=_RUN),
    ] = "local",
    address: Annotated[
        str | None, typer.Option(help="Address of a Ray cluster.", rich_help_panel=_RUN, show_default=False)
    ] = None,
    show_source: Annotated[str | None, typer.Option("--show-source", hidden=True)] = None,
) -> None:
    """Build a data set of floor plans from 3D houses.

    Every input ends as a plan, a rejection with its reason, or a duplicate.

    An interrupted build continues where it stopped. The exit code is 4 if nothing became a plan.
    """
    if verify:
        verify_or_exit([*(sources or ()), *([out] if out else [])])
        return
    if out is None:
        raise typer.BadParameter("missing; expected the folder of the data set", param_hint="--out")
    if printable(out) != out:
        raise typer.BadParameter("expected a name in UTF-8; choose another folder", param_hint="--out")
    if add and replace_others:
        raise typer.BadParameter("expected --add or --replace, found both")
    if (add or replace_others) and (shard or "://" in out):
        raise typer.BadParameter(
            "--add and --replace work only for a whole build into a folder; leave them out, or choose another --out"
        )
    if address is not None and executor != "ray":
        raise typer.BadParameter("expected only with --executor ray", param_hint="--address")
    given = {
        "sources": tuple(sources or ()),
        "limit": limit,
        "seed": seed,
        "up": up,
        "units": units,
        "scale": scale,
        "storey_height": storey_height,
        "resolution": resolution,
        "furniture": furniture,
        "model_path": model_path,
        "weights": weights,
        "min_quality": min_quality,
        "keep_stages": keep_stages,
        "keep_copies": keep_copies,
        "seconds": seconds,
        "memory": memory,
    }
    others = "add" if add else "replace" if replace_others else "refuse"
    work = BuildRequest(config, given, overrides, out, workers, executor, address, rehash)
    if show_source is not None:  # the page Review asks for it, with the words of the build that it shows
        write_source_record(work, show_source)
        return
    with end_cleanly() as check:
        if shard is not None:
            code = build_one_shard(work, shard, check)
        elif "://" in out:
            code = build_one_shard(work, "0/1", check) or assemble_and_show(out, check, partial=False)
        else:
            code = build_and_show(work, others, check)
    if code:
        raise typer.Exit(code)


def inspect(
    source: Annotated[str, typer.Argument(help="A house or a folder of houses, as for build.")],
    out: Annotated[Path, typer.Option(help="Folder for the pictures.", show_default=False)],
    id_: Annotated[
        str | None, typer.Option("--id", help="Id of the house or level.", show_default="the first house")
    ] = None,
    level: Annotated[int, typer.Option(min=0, help="Number of the level; 0 is the lowest.")] = 0,
    config: _Config = None,
    overrides: _Overrides = None,
    seed: _Seed = None,
    up: _Up = None,
    units: _Units = None,
    scale: _Scale = None,
    storey_height: _StoreyHeight = None,
    resolution: _Resolution = None,
    furniture: _Furniture = None,
    model_path: _ModelPath = None,
    weights: _Weights = None,
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite files that houseexpo did not write.")] = False,
) -> None:
    """Draw each stage of one house: a PNG for each stage, and a sheet with all of them.

    The exit code is 1 if the house is rejected.
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
        "resolution": resolution,
        "furniture": furniture,
        "model_path": model_path,
        "weights": weights,
    }
    with end_cleanly():
        words = load_overrides(config, overrides)
        found = inspect_house(load_build_config(config, given), words, level, out, id_, replace=replace)
    show_inspection(found, source, out)
    show_unapplied_corrections(found)
    if found.rejection is not None:
        raise typer.Exit(ANSWER_IS_NO)
