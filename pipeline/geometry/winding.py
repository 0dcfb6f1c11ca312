"""How often a section's segments wind around a point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely


def winding_number(points: npt.NDArray[np.object_], segments: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """How often the oriented segments wind around each point, counter-clockwise positive (ray to +x)."""
    if not len(points):
        return np.zeros(0, np.int64)
    x, y = shapely.get_x(points)[:, None], shapely.get_y(points)[:, None]
    (x1, y1), (x2, y2) = segments[:, 0].T, segments[:, 1].T
    up, down = (y1 <= y) & (y2 > y), (y2 <= y) & (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x1 + (y - y1) * (x2 - x1) / (y2 - y1)
    right = at > x
    return np.asarray((up & right).sum(axis=1) - (down & right).sum(axis=1), np.int64)
