"""Whole numbers that kernels hand to each other."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(inline="always")
def whole(value: int) -> int:
    """Return a number as a variable of 64 bits.

    numba compiles a function once more for a constant, and for a number of 32 bits: seconds of the first step.
    """
    return np.int64(value)  # type: ignore[return-value]  # an int to all who use it
