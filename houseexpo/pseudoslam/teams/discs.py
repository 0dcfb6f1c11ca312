"""Find how far a robot can go until it touches another, and mark the cells of robots as moving obstacles."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.kernels.collision import mark_disc

ROBOTS_MOST: Final = 16
"""The largest number of robots in one house."""


def distance_to_touch(
    offsets: Iterable[Iterable[float]], reach: float, course: tuple[float, float], way: float, touch: float
) -> float:
    """Return how far, up to ``way``, a disc can go straight on until it touches one of other discs.

    Discs are exact; cells are not: with those alone, a robot that touches another could not move away from it.

    Parameters
    ----------
    offsets
        (n, 2), the centres of the others relative to the disc's own.
    reach
        The sum of the radii of two discs.
    course
        The direction, a unit vector.
    touch
        The distance that discs keep, so that rounding does not make them overlap.
    """
    free = way
    for x, y in offsets:
        along = x * course[0] + y * course[1]
        inside = along * along - (x * x + y * y - reach * reach)
        if along > 0.0 and inside > 0.0:
            free = min(free, max(along - math.sqrt(inside) - touch, 0.0))
    return free


def mark_discs(occupied: npt.NDArray[np.uint8], centres_px: npt.NDArray[np.float64], radius_px: float) -> None:
    """Mark the cells of discs, whose centres are (n, 2) pixels, as occupied by something that moves."""
    for x, y in centres_px.reshape(-1, 2).tolist():
        mark_disc(occupied, x, y, max(radius_px, 1.0))
