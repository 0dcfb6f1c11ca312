"""``houseexpo show``: plans as a picture."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Annotated

import typer

from houseexpo.errors import ConfigError


def show(
    what: Annotated[list[str], typer.Argument(help="Ids of plans, or their files.", show_default=False)],
    out: Annotated[Path, typer.Option(help="Picture to write: .png or .svg.", show_default=False)],
    data: Annotated[Path | None, typer.Option(help="The data set of the ids; the fetched one by default.")] = None,
    size: Annotated[int, typer.Option(min=64, max=8000, help="Longer side of a plan, pixels.")] = 800,
    columns: Annotated[int | None, typer.Option(min=1, help="Pictures in a row, where there are several.")] = None,
    find_rooms: Annotated[bool, typer.Option(help="Find rooms and doors where the plan records none.")] = True,
) -> None:
    """Draw plans: rooms coloured by label, doors by kind, scale bar, legend. Several make a contact sheet."""
    from houseexpo.commands.given import plans
    from houseexpo.drawing import contact_sheet, draw_plan, svg, svg_sheet
    from houseexpo.files import write_whole

    if out.suffix not in (".png", ".svg"):
        raise ConfigError(f"--out: expected a file that ends in .png or .svg, found {out.name!r}")
    found = [plan.divided if find_rooms else plan for plan in plans(what, data)]
    across = columns or math.ceil(math.sqrt(len(found)))
    names = [plan.id for plan in found]
    out.parent.mkdir(parents=True, exist_ok=True)
    if out.suffix == ".svg":
        pictures = [svg(plan, size=size) for plan in found]
        write_whole(out, (pictures[0] if len(found) == 1 else svg_sheet(pictures, across, names)).encode())
        return
    from PIL import Image

    images = [draw_plan(plan, size=size) for plan in found]
    stream = io.BytesIO()
    Image.fromarray(images[0] if len(found) == 1 else contact_sheet(images, across, names)).save(stream, "PNG")
    write_whole(out, stream.getvalue())
