"""The free cells that can be seen from places where the robot can stand."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.sensing.ranges import distance
from houseexpo.pseudoslam.kernels.types import Cells, Grid, Offsets

_STRIP = 1e-4  # cells to either side of a line
NOWHERE = 1 << 14
"""The approximate offset in cells, down and to the right, if no standing cell was found."""


@njit(cache=True, nogil=True)
def find_standing(
    traversable: Grid, wanted: Grid, before: Offsets, sure_px: float, asked: Cells, away: Offsets, visible: Grid
) -> int:
    """List the wanted cells where the robot cannot stand, and find an approximately nearest standing cell for each.

    Each cell takes over the standing cell of its neighbours, in one pass from the upper left and one back. Cells behind
    corners may find none, or not the nearest.

    Parameters
    ----------
    traversable, wanted
        (rows, cols), 1 for cells where the robot can stand, and for wanted cells; none of them is on the border.
    before
        (rows * cols, 2), the result ``away`` before some of the standing cells were lost; (0, 2) if it is not known. A
        cell that still has a standing cell within ``sure_px``, so close that nothing can be between them, is not listed
        but set to 1 in ``visible``.
    asked
        (rows * cols,), output: flat indices.
    away
        (rows * cols, 2), output: rows down and columns to the right; 0 for standing cells, ``NOWHERE`` for others that
        are not wanted.

    Returns
    -------
    The number of listed cells.
    """
    cols = traversable.shape[1]
    standing, wants, seen = traversable.ravel(), wanted.ravel(), visible.ravel()
    both, far = away.ravel().view(np.int32), np.int32(NOWHERE << 16 | NOWHERE)
    for cell in range(len(standing)):
        both[cell] = np.int32(0) if standing[cell] != 0 else far
    n_asked = 0
    for at in range(len(standing)):
        here = np.uint64(at)
        if wants[here] <= standing[here]:
            continue  # most of a house
        if len(before) > 0 and _still_stands(standing, before, at, cols, sure_px):
            away[here, 0], away[here, 1], seen[here] = before[here, 0], before[here, 1], 1
        else:
            asked[np.uint64(n_asked)] = at
            n_asked += 1
    for k in range(n_asked):
        _ask(away, asked[k], -cols, -1)
    for k in range(n_asked - 1, -1, -1):
        _ask(away, asked[k], cols, 1)
    return n_asked


@njit(inline="always")
def _still_stands(standing: Grid, before: Offsets, at: int, cols: int, sure_px: float) -> bool:
    """Return whether the former standing cell near a cell is within a distance and still a standing cell."""
    cell = np.uint64(at)
    down, right = np.int64(before[cell, 0]), np.int64(before[cell, 1])
    near = down * down + right * right <= sure_px * sure_px
    return bool(near and standing[np.uint64(at + down * cols + right)] != 0)


@njit(inline="always")
def _ask(away: Offsets, cell: int, row_step: int, col_step: int) -> None:
    """Take over the standing cell of the neighbour in the next row or column if it is closer than the current one."""
    here = np.uint64(cell)
    down, right = np.int64(away[here, 0]), np.int64(away[here, 1])
    step = 1 if col_step > 0 else -1
    above, beside = np.uint64(cell + row_step), np.uint64(cell + col_step)
    far_down, far_right = np.int64(away[above, 0]) + step, np.int64(away[above, 1])
    if far_down * far_down + far_right * far_right < down * down + right * right:
        down, right = far_down, far_right
    far_down, far_right = np.int64(away[beside, 0]), np.int64(away[beside, 1]) + step
    if far_down * far_down + far_right * far_right < down * down + right * right:
        down, right = far_down, far_right
    away[here, 0], away[here, 1] = down, right


@njit(cache=True, nogil=True)
def mark_in_sight(
    occupied: Grid, asked: Cells, n_asked: int, away: Offsets, sure_px: float, range_px: float, visible: Grid
) -> int:
    """Set ``visible`` to 1 for asked cells that see the centre of the standing cell at the offset ``away``.

    Within ``sure_px`` nothing can be between them: this is the robot's radius, since it has space there, plus half a
    cell, since the asked cell is free. The others, and those that depend on rounding, remain in ``asked``; return their
    number.
    """
    cols, flat = occupied.shape[1], visible.ravel()
    n_left = 0
    for k in range(n_asked):
        cell = np.int64(asked[k])
        down, right = np.int64(away[np.uint64(cell), 0]), np.int64(away[np.uint64(cell), 1])
        squared = float(down * down + right * right)
        seen = squared <= sure_px * sure_px
        if not seen and squared <= range_px * range_px:
            way = math.sqrt(squared)
            seen = _is_clear(occupied, cell % cols + 0.5, cell // cols + 0.5, right / way, down / way, way)
        if seen:
            flat[cell] = 1
        else:
            asked[n_left] = cell
            n_left += 1
    return n_left


@njit(inline="always")
def _is_clear(occupied: Grid, x: float, y: float, right: float, down: float, way: float) -> bool:
    """Return whether a narrow strip is free, since a line that grazes a corner may not be visible in a sector scan."""
    clear = True
    for aside in (-_STRIP, _STRIP):
        clear = clear and distance(occupied, x - down * aside, y + right * aside, right, down, way) >= way
    return clear
