"""The unknown area that could be seen from a place, given the obstacles on the map."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Floats, Grid


@njit(cache=True, nogil=True)
def unknown_in_sight(known: Grid, x: float, y: float, range_px: float, fan_cos: Floats, fan_sin: Floats) -> float:
    """Return the unknown area, in cells, that beams in all directions cross before they hit an obstacle of the map.

    Each beam represents its share of the circle, and is sampled at the middle of each pixel of its length.

    Parameters
    ----------
    known
        (rows, cols), the map, at whose border beams end.
    fan_cos, fan_sin
        (n,), directions of evenly spaced beams, right and up.
    """
    rows, cols = known.shape
    area, share = 0.0, 2.0 * math.pi / len(fan_cos)
    for i in range(len(fan_cos)):
        for k in range(int(range_px)):
            away = k + 0.5
            row, col = math.floor(y - away * fan_sin[i]), math.floor(x + away * fan_cos[i])
            if not (0 <= row < rows and 0 <= col < cols) or known[row, col] == OBSTACLE:
                break
            if known[row, col] == UNKNOWN:
                area += away * share
    return area
