"""``houseexpo export``: write plans in the formats of other programs, and trained policies for ONNX Runtime."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from houseexpo.commands.arguments import IDS_HELP, ReplaceOption, is_plan_file, make_completion
from houseexpo.errors import ANSWER_IS_NO, ConfigError
from houseexpo.words import count_noun

if TYPE_CHECKING:
    from houseexpo.errors import PlanError
    from houseexpo.floorplan import FloorPlan


# the table of formats imports shapely, which `houseexpo --help` does not need; a test compares the two lists
_NAMES = "coco, dxf, geojson, glb, graphml, ifc, irsim, json, mjcf, npz, obj, png, pol, rmf, ros, sdf, stage, svg, usd"
_POLICY = "onnx"
"""The format of policies."""
_MOST_NAMED = 5
_MAPS = frozenset({"png", "ros"})
"""Formats that hold the free space alone, and that a build reads."""
_OPEN_M = 2.0
"""In a map, a wider gap between walls is no doorway for a build, metres."""
_OWN = "the format's own"


def export(
    dataset: Annotated[
        Path,
        typer.Argument(
            help="Data set folder, archive, JSON lines, one plan's JSON file; for onnx, the folder of a training."
        ),
    ],
    to: Annotated[
        str,
        typer.Option(
            metavar="FORMAT",
            help=f"One of {_NAMES}; of a trained policy: {_POLICY}.",
            autocompletion=make_completion(*_NAMES.split(", "), _POLICY),
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the files.", show_default=False)],
    ids: Annotated[
        list[str] | None,
        typer.Option(help=IDS_HELP, show_default="all"),
    ] = None,
    resolution: Annotated[
        float | None, typer.Option(help="Side of a pixel or cell.", metavar="METRES", show_default=_OWN)
    ] = None,
    wall_thickness: Annotated[
        float | None, typer.Option(help="Thickness of outer walls.", metavar="METRES", show_default=_OWN)
    ] = None,
    wall_height: Annotated[
        float | None, typer.Option(help="Height of walls.", metavar="METRES", show_default=_OWN)
    ] = None,
    door_height: Annotated[
        float | None, typer.Option(help="Height of the gap under a lintel.", metavar="METRES", show_default=_OWN)
    ] = None,
    holes: Annotated[
        Literal["slit", "drop"] | None,
        typer.Option(help="Published JSON: join holes to the outline, or leave them out.", show_default="slit"),
    ] = None,
    orientation: Annotated[
        Literal["world", "plan"] | None,
        typer.Option(help="As seen from above, or the plan's own axes.", show_default=_OWN),
    ] = None,
    frame: Annotated[
        Literal["source", "plan"] | None,
        typer.Option(
            help="Coordinates of the file that a plan comes from, or of the plan, which starts at its corner.",
            show_default="source of maps, drawings, scans and worlds",
        ),
    ] = None,
    building: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Write the plans as storeys of one building (glb, ifc, mjcf, obj, rmf, sdf, usd).",
            show_default="one file a plan",
        ),
    ] = None,
    find_rooms: Annotated[
        bool, typer.Option("--find-rooms", help="Find rooms and doors of plans without them.")
    ] = False,
    replace: ReplaceOption = False,
) -> None:
    """Write plans for other programs: maps, worlds, meshes, features, graphs, pictures, grids. Or a policy: onnx.

    The exit code is 1 if the format cannot represent some plans; these are listed and left out.
    """
    from houseexpo.commands.arguments import parse_ids
    from houseexpo.commands.printing import make_console, print_problems
    from houseexpo.exports.formats import export as write

    given = {
        "resolution": resolution,
        "wall_thickness": wall_thickness,
        "wall_height": wall_height,
        "door_height": door_height,
        "holes": holes,
        "orientation": orientation,
        "frame": frame,
    }
    options = {name: value for name, value in given.items() if value is not None}
    if to == _POLICY:
        if options or ids or building or find_rooms:
            raise ConfigError("export --to onnx: the other options are for plans; leave them out")
        make_console().print(str(_policy(dataset, out, replace=replace)), highlight=False, soft_wrap=True)
        return
    count, plans = _plans(dataset, parse_ids(ids) or None)
    if find_rooms:
        plans = _with_rooms(plans)
    frames: Counter[str] = Counter()
    plans = _count_frames(plans, frame, frames)
    apart, merged = list[str](), list[str]()
    plans = _name_others(plans, to, apart, merged)
    refused: list[PlanError] = []
    files = write(
        plans, to, out, refused=refused.append, replace=replace, sources=[dataset], building=building, **options
    )
    if refused and len(refused) == count:
        raise refused[0]
    said = (
        f"{count_noun(count - len(refused), 'plan')}, {count_noun(len(files), 'file')} in {out}, {_in_frames(frames)}"
    )
    make_console().print(said, highlight=False, soft_wrap=True)
    for ids_, told, does in (
        (apart, "no way joins all parts of", "cuts one"),
        (merged, f"rooms meet in an opening of {_OPEN_M:g} m or more in", "may make them one"),
    ):
        more = f" and {len(ids_) - _MOST_NAMED} more" if ids_[_MOST_NAMED:] else ""
        note = f"note: {told} {', '.join(ids_[:_MOST_NAMED])}{more}; {to} cannot say so, and a build of the file {does}"
        if ids_:
            make_console().print(f"{note} (dxf, geojson and svg say it)", highlight=False, soft_wrap=True)
    print_problems(make_console(stderr=True), "left out", list(map(str, refused)))
    if refused:
        raise typer.Exit(ANSWER_IS_NO)


def _policy(run: Path, out: Path, *, replace: bool) -> Path:
    """Export the policy of a training's folder, or of its file, and return the new file."""
    from houseexpo.pseudoslam.learning import need_extra

    for extra in ("learn", "onnx"):
        need_extra(extra, "houseexpo export --to onnx")
    from houseexpo.pseudoslam.learning.onnx_export import export_policy  # PyTorch

    return export_policy(run / "policy.pt" if run.is_dir() else run, out, replace=replace)


