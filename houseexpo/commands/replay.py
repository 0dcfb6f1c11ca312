"""``houseexpo replay``: make a map (``map.yaml``, ``map.pgm``) from the laser scans in a robot's ROS 2 bag."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from houseexpo.commands.arguments import ReplaceOption


def replay(
    bag: Annotated[Path, typer.Argument(help="ROS 2 bag with scans and transforms: .mcap, .db3, or its folder.")],
    out: Annotated[Path, typer.Option(help="Folder for map.yaml and map.pgm.", show_default=False)],
    resolution: Annotated[float, typer.Option(help="Side of a cell, metres.")] = 0.05,
    scan_topic: Annotated[
        str | None, typer.Option(help="Topic of the scans.", show_default="the only one of its type")
    ] = None,
    replace: ReplaceOption = False,
) -> None:
    """Play the scans of a ROS 2 bag back, and write the map that they make, for map_server, build and play."""
    import numpy as np

    from houseexpo.commands.printing import make_console
    from houseexpo.exports.rasters import FREE, UNKNOWN, WALL, map_server_files
    from houseexpo.outputs import CommandOutput
    from houseexpo.pseudoslam.io.bag_maps import map_from_bag

    with CommandOutput(out, [bag], replace=replace, folder=True) as place:
        made = map_from_bag(bag, resolution, scan_topic=scan_topic)
        pixels = np.where(made.occupied, WALL, np.where(made.free, FREE, UNKNOWN)).astype(np.uint8)
        for name, data in map_server_files("map", pixels, made.resolution_m, made.origin).items():
            place.write(out / name, data)
    rows, cols = made.occupancy.shape
    free_m2 = float(made.free.sum()) * made.resolution_m**2
    said = f"{out / 'map.yaml'}: {rows} x {cols} cells, {free_m2:,.0f} m² free"
    make_console().print(said, highlight=False, soft_wrap=True)
