"""Drawing a cell of a kind from a raster, each as likely: how many there are, and which is which."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Grid = npt.NDArray[np.uint8]
Counts = npt.NDArray[np.int64]


def count_before(raster: Grid, value: int) -> Counts:
    """Return how many cells of a value lie in the rows before each one, and in all: (rows + 1)."""
    before = np.zeros(len(raster) + 1, np.int64)
    np.cumsum(np.count_nonzero(raster == value, axis=1), out=before[1:])
    return before


def nth_cell(raster: Grid, value: int, before: Counts, n: int) -> tuple[int, int]:
    """Return row and column of cell ``n`` of a value, from 0, less than ``before[-1]``."""
    row = int(np.searchsorted(before, n, side="right")) - 1
    return row, int(np.flatnonzero(raster[row] == value)[n - before[row]])