def _count_frames(plans: Iterator[FloorPlan], frame: str | None, frames: Counter[str]) -> Iterator[FloorPlan]:
    """Yield the plans, and count in which frames they are exported."""
    from houseexpo.exports.placement import default_frame

    for plan in plans:
        frames[frame or default_frame(plan)] += 1
        yield plan


def _name_others(plans: Iterator[FloorPlan], to: str, apart: list[str], merged: list[str]) -> Iterator[FloorPlan]:
    """Yield the plans, and name those of which a build of the format gives others.

    ``apart`` are those with parts that no way joins, since it would cut one; ``merged`` those with rooms that meet in
    the open, in a format that holds the free space alone.
    """
    from houseexpo.corrections.draft import Draft
    from houseexpo.exports.formats import ALIASES, FORMATS

    form = ALIASES.get(to, to)
    found = FORMATS.get(form)
    for plan in plans:
        if found is not None and found.leaves_ways_open and len(Draft(plan).pieces()) > 1:
            apart.append(plan.id)
        if form in _MAPS and any(door.kind == "opening" and door.width >= _OPEN_M for door in plan.doors):
            merged.append(plan.id)
        yield plan


def _in_frames(frames: Counter[str]) -> str:
    """Return in whose frame the files are, for people."""
    if len(frames) > 1:
        return f"{frames['source']} in the frame of the source, {frames['plan']} in the plan's own"
    return "in the frame of the source" if frames["source"] else "in the plan's own frame"


def _plans(path: Path, wanted: Sequence[str] | None) -> tuple[int, Iterator[FloorPlan]]:
    """Return the number of plans, and the plans; all ids are checked before the first plan is read."""
    from houseexpo.dataset import Dataset, open_dataset
    from houseexpo.errors import UnknownPlanError
    from houseexpo.floorplan import load_plan
    from houseexpo.progress import show_progress
    from houseexpo.words import unknown_name_message

    data: Dataset | dict[str, FloorPlan]
    if is_plan_file(path):
        plan = load_plan(path)
        data = {plan.id: plan}
    else:
        data = open_dataset(path)
    known = list(data) if isinstance(data, dict) else data.ids
    unknown = sorted(set(wanted or ()) - set(known))
    if unknown:
        raise UnknownPlanError(f"{path}: {'; '.join(unknown_name_message(name, known) for name in unknown[:5])}")
    chosen = known if wanted is None else wanted
    return len(chosen), show_progress((data[name] for name in chosen), "exporting", len(chosen))


def _with_rooms(plans: Iterator[FloorPlan]) -> Iterator[FloorPlan]:
    from houseexpo.inference import with_rooms

    for plan in plans:
        yield plan if plan.rooms else with_rooms(plan)
