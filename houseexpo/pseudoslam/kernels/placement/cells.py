"""Count the cells of a value, 0 or 1, in a raster, and find the n-th one, for drawing one with equal probability."""

from __future__ import annotations

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.types import Counts, Grid


@njit(cache=True, nogil=True)
def count_before(raster: Grid, value: int) -> Counts:
    """Return the number of cells with a value before each row, and in total (rows + 1,)."""
    rows, cols = raster.shape
    before = np.zeros(rows + 1, np.int64)
    for row in range(rows):
        found = 0
        for col in range(cols):
            found += raster[row, col] == value
        before[row + 1] = before[row] + found
    return before


@njit(cache=True, nogil=True)
def nth_cell(raster: Grid, value: int, before: Counts, n: int) -> tuple[int, int]:
    """Return row and column of the ``n``-th cell with a value, 0 <= n < ``before[-1]``."""
    row = 0
    while before[row + 1] <= n:
        row += 1
    left, col = n - before[row], 0
    while raster[row, col] != value or left > 0:
        left -= raster[row, col] == value
        col += 1
    return row, col
