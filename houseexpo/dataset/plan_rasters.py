"""Rasterise a plan to arrays of one size for neural networks: free cells (1), int32 ids of rooms and doors (-1: none).

Small plans are padded; plans that are too large are shrunk by default, or cropped or refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame, check_not_too_coarse
from houseexpo.grids.raster import door_ids, free_mask, room_ids
from houseexpo.tolerances import SAME_PX


@dataclass(frozen=True)
class RasterConfig:
    """How plans are converted to arrays.

    ``fit`` applies to a plan that is larger than ``size`` (rows, cols) at ``pixels_per_metre``: "crop" keeps its
    middle, "shrink" reduces the resolution until it fits, "refuse" raises ConfigError. Smaller plans are padded on all
    sides. ``y_up`` puts row 0 at the highest y, as in pictures. ``find_rooms`` finds rooms and doors of plans without
    them (``FloorPlan.divided``).
    """

    size: tuple[int, int] = (256, 256)
    pixels_per_metre: float = 10.0
    fit: Literal["crop", "shrink", "refuse"] = "shrink"
    y_up: bool = False
    find_rooms: bool = True

    def __post_init__(self) -> None:
        sides = self.size if isinstance(self.size, tuple | list) else ()
        if len(sides) != 2 or not all(isinstance(side, int) and side > 0 for side in sides):
            raise ConfigError(f"size: expected rows and columns, such as (256, 256), found {self.size!r}")
        if self.fit not in ("crop", "shrink", "refuse"):
            raise ConfigError(f"fit: expected crop, shrink or refuse, found {self.fit!r}")
        scale = self.pixels_per_metre
        if not (isinstance(scale, (int, float)) and math.isfinite(scale) and scale > 0):
            raise ConfigError(f"pixels_per_metre: expected a positive number, found {self.pixels_per_metre!r}")


@dataclass(frozen=True)
class PlanRasters:
    """A plan as arrays (rows, cols) on one grid: ``free`` is 1 in free cells; ids of rooms and doors, -1 elsewhere."""

    free: npt.NDArray[np.uint8]
    rooms: npt.NDArray[np.int32]
    doors: npt.NDArray[np.int32]
    frame: GridFrame


def rasterise_plan(plan: FloorPlan, config: RasterConfig | None = None) -> PlanRasters:
    """Rasterise a plan by cell centres at the configured resolution, with the plan in the middle of the grid.

    Examples
    --------
    >>> plan = FloorPlan("square", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {})
    >>> found = rasterise_plan(plan, RasterConfig(size=(8, 12), pixels_per_metre=2))
    >>> found.free.shape, int(found.free.sum())
    ((8, 12), 16)
    """
    config = config or RasterConfig()
    frame = raster_frame(plan, config)
    plan = plan.divided if config.find_rooms else plan
    free, _ = free_mask(plan, frame=frame)
    return PlanRasters(free.view(np.uint8), room_ids(plan, frame), door_ids(plan, frame), frame)


def raster_frame(plan: FloorPlan, config: RasterConfig) -> GridFrame:
    """Return the grid for a plan; the plan's bounds are centred on the grid, to a whole cell.

    Raises
    ------
    ConfigError
        The plan does not fit the size (``fit="refuse"``), or is smaller than a few cells.
    """
    check_not_too_coarse(plan.bbox, config.pixels_per_metre, plan.id)
    x1, y1, x2, y2 = plan.bbox
    rows, cols = config.size
    scale = config.pixels_per_metre
    if (x2 - x1) * scale > cols + SAME_PX or (y2 - y1) * scale > rows + SAME_PX:
        if config.fit == "refuse":
            raise ConfigError(
                f"plan {plan.id!r}: {x2 - x1:.2f} x {y2 - y1:.2f} m do not fit {cols} x {rows} cells at {scale:g} px/m"
            )
        if config.fit == "shrink":
            scale = min(cols / (x2 - x1), rows / (y2 - y1))
    left, low = (math.floor((n - size * scale) / 2 + SAME_PX) for n, size in ((cols, x2 - x1), (rows, y2 - y1)))
    return GridFrame((x1 - left / scale, y1 - low / scale), scale, (rows, cols), config.y_up)
