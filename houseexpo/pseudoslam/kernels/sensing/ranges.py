"""Exact distances of beams to the first obstacle: cells are squares, and none on a beam is missed."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.types import Floats, Grid

CORNER = 1e-9
"""Distance along a beam, pixels, within which crossing both borders of a cell counts as crossing its corner."""


@njit(cache=True, nogil=True)
def cast(
    occupied: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats, range_px: float, out: Floats
) -> None:
    """Write the distance along each beam in pixels, ``range_px`` if there is no obstacle within it.

    All are 0 inside an obstacle. A beam that leaves the grid, or starts outside it, hits nothing; one along the border
    of an obstacle or through its corner passes it.

    Parameters
    ----------
    occupied
        (rows, cols), not 0 for obstacles.
    fan_cos, fan_sin
        (n,), the beams' directions relative to the heading.
    out
        (n,), output.
    """
    cos, sin = math.cos(heading), math.sin(heading)
    for i in range(len(fan_cos)):
        right = fan_cos[i] * cos - fan_sin[i] * sin
        up = fan_sin[i] * cos + fan_cos[i] * sin
        out[i] = distance(occupied, x, y, right, -up, range_px)


@njit(cache=True, nogil=True)
def distance(occupied: Grid, x: float, y: float, right: float, down: float, range_px: float) -> float:
    """Return the length of a beam in the direction (``right``, ``down``, a unit vector), as defined by ``cast``.

    It goes from cell to cell; ``to_x`` and ``to_y`` are the distances along the line to its next borders.
    """
    rows, cols = occupied.shape
    flat = occupied.ravel()
    col, row = math.floor(x), math.floor(y)
    step_x, step_y = (1 if right > 0.0 else -1), (1 if down > 0.0 else -1)
    wide = 1.0 / abs(right) if right != 0.0 else math.inf  # distance along the line between borders
    high = 1.0 / abs(down) if down != 0.0 else math.inf
    to_x = (col + 1 - x if step_x > 0 else x - col) * wide if right != 0.0 else math.inf
    to_y = (row + 1 - y if step_y > 0 else y - row) * high if down != 0.0 else math.inf
    gone = 0.0
    while gone < range_px and 0 <= col < cols and 0 <= row < rows:
        if flat[row * cols + col] != 0:
            return gone
        if to_x < to_y - CORNER:
            gone = to_x
            to_x += wide
            col += step_x
        elif to_y < to_x - CORNER:
            gone = to_y
            to_y += high
            row += step_y
        else:  # a corner is closed if both squares beside it are occupied
            gone = min(to_x, to_y)
            if _is_solid(occupied, row, col + step_x) and _is_solid(occupied, row + step_y, col):
                return min(gone, range_px)
            to_x += wide
            to_y += high
            col += step_x
            row += step_y
    return range_px


@njit(cache=True, nogil=True)
def _is_solid(occupied: Grid, row: int, col: int) -> bool:
    rows, cols = occupied.shape
    return bool(0 <= row < rows and 0 <= col < cols and occupied[row, col] != 0)
