"""Convert between metres and cells of a grid (``GridFrame``), and between a plan's coordinates and its source's.

All such conversions are in this file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.plan import Frame
from houseexpo.plan.checks import to_finite_float
from houseexpo.tolerances import SAME_PX, TINY

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


MAX_CELLS = 1 << 29
"""Largest number of cells of one grid: half a gigabyte of bytes, 900 x 900 m at 25 px/m."""
FEWEST_CELLS = 4
"""Smallest number of cells along the longer side of a plan; a smaller grid does not show its shape."""


@dataclass(frozen=True)
class GridFrame:
    """The position of a grid of square cells in a plan.

    Points are (x, y) in metres, x right, y up. Cells are (row, col); cell (r, c) has its centre at (r + 0.5, c + 0.5)
    cells from the grid's corner.

    - As published (``y_up=False``, the default): rows run along y, and row 0 lies at the lowest y. A viewer that draws
      row 0 at the top shows the plan mirrored about the horizontal axis.
    - As in a picture or a ROS map (``y_up=True``): row 0 lies at the highest y. ``origin_m`` is the lower-left corner
      of the lower-left cell, which ``map.yaml`` calls origin.

    Parameters
    ----------
    origin_m
        (x, y) of the corner with the lowest x and y, metres.
    pixels_per_metre
        Number of cells per metre.
    shape
        (rows, cols).
    y_up
        Whether row 0 lies at the highest y.

    Raises
    ------
    ConfigError
        ``pixels_per_metre`` is not a positive number, or the grid has more than ``MAX_CELLS`` cells.
    """

    origin_m: tuple[float, float]
    pixels_per_metre: float
    shape: tuple[int, int]
    y_up: bool = False

    def __post_init__(self) -> None:
        _check_scale(self.pixels_per_metre)
        if math.prod(self.shape) > MAX_CELLS:
            rows, cols = self.shape
            raise _too_many(f"{rows:,} x {cols:,}")

    @classmethod
    def around(
        cls, bounds: Sequence[float], pixels_per_metre: float, *, margin_px: int = 1, y_up: bool = False
    ) -> GridFrame:
        """Return the smallest grid that covers (x_min, y_min, x_max, y_max), metres, and ``margin_px`` cells all round.

        The margin starts at the lowest corner of the bounds, so that a shifted plan has the same raster. The errors are
        those of the constructor.
        """
        _check_scale(pixels_per_metre)  # before the division
        x1, y1, x2, y2 = (to_finite_float(value, "bounds") for value in bounds)
        if (longest := max(x2 - x1, y2 - y1) * pixels_per_metre) > MAX_CELLS:  # may be infinite
            raise _too_many(f"{longest:.3g} along one side")
        margin_m = margin_px / pixels_per_metre
        # tolerance of 1e-6 cells: 4 m at 25 px/m are 100 cells, not 101 because of rounding
        rows, cols = (math.ceil(size * pixels_per_metre - SAME_PX) + 2 * margin_px for size in (y2 - y1, x2 - x1))
        return cls((x1 - margin_m, y1 - margin_m), pixels_per_metre, (max(rows, 1), max(cols, 1)), y_up)

    @property
    def cell_m(self) -> float:
        """Side of a cell, metres."""
        return 1.0 / self.pixels_per_metre

    def pixels_from_points(self, points: npt.ArrayLike) -> FloatArray:
        """Convert points (..., 2), (x, y) in metres, to continuous pixels (..., 2), (across, down).

        Cell (row, col) covers [col, col + 1) across and [row, row + 1) down.
        """
        pixels = (np.asarray(points, dtype=np.float64) - self.origin_m) * self.pixels_per_metre
        if self.y_up:
            pixels[..., 1] = self.shape[0] - pixels[..., 1]
        return pixels

    def points_from_pixels(self, pixels: npt.ArrayLike) -> FloatArray:
        """Convert continuous pixels (..., 2) to points (..., 2); the inverse of ``pixels_from_points``."""
        across_down = np.array(pixels, dtype=np.float64)
        if self.y_up:
            across_down[..., 1] = self.shape[0] - across_down[..., 1]
        return across_down / self.pixels_per_metre + self.origin_m

    def pixel_from_point(self, x: float, y: float) -> tuple[float, float]:
        """Convert one point like ``pixels_from_points``, with identical results but in a tenth of the time."""
        x_m, y_m = self.origin_m
        across, down = (x - x_m) * self.pixels_per_metre, (y - y_m) * self.pixels_per_metre
        return across, self.shape[0] - down if self.y_up else down

    def point_from_pixel(self, across: float, down: float) -> tuple[float, float]:
        """Convert one pixel to a point; the inverse of ``pixel_from_point``."""
        x_m, y_m = self.origin_m
        up = self.shape[0] - down if self.y_up else down
        return across / self.pixels_per_metre + x_m, up / self.pixels_per_metre + y_m

    def cells_from_points(self, points: npt.ArrayLike) -> IntArray:
        """Convert points (..., 2), (x, y) in metres, to their cells (..., 2), (row, col), which may lie outside."""
        return np.floor(self.pixels_from_points(points)).astype(np.int64)[..., ::-1]

    def points_from_cells(self, cells: npt.ArrayLike) -> FloatArray:
        """Convert cells (..., 2), (row, col), to their centres (..., 2), (x, y) in metres."""
        return self.points_from_pixels(np.asarray(cells, dtype=np.float64)[..., ::-1] + 0.5)

    def contains(self, cells: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return for each cell (..., 2), (row, col), whether it lies on the grid."""
        found = np.asarray(cells)
        return np.asarray(((found >= 0) & (found < np.asarray(self.shape))).all(axis=-1))


