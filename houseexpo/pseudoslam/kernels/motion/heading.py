"""Headings: radians, counter-clockwise from x."""

from __future__ import annotations

import math

from numba import njit


@njit(inline="always")
def wrapped(heading: float) -> float:
    """Return the same direction in [-pi, pi]; one that is already in it is unchanged."""
    while heading > math.pi:
        heading -= 2.0 * math.pi
    while heading < -math.pi:
        heading += 2.0 * math.pi
    return heading
