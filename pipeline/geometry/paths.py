"""A path for a disc robot, planned by A* on a raster of the places where the disc can stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import Mask, free_mask

NEAR_CELLS = 2.0
"""A point whose own cell is not free starts from a free one at most this far away."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StandingGrid:
    """Where the disc's centre can stand: ``free`` (rows, cols) and the grid's place in metres."""

    free: Mask
    frame: GridFrame

    def path(self, start: Floats, goal: Floats) -> Floats | None:
        """A shortest path (n, 2) in metres from ``start`` to ``goal`` (2,), both included, or None."""
        from pipeline.kernels.astar import shortest_path  # numba loads slowly, and only pictures need paths

        first, last = self._cell(start), self._cell(goal)
        if first is None or last is None:
            return None
        cells = shortest_path(self.free, *first, *last)
        if not len(cells):
            return None
        return np.concatenate([[start], self.frame.points_from_cells(cells), [goal]])

    def _cell(self, point: Floats) -> tuple[int, int] | None:
        """The free cell (row, col) nearest to a point."""
        row, col = self.frame.pixels_from_points(point)[::-1] - 0.5
        top, left = (max(0, int(np.floor(at - NEAR_CELLS))) for at in (row, col))
        end = int(np.ceil(2 * NEAR_CELLS)) + 2
        free = np.add(np.argwhere(self.free[top : top + end, left : left + end]), (top, left))
        if not len(free):
            return None
        apart = np.hypot(free[:, 0] - row, free[:, 1] - col)
        k = int(np.argmin(apart))
        return (int(free[k, 0]), int(free[k, 1])) if apart[k] <= NEAR_CELLS else None


def standing_grid(floor: BaseGeometry, radius_m: float, pixels_per_metre: float) -> StandingGrid:
    """Rasterise the space of the disc's centre; a passage wider than the disc by less than a cell may be missed."""
    free, frame = free_mask(shapely.buffer(floor, -radius_m, quad_segs=8), pixels_per_metre)
    return StandingGrid(free, frame)


def plan_path(
    floor: BaseGeometry, start: Floats, goal: Floats, radius_m: float, pixels_per_metre: float
) -> Floats | None:
    """A shortest path (n, 2) of a disc of ``radius_m`` over ``floor``, from point to point (2,), or None.

    The path is 8-connected on a grid of ``pixels_per_metre`` and cuts no corner. All lengths and points are metres.
    """
    return standing_grid(floor, radius_m, pixels_per_metre).path(np.asarray(start), np.asarray(goal))
