"""List the free cells and obstacles visible in a laser's sector; every cell is decided, even between two rays.

The plane around the robot is divided into four quadrants along the rows and columns of the grid. In a quadrant, rows
are visited outwards (``k`` along the axis ``u``, ``j`` across it along ``v``), and a list of slopes ``v / u`` contains
what is still open::

        u ^      . '       the robot stands at u = v = 0, anywhere in its cell;
          |   ###'         an obstacle removes the slopes that its square covers,
          |   ###          so that everything behind it is hidden;
          | . '
          o---------> v    the robot's own row is row 0: its slopes end at infinity

Rows are contiguous in memory, so that free cells are found and listed as runs. Two squares with a common corner leave a
gap of zero width, so that one cannot see through a diagonal wall.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.tolerances import EDGE_RAD, GAP_RAD, GRAZE_PX, WINDOW_HALF_PX
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Runs, as_int64

_QUARTER = math.pi / 2


@njit(cache=True, nogil=True)
def sector_scan(
    occupied: Grid,
    x: float,
    y: float,
    heading: float,
    half_fov: float,
    range_px: float,
    runs: Runs,
    hit: Cells,
    slopes: Floats,
) -> tuple[int, int]:
    """List the cells that are visible from a pose, some of them twice.

    A free cell is visible if the line to its centre lies in the fan and crosses no obstacle's square. An obstacle is
    visible if it is the first one on some line in the fan. The centre of the cell must be within range.

    Parameters
    ----------
    occupied
        (rows, cols), not 0 for obstacles; the border should be occupied, since nothing else ends the view there.
    half_fov
        Half the angle of the fan, radians, at most pi.
    runs
        (n, 2), output: flat indices of the first and the last free cell of each run, with space for half the cells of
        the square around the sensor.
    hit
        Output: flat indices, with space for all cells of that square.
    slopes
        (4, n), working memory, n >= 2 * range_px + 8.

    Returns
    -------
    The numbers of entries in ``runs`` and in ``hit``.
    """
    rows, cols = occupied.shape
    flat = occupied.ravel()
    col, row = math.floor(x), math.floor(y)
    if not (0 <= row < rows and 0 <= col < cols) or flat[row * cols + col] != 0:
        return 0, 0  # nothing is visible inside an obstacle
    here = row * cols + col
    runs[0, 0], runs[0, 1] = here, here
    n_runs, n_hit = as_int64(1), as_int64(0)
    right, down = x - col - 0.5, y - row - 0.5  # from the centre of the robot's cell
    east, south = cols - 1 - col, rows - 1 - row  # cells up to the border
    for quadrant in range(4):
        up, rightwards = quadrant < 2, quadrant % 2 == 0
        from_axis = heading - _QUARTER if up else -heading - _QUARTER
        open_now = _open_slopes(-from_axis if rightwards else from_axis, half_fov + EDGE_RAD, slopes)
        if open_now > 0:
            n_runs, n_hit = _quadrant(
                flat, here, -down if up else down, right if rightwards else -right,
                -cols if up else cols, 1 if rightwards else -1, row if up else south, east if rightwards else col,
                range_px, slopes, open_now, runs, n_runs, hit, n_hit,
            )  # fmt: skip
    return n_runs, n_hit


@njit(cache=True, nogil=True)
def box_scan(occupied: Grid, cell: int, box: Cells, range_px: float, runs: Runs, hit: Cells, slopes: Floats) -> int:
    """List the free cells that are visible from the centre of a free cell on lines through a box, some of them twice.

    It is a full ``sector_scan`` except for directions that lead past the box.

    Parameters
    ----------
    cell
        Flat index.
    box
        (4,), first and last row, first and last column of a rectangle of cells, which may contain the cell.

    Returns
    -------
    The number of entries in ``runs``.
    """
    rows, cols = occupied.shape
    flat = occupied.ravel()
    row, col = cell // cols, cell % cols
    top, bottom = box[0] - row - WINDOW_HALF_PX, box[1] - row + WINDOW_HALF_PX  # from the centre of the cell
    left, right = box[2] - col - WINDOW_HALF_PX, box[3] - col + WINDOW_HALF_PX
    n_runs = as_int64(0)
    for quadrant in range(4):
        up, rightwards = quadrant < 2, quadrant % 2 == 0
        near_u, far_u = (-bottom, -top) if up else (top, bottom)
        near_v, far_v = (left, right) if rightwards else (-right, -left)
        if far_u <= 0.0 or far_v <= 0.0:
            continue
        slopes[0, 0] = near_v / far_u if near_v > 0.0 else -GRAZE_PX
        slopes[1, 0] = far_v / near_u if near_u > 0.0 else math.inf
        n_runs, _ = _quadrant(
            flat, cell, 0.0, 0.0,
            -cols if up else cols, 1 if rightwards else -1,
            row if up else rows - 1 - row, cols - 1 - col if rightwards else col,
            range_px, slopes, as_int64(1), runs, n_runs, hit, as_int64(0),
        )  # fmt: skip
    return n_runs


@njit(nogil=True)
def _quadrant(
    flat: Grid,
    here: int,
    off_u: float,
    off_v: float,
    along: int,
    across: int,
    ahead: int,
    aside: int,
    range_px: float,
    slopes: Floats,
    open_now: int,
    runs: Runs,
    n_runs: int,
    hit: Cells,
    n_hit: int,
) -> tuple[int, int]:
    """Scan outwards row by row in one quadrant, with flat steps ``along`` and ``across``.

    ``ahead`` and ``aside`` are the numbers of cells up to the borders of the grid.
    """
    lo, hi, new_lo, new_hi = slopes
    for k in range(min(ahead, math.floor(range_px + off_u)) + 1):
        u = k - off_u
        near, far = u - 0.5, u + 0.5
        if far <= 0.0:
            continue
        reach_squared = range_px * range_px - u * u
        reach = math.sqrt(max(reach_squared, 0.0))
        first, last = math.ceil(off_v - reach), min(math.floor(off_v + reach), aside)  # within range
        furthest = min(last + 1, aside)  # a cell beyond the range may hide others
        line = here + k * along
        still_open = 0
        for i in range(open_now):
            cut, end = lo[i], hi[i]
            # R1: all cells of the row that the open slopes touch are checked
            j = max(int(cut * max(near, 0.0) + off_v + 0.5), 0)
            high = end * far + off_v - 0.5
            j_end = furthest if high >= furthest else math.ceil(high)
            # R2: a free cell is seen where its centre is
            high = end * u + off_v + GRAZE_PX if end < math.inf else end
            j_free_end = -1 if u < 0.0 else math.floor(high) if high < last else last
            while j <= j_end:
                start = j
                while j <= j_end and flat[np.uint64(line + j * across)] == 0:
                    j += 1
                one = max(start, first, math.ceil(cut * u + off_v - GRAZE_PX))
                other = min(j - 1, j_free_end)
                if one <= other:
                    one, other = line + one * across, line + other * across
                    runs[n_runs, 0], runs[n_runs, 1] = min(one, other), max(one, other)
                    n_runs += 1
                if j > j_end:
                    break
                v = j - off_v
                bottom, top = (v - 0.5) / far, (v + 0.5) / near if near > 0.0 else math.inf
                # R3: an obstacle is seen where some of its square is
                if v * v <= reach_squared and _is_gap(max(bottom, cut), min(top, end)):
                    hit[n_hit] = line + j * across
                    n_hit += 1
                # R4: what its square covers is open no more
                if _is_gap(cut, min(bottom, end)):
                    new_lo[still_open], new_hi[still_open] = cut, min(bottom, end)
                    still_open += 1
                cut = max(cut, top)
                if not _is_gap(cut, end):
                    break
                j += 1
            if _is_gap(cut, end):
                new_lo[still_open], new_hi[still_open] = cut, end
                still_open += 1
        if still_open == 0:
            break
        lo, hi, new_lo, new_hi = new_lo, new_hi, lo, hi
        open_now = still_open
    return n_runs, n_hit


@njit(inline="always")
def _is_gap(low: float, high: float) -> bool:
    """Return whether there is a gap between two slopes, by their angle, which is the same along rows and columns."""
    return high > low + GAP_RAD * (1.0 + low * low)


@njit(inline="always")
def _open_slopes(middle: float, half_fov: float, slopes: Floats) -> int:
    """Write the part of a fan within a quarter turn of an axis: none, one or two intervals; return their number.

    ``middle`` is the fan's direction, counted from the axis ``u`` towards ``v``.
    """
    lo, hi = slopes[0], slopes[1]
    if half_fov >= math.pi:
        lo[0], hi[0] = -GRAZE_PX, math.inf
        return 1
    middle = math.atan2(math.sin(middle), math.cos(middle))
    found = 0
    for turns in range(-1, 2):
        start = max(middle - half_fov + turns * 2 * math.pi, 0.0)
        stop = min(middle + half_fov + turns * 2 * math.pi, _QUARTER)
        if stop - start > GAP_RAD:
            lo[found] = -GRAZE_PX if start == 0.0 else math.tan(start)
            hi[found] = math.inf if stop == _QUARTER else math.tan(stop)
            found += 1
    return found
