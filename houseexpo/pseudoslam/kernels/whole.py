"""Whole numbers as arguments between kernels."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(inline="always")
def whole(value: int) -> int:
    """Return a number as a variable of 64 bits.

    numba would compile a function again for a constant or a number of 32 bits, which takes seconds at the first step.
    """
    return np.int64(value)  # type: ignore[return-value]  # an int to all who use it
