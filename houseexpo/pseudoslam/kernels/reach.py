"""Which free cells can be seen from where the robot can stand."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid


@njit(cache=True, nogil=True)
def mark_visible(
    solid: Grid, stand: Grid, stride: int, range_px: float, visible: Grid, free: Cells, hit: Cells, slopes: Floats
) -> None:
    """Set ``visible`` to 1 where a full turn in the middle of a standing cell sees a free cell.

    The cells looked from lie ``stride`` apart each way; ``free``, ``hit`` and ``slopes`` are ``sector_scan``'s.
    """
    rows, cols = solid.shape
    flat = visible.ravel()
    for row in range(0, rows, stride):
        for col in range(0, cols, stride):
            if stand[row, col] != 0:
                n_free, _ = sector_scan(solid, col + 0.5, row + 0.5, 0.0, math.pi, range_px, free, hit, slopes)
                for i in range(n_free):
                    flat[free[i]] = 1
