"""ROS map_server: a picture of the occupancy and its map.yaml."""

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
FREE, WALL, UNKNOWN = 254, 0, 205  # what map_server's own map_saver writes


def ros(
    plan: FloorPlan,
    *,
    resolution: float = RESOLUTION_M,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
) -> Files:
    """Write ``<id>.pgm`` and ``<id>.yaml``.

    The picture's first row lies at the highest y; ``origin`` in the YAML is the lower-left corner of its lower-left
    pixel, in metres of the plan's x and y (mirrored back where the plan is mirrored).

    Parameters
    ----------
    plan
        Rasterised by pixel centres: walls thinner than ``resolution`` may vanish.
    resolution
        Metres a pixel.
    wall_thickness
        Of outer walls; at least a pixel. What lies beyond is unknown.
    orientation
        See ``houseexpo.exports.orientation``.
    """
    pixels, frame = occupancy(plan, resolution, max(wall_thickness, resolution), orientation)
    return map_files(plan.id, pixels, resolution, frame.origin_m)


def map_files(name: str, pixels: npt.NDArray[np.uint8], resolution: float, origin_m: tuple[float, float]) -> Files:
    """Write a picture (rows, cols) of FREE, WALL and UNKNOWN, highest y first, and its YAML."""
    x, y = origin_m
    lines = [
        f"image: {json.dumps(name + '.pgm', ensure_ascii=False)}",  # JSON's strings are YAML's
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
    """Return the picture (rows, cols) of FREE, WALL and UNKNOWN, highest y first, and where it stands."""
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
