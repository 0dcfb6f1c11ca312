"""Models that stand far from their origin are moved near it; the way back is kept in the level's frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FAR_M = 500.0  # beyond this, those who cut in float32 lose millimetres

Shift = tuple[float, float, float]


def near_shift(points: npt.NDArray[np.float64]) -> Shift:
    """Whole metres (x, y, z) to take off points (n, 3) so that they lie near the origin; zeros where they do."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    if np.abs(middle).max() < FAR_M:
        return 0.0, 0.0, 0.0
    x, y, z = (float(value) for value in np.round(middle))
    return x, y, z
