"""Find for N robots whether a straight step meets an obstacle of their own maps; used for masks of allowed actions."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.collision import distance_to_square
from houseexpo.pseudoslam.kernels.mapping import OBSTACLE
from houseexpo.pseudoslam.kernels.tolerances import TOUCH_PX
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid


@njit(cache=True, nogil=True)
def step_is_free(known: Grid, x: float, y: float, heading: float, distance: float, radius: float) -> bool:
    """Return whether a disc (pixels) meets no obstacle of a map on its way ahead.

    Cells that are unknown do not count as obstacles. Contacts are those of ``collision.free_distance``.
    """
    rows, cols = known.shape
    right, down, r = math.cos(heading), -math.sin(heading), radius - TOUCH_PX
    end_x, end_y = x + distance * right, y + distance * down
    for row in range(max(int(min(y, end_y) - radius), 0), min(int(max(y, end_y) + radius) + 1, rows)):
        for col in range(max(int(min(x, end_x) - radius), 0), min(int(max(x, end_x) + radius) + 1, cols)):
            if known[row, col] == OBSTACLE:  # noqa: SIM102  # one comparison for most cells
                if distance_to_square(x - col - 0.5, y - row - 0.5, right, down, r, distance) < distance:
                    return False
    return True


@njit(cache=True, nogil=True)
def find_free_steps(
    known: Grid, sizes: Counts, poses: Floats, distance: float, radius: float, fit: npt.NDArray[np.bool_]
) -> None:
    """Write ``step_is_free`` for N robots.

    Parameters
    ----------
    known
        (N, cells), the maps, flat and padded.
    sizes
        (N, 2), rows and columns.
    poses
        (N, 3), the believed poses: pixels and radians.
    fit
        (N,), the result.
    """
    for i in range(len(poses)):
        rows, cols = sizes[i]
        grid = known[i, : rows * cols].reshape((rows, cols))
        fit[i] = step_is_free(grid, poses[i, 0], poses[i, 1], poses[i, 2], distance, radius)
