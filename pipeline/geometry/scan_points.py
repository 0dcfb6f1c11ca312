"""The columns of a point cloud: what stands over each spot of it, height by height, as of a scanned surface.

R1  The raster lies in the direction in which the points that stand fall on the fewest rows and columns.
R2  A layer of heights is as thick as it takes for a wall to have ENOUGH points before each cell: a thin cloud has few
    and thick layers.
R3  Ground is where the points about the floor's height lie as close as most of them do; outliers lie far apart.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.geometry.scan_columns import (
    SPREAD,
    STEP_M,
    Bools,
    Columns,
    Floats,
    Raster,
    raster_over,
    sharpest,
)
from pipeline.geometry.scan_noise import drawn_in

THICKEST_M = 0.15
ENOUGH = 3.0
USUAL = 0.98
"""Of the cells that hold points this share holds fewer than a wall's."""
GROUND_M = 0.08
FAINT = 0.3
BLUR = 5
TURNS_DEG = np.arange(0.0, 90.0, 1.5)


def columns_of_points(points: Floats, low_m: float, high_m: float, cell_m: float) -> Columns:
    """The columns of points (n, 3) between two heights above the floor, the second of which is the ceiling's."""
    inside = (points[:, 2] >= low_m) & (points[:, 2] < high_m)
    standing = drawn_in(points[inside])
    raster = _raster(standing[:, :2], cell_m)
    cells = raster.cells(standing[:, :2])
    step = _step(cells, float(np.ptp(standing[:, 2])) if len(standing) else 0.0)
    count = max(1, int((high_m - low_m) / step))
    step = (high_m - low_m) / count
    layer = np.minimum(((standing[:, 2] - low_m) / step).astype(np.int64), count - 1)
    stands = np.zeros((count, *raster.shape), bool)
    stands.reshape(count, -1)[layer, cells] = True
    square = np.ones((2 * SPREAD + 1, 2 * SPREAD + 1), np.uint8)
    for each in stands:
        each[:] = cv2.dilate(each.view(np.uint8), square).view(bool)
    floor = points[np.abs(points[:, 2]) < GROUND_M, :2]
    heights = np.asarray(low_m + (np.arange(count) + 0.5) * step, np.float64)
    return Columns(raster, heights, stands, _ground(floor, raster), high_m)


def _raster(plan: Floats, cell_m: float) -> Raster:
    """R1; the points may lie on a grid of their own, which is the sharpest of all."""
    off = np.random.default_rng(0).uniform(-cell_m / 2, cell_m / 2, plan.shape)
    along = sharpest(plan + off, np.array([1.0, 0.0]), TURNS_DEG)
    return raster_over(plan, sharpest(plan + off, along), cell_m)


def _step(cells: npt.NDArray[np.int64], height_m: float) -> float:
    """R2."""
    mass = np.bincount(cells)
    if not len(cells):
        return STEP_M
    beside = 2 * SPREAD + 1
    per_metre = beside * float(np.quantile(mass[mass > 0], USUAL)) / max(height_m, STEP_M)
    return float(np.clip(ENOUGH / per_metre, STEP_M, THICKEST_M))


def _ground(floor: Floats, raster: Raster) -> Bools:
    """R3."""
    rows, columns = raster.shape
    at = np.floor((floor @ raster.axes.T - raster.origin) / raster.cell_m).astype(np.int64)
    at = at[((at >= 0) & (at < (columns, rows))).all(axis=1)]
    if not len(at):
        return np.zeros(raster.shape, bool)
    mass = np.bincount(at[:, 1] * columns + at[:, 0], minlength=rows * columns).reshape(raster.shape)
    close = np.asarray(cv2.blur(mass.astype(np.float32), (BLUR, BLUR)), np.float32)
    usual = float(np.median(close[at[:, 1], at[:, 0]]))
    return np.asarray(close > FAINT * usual)
