"""The scan of the published simulator: unit steps along each ray of a fan, to the first obstacle."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid

_EVEN = 6755399441055744.0  # 1.5 * 2**52: adding and taking it away rounds, halves to even, as np.rint does


@njit(cache=True, nogil=True)
def ray_scan(
    solid: Grid,
    x: float,
    y: float,
    heading: float,
    fan_cos: Floats,
    fan_sin: Floats,
    range_px: float,
    free: Cells,
    hit: Cells,
) -> tuple[int, int]:
    """List the cells on the rays, those near the robot many times.

    Sample k of a ray is the cell whose centre is nearest to the point k pixels along it, k = 0 to ``range_px``
    rounded; the first that is solid ends the ray and is listed.

    Parameters
    ----------
    fan_cos, fan_sin
        (n,) the rays' directions from the heading.
    free, hit
        Filled with flat indices; room for all samples of all rays, and for one a ray.

    Returns
    -------
    How many cells there are in ``free`` and in ``hit``.
    """
    rows, cols = solid.shape
    flat = solid.ravel()
    x0, y0 = x - 0.5, y - 0.5  # cells' centres at whole numbers
    samples = int(range_px + _EVEN - _EVEN) + 1
    cos, sin = math.cos(heading), math.sin(heading)
    n_free, n_hit = 0, 0
    for i in range(len(fan_cos)):
        right = fan_cos[i] * cos - fan_sin[i] * sin
        up = fan_sin[i] * cos + fan_cos[i] * sin
        for k in range(samples):
            col = int(x0 + k * right + _EVEN - _EVEN)
            row = int(y0 - k * up + _EVEN - _EVEN)
            if not (0 <= row < rows and 0 <= col < cols):
                break
            cell = row * cols + col
            if flat[cell] == 0:
                free[n_free] = cell
                n_free += 1
                continue
            if k > 0:  # inside an obstacle nothing is seen
                hit[n_hit] = cell
                n_hit += 1
            break
    return n_free, n_hit
