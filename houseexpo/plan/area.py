"""The area of a ring."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def signed_area(ring: npt.NDArray[np.float64]) -> float:
    """Return the area in m2 of a ring (n, 2) by the shoelace formula, negative if it runs clockwise."""
    x, y = (ring - ring[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
