"""``houseexpo show``: draw plans as one PNG or SVG picture; several make a contact sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from houseexpo.commands.arguments import IDS_HELP, ReplaceOption
from houseexpo.errors import ConfigError
from houseexpo.words import count_noun

if TYPE_CHECKING:
    from houseexpo.floorplan import FloorPlan

_MAX_PICTURES = 1000  # a larger sheet is too large for viewers


def show(
    what: Annotated[list[str], typer.Argument(help="A data set, plans' files, or ids.", show_default=False)],
    out: Annotated[Path, typer.Option(help="Picture to write: .png or .svg.", show_default=False)],
    data: Annotated[
        Path | None, typer.Option("--dataset", "--data", help="The data set of the ids; the fetched one by default.")
    ] = None,
    ids: Annotated[list[str] | None, typer.Option(help=IDS_HELP, show_default="all")] = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Draw at most this many plans, the first ones.")] = None,
    sample: Annotated[int | None, typer.Option(min=1, help="Draw this many plans, chosen at random.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random choice.")] = 0,
    size: Annotated[int, typer.Option(min=64, max=8000, help="Longer side of a plan, pixels.")] = 800,
    columns: Annotated[int | None, typer.Option(min=1, help="Number of pictures in a row.")] = None,
    find_rooms: Annotated[bool, typer.Option(help="Find rooms and doors of plans without them.")] = True,
    style: Annotated[
        str, typer.Option(help="architect; technical: black and white; semantic: doors coloured by kind.")
    ] = "architect",
    replace: ReplaceOption = False,
) -> None:
    """Draw plans: walls, rooms with name and area, doors, furniture, scale bar. Several make a contact sheet."""
    from houseexpo.commands.arguments import plans_from_arguments
    from houseexpo.commands.printing import make_console
    from houseexpo.drawing import contact_sheet, draw_plan, svg, svg_sheet
    from houseexpo.drawing.styles import check_style
    from houseexpo.exports.encoding import encode_image
    from houseexpo.files import write_atomically
    from houseexpo.outputs import CommandOutput
    from houseexpo.progress import show_progress

    if out.suffix not in (".png", ".svg"):
        raise ConfigError(f"--out: expected a file that ends in .png or .svg, found {out.name!r}")
    look = check_style(style)
    with CommandOutput(out, [*what, data], replace=replace):
        found = _choose_plans(plans_from_arguments(what, data, ids), limit, sample, seed)
        across = columns or math.ceil(math.sqrt(len(found)))
        names = [plan.id for plan in found]
        shown = show_progress((plan.divided if find_rooms else plan for plan in found), "drawing", len(found))
        if out.suffix == ".svg":
            documents = [svg(plan, size=size, style=look) for plan in shown]
            content = (documents[0] if len(found) == 1 else svg_sheet(documents, across, names)).encode()
        else:
            images = [draw_plan(plan, size=size, style=look) for plan in shown]
            content = encode_image(images[0] if len(found) == 1 else contact_sheet(images, across, names), "PNG")
        write_atomically(out, content)
    make_console().print(f"{count_noun(len(found), 'plan')} drawn in {out}", highlight=False, soft_wrap=True)


def _choose_plans(found: Sequence[FloorPlan], limit: int | None, sample: int | None, seed: int) -> Sequence[FloorPlan]:
    """Return the plans to draw; raise ConfigError if there are none, or more than a sheet can show."""
    import numpy as np

    if not found:
        raise ConfigError("expected plans to draw, found none")
    if sample is not None:
        numbers = np.random.default_rng(seed).permutation(len(found))[:sample]
        found = [found[int(i)] for i in numbers]
    if limit is not None:
        found = found[:limit]
    if len(found) > _MAX_PICTURES:
        raise ConfigError(f"expected at most {_MAX_PICTURES} plans, found {len(found)}; use --limit or --sample")
    return found