def is_too_coarse(bounds: Sequence[float], pixels_per_metre: float) -> bool:
    """Return whether (x_min, y_min, x_max, y_max) has fewer than ``FEWEST_CELLS`` cells along its longer side."""
    x1, y1, x2, y2 = bounds
    return max(x2 - x1, y2 - y1) * pixels_per_metre < FEWEST_CELLS - SAME_PX


def check_not_too_coarse(bounds: Sequence[float], pixels_per_metre: float, name: str) -> None:
    """Raise ConfigError if a grid would not show the shape of a plan (``is_too_coarse``); ``name`` is the plan's."""
    _check_scale(pixels_per_metre)
    if is_too_coarse(bounds, pixels_per_metre):
        x1, y1, x2, y2 = bounds
        raise ConfigError(
            f"pixels_per_metre: {pixels_per_metre:g} makes plan {name!r} ({x2 - x1:.2f} x {y2 - y1:.2f} m) smaller "
            f"than {FEWEST_CELLS} cells; expected at least {FEWEST_CELLS / max(x2 - x1, y2 - y1, TINY):.2g}"
        )


def _too_many(found: str) -> ConfigError:
    return ConfigError(
        f"grid: expected at most {MAX_CELLS:,} cells, found {found}; choose fewer pixels per metre, which is a larger "
        "side of a cell"
    )


def _check_scale(pixels_per_metre: float) -> None:
    if not (math.isfinite(pixels_per_metre) and pixels_per_metre > 0):
        raise ConfigError(f"pixels_per_metre: expected a positive number, found {pixels_per_metre!r}")


def source_points_from_plan(frame: Frame, points: npt.ArrayLike) -> FloatArray:
    """Convert points (..., 2) of a plan to its source's plan axes, in metres: (X, Y) if z is up, (X, Z) if y is up."""
    matrix = np.asarray(frame.matrix)
    moved: FloatArray = np.asarray(points, dtype=np.float64) @ matrix[:, :2].T + matrix[:, 2]
    return moved


def plan_points_from_source(frame: Frame, points: npt.ArrayLike) -> FloatArray:
    """Convert points (..., 2) on the source's plan axes to the plan; the inverse of ``source_points_from_plan``."""
    matrix: npt.NDArray[Any] = np.asarray(frame.matrix)
    moved: FloatArray = (np.asarray(points, dtype=np.float64) - matrix[:, 2]) @ np.linalg.inv(matrix[:, :2]).T
    return moved
