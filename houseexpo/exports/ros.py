"""ROS map_server: an occupancy picture and its map.yaml."""

from __future__ import annotations

import json

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.errors import ConfigError
from houseexpo.exports.files import Files, image, number
from houseexpo.exports.orientation import Orientation, oriented
from houseexpo.exports.solid import WALL_THICKNESS_M
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import fill

RESOLUTION_M = 0.05
FREE, WALL, UNKNOWN = 254, 0, 205  # the values that map_server's own map_saver writes


def ros(
    plan: FloorPlan,
    *,
    resolution: float = RESOLUTION_M,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
) -> Files:
    """Write ``<id>.pgm`` and ``<id>.yaml`` for ROS map_server.

    The picture's first row is at the highest y. ``origin`` in the YAML is the lower-left corner of the lower-left
    pixel, in the plan's x and y in metres (mirrored plans are mirrored back).

    Parameters
    ----------
    plan
        The plan; it is rasterised by pixel centres, so that walls thinner than ``resolution`` may disappear.
    resolution
        Metres per pixel.
    wall_thickness
        Thickness of the outer walls, metres, at least one pixel. The area beyond them is unknown.
    orientation
        See ``houseexpo.exports.orientation``.
    """
    pixels, frame = occupancy(plan, resolution, max(wall_thickness, resolution), orientation)
    return map_files(plan.id, pixels, resolution, frame.origin_m)


def map_files(name: str, pixels: npt.NDArray[np.uint8], resolution: float, origin_m: tuple[float, float]) -> Files:
    """Return the files of a picture (rows, cols) of FREE, WALL and UNKNOWN, highest y first, and its YAML."""
    x, y = origin_m
    lines = [
        f"image: {json.dumps(name + '.pgm', ensure_ascii=False)}",  # JSON strings are valid in YAML
        "mode: trinary",
        f"resolution: {float(resolution)!r}",
        f"origin: [{number(x)}, {number(y)}, 0.0]",
        "negate: 0",
        "occupied_thresh: 0.65",
        "free_thresh: 0.196",
    ]
    return {f"{name}.pgm": image(pixels, "PPM"), f"{name}.yaml": ("\n".join(lines) + "\n").encode()}


def occupancy(
    plan: FloorPlan, resolution: float, wall_thickness: float, orientation: Orientation
) -> tuple[np.ndarray[tuple[int, int], np.dtype[np.uint8]], GridFrame]:
    """Return the picture (rows, cols) of FREE, WALL and UNKNOWN, highest y first, and its position."""
    if not resolution > 0:
        raise ConfigError(f"export: expected a resolution of more than 0 m a pixel, found {resolution!r}")
    turned = oriented(plan, orientation)
    walls = shapely.MultiPolygon(turned.walls(wall_thickness))
    frame = GridFrame.around(walls.bounds, 1.0 / resolution, y_up=True)
    pixels = np.full(frame.shape, UNKNOWN, dtype=np.uint8)
    fill(pixels, walls, frame, WALL)
    if turned.objects:
        fill(pixels, turned.floor, frame, WALL)
    fill(pixels, turned, frame, FREE)
    return pixels, frame
