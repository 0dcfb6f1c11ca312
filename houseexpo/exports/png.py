"""A picture of the free space: white for free space, black elsewhere."""

from __future__ import annotations

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.exports.files import Files, image
from houseexpo.exports.orientation import Orientation, oriented
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import free_mask

RESOLUTION_M = 0.02


def png(plan: FloorPlan, *, resolution: float = RESOLUTION_M, orientation: Orientation = "world") -> Files:
    """Write ``<id>.png``: 8-bit grey, 255 for free space and 0 elsewhere, with a margin of one pixel.

    The first row is at the highest y. The house is shown as seen from above (mirrored plans are mirrored back).
    ``resolution`` is in metres per pixel. For pictures with rooms and labels, use ``houseexpo.draw_plan``.
    """
    if not resolution > 0:
        raise ConfigError(f"export: expected a resolution of more than 0 m a pixel, found {resolution!r}")
    mask, _ = free_mask(oriented(plan, orientation), 1.0 / resolution, y_up=True)
    return {f"{plan.id}.png": image(mask.astype(np.uint8) * 255, "PNG")}
