"""A cloud of points without most of its noise: each point is drawn to the middle of those about it.

Walls stand upright, so that what lies above and below a point says where its wall is.

R1  The points are taken band by band of height. In each band, seen from above, a point goes STEPS times to the middle
    of the points about it, weighed by a Gaussian: to the ridge of the wall that it is of.
R2  An outlier has far fewer points about it than a wall's, and is dropped.
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.geometry.scan_columns import Floats

BAND_M = 0.3
PIXEL_M = 0.01
REACH_M = 0.03
"""The Gaussian's; the two faces of a thin wall are three times as far apart."""
STEPS = 4
USUAL = 0.9
FEW = 0.15
MAX_PIXELS = 16_000_000


def drawn_in(points: Floats) -> Floats:
    """The points (n, 3) that stand, drawn in; fewer than there were."""
    if not len(points):
        return points
    band = np.floor((points[:, 2] - points[:, 2].min()) / BAND_M).astype(np.int64)
    found = [_of_band(points[band == k]) for k in range(int(band.max()) + 1)]
    return np.concatenate(found)


def _of_band(points: Floats) -> Floats:
    if not len(points):
        return points
    low = points[:, :2].min(axis=0) - 4 * REACH_M
    size = points[:, :2].max(axis=0) + 4 * REACH_M - low
    pixel = max(PIXEL_M, float(np.sqrt(np.prod(size) / MAX_PIXELS)))
    columns, rows = (np.ceil(size / pixel).astype(int) + 1).tolist()
    at = (points[:, :2] - low) / pixel
    cell = np.floor(at).astype(np.int64)
    flat = cell[:, 1] * columns + cell[:, 0]
    sums = [np.bincount(flat, weight, rows * columns) for weight in (None, at[:, 0], at[:, 1])]
    mass, x, y = (_blurred(each.reshape(rows, columns).astype(np.float64), REACH_M / pixel) for each in sums)
    middle = np.stack([x, y], axis=2) / np.maximum(mass, 1e-6)[:, :, None]
    for _ in range(STEPS):  # R1
        cell = np.floor(at).astype(np.int64)
        at = middle[cell[:, 1], cell[:, 0]]
    cell = np.floor(at).astype(np.int64)
    close = mass[cell[:, 1], cell[:, 0]]
    kept = close > FEW * np.quantile(close, USUAL)  # R2
    return np.column_stack([at[kept] * pixel + low, points[kept, 2]])


def _blurred(image: Floats, sigma_px: float) -> Floats:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.float64)
