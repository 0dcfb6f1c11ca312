"""The ground truth: a plan as cells, where the robot can stand, and what it can hope to see."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, PlanError
from houseexpo.frame import GridFrame
from houseexpo.plan import FloorPlan
from houseexpo.pseudoslam.kernels.reach import mark_visible
from houseexpo.raster import free_mask

MOST_CELLS = 2_000_000_000
_VIEWS_M = 0.2  # the places looked from lie this far apart

Cells = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class World:
    """One house for one robot; arrays are (rows, cols) uint8, row 0 at the highest y, and are not to be written to.

    Parameters
    ----------
    frame
        Where the grid stands in the plan.
    solid
        1 in walls, obstacles and outside; the border is.
    stand
        1 where the robot can stand in the middle of the cell and walk to all other such cells.
    countable
        1 for free cells that can be seen from there: what coverage counts.
    """

    plan_id: str
    frame: GridFrame
    solid: Cells
    stand: Cells
    countable: Cells

    @property
    def countable_cells(self) -> int:
        """How many cells coverage counts."""
        return int(self.countable.sum())


def make_world(plan: FloorPlan, pixels_per_metre: float, robot_radius_m: float, range_m: float) -> World:
    """Rasterise a plan (by cells' centres) and find where a robot of this size can go and what it can see from there.

    Raises
    ------
    ConfigError
        Where the grid would need more than 2 GB, or the robot fits nowhere.
    PlanError
        Where the plan has no free cell.
    """
    x1, y1, x2, y2 = plan.bbox
    cells = (x2 - x1) * (y2 - y1) * pixels_per_metre**2
    if cells > MOST_CELLS:
        raise ConfigError(
            f"pixels_per_metre: {pixels_per_metre:g} makes {cells:.2g} cells of plan {plan.id!r} "
            f"({x2 - x1:.0f} x {y2 - y1:.0f} m), at most {MOST_CELLS:.0e} are possible; use a coarser grid"
        )
    free, frame = free_mask(plan, pixels_per_metre, y_up=True)
    if not free.any():
        raise PlanError(f"expected free space, found no free cell at {pixels_per_metre:g} px/m", "verts", plan.id)
    return world_of((~free).view(np.uint8), frame, robot_radius_m, range_m, plan.id)


def world_of(solid: Cells, frame: GridFrame, robot_radius_m: float, range_m: float, plan_id: str) -> World:
    """Return the world of a raster whose border is solid; ConfigError where the robot fits nowhere."""
    ppm = frame.pixels_per_metre
    stand = standing_cells(solid, robot_radius_m * ppm)
    if not stand.any():
        raise ConfigError(
            f"robot.radius_m: a robot of radius {robot_radius_m:g} m fits nowhere in plan {plan_id!r} "
            f"at {ppm:g} px/m; use a smaller robot or another plan"
        )
    world = World(plan_id, frame, solid, stand, visible_cells(solid, stand, range_m * ppm, ppm))
    for array in (world.solid, world.stand, world.countable):
        array.flags.writeable = False
    return world


def standing_cells(solid: Cells, radius_px: float) -> Cells:
    """Return 1 where a disc in the middle of the cell is free, in the biggest piece of such cells (4-connected)."""
    import cv2

    reach = math.ceil(radius_px)
    offsets = np.maximum(np.abs(np.arange(-reach, reach + 1)) - 0.5, 0.0)  # to the near side of a cell
    disc = np.hypot(offsets[:, None], offsets) < radius_px - 1e-9
    taken = cv2.dilate(solid, disc.astype(np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=1)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(1 - taken, connectivity=4)
    if count < 2:
        return np.zeros_like(solid)
    biggest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    return np.ascontiguousarray(labels == biggest).view(np.uint8)


def visible_cells(solid: Cells, stand: Cells, range_px: float, pixels_per_metre: float) -> Cells:
    """Return 1 for free cells that are seen within range from standing cells, taken every 0.2 m."""
    visible = np.zeros_like(solid)
    free, hit, slopes = scan_buffers(range_px)
    stride = max(int(_VIEWS_M * pixels_per_metre), 1)
    mark_visible(solid, stand, stride, range_px, visible, free, hit, slopes)
    visible |= stand  # where it can be, it sees its own cell
    return visible


def scan_buffers(range_px: float) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.float64]]:
    """Return room for the free cells, the obstacles and the slopes of a sector scan."""
    side = 2 * math.ceil(range_px) + 5
    return np.empty(side * side, np.int32), np.empty(side * side, np.int32), np.empty((4, side + 8))
