"""Drawing a cell of a kind, 0 or 1, from a raster, each as likely: how many there are, and which is which."""

from __future__ import annotations

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.types import Counts, Grid


def count_before(raster: Grid, value: int) -> Counts:
    """Return how many cells of a value lie in the rows before each one, and in all: (rows + 1)."""
    before = np.zeros(len(raster) + 1, np.int64)
    ones = np.add.reduce(raster, axis=1, dtype=np.int32)  # half the time of counting what is not zero
    np.cumsum(ones if value else raster.shape[1] - ones, out=before[1:])
    return before


@njit(cache=True, nogil=True)
def nth_cell(raster: Grid, value: int, before: Counts, n: int) -> tuple[int, int]:
    """Return row and column of cell ``n`` of a value, from 0, less than ``before[-1]``."""
    row = int(np.searchsorted(before, n, side="right")) - 1
    left = n - before[row]
    col = 0
    while raster[row, col] != value or left > 0:
        left -= raster[row, col] == value
        col += 1
    return row, col
