"""What a sensor sees of a sector: every cell is decided, none between two rays is left out.

The plane round the robot is cut into four quadrants. In a quadrant, lines of cells are visited outwards (``k`` along
the axis ``u``, ``j`` across it along ``v``), and a list of slopes ``v / u`` says what is still open::

        v ^        . '       the robot stands at u = v = 0, anywhere in its cell;
          |    . '##         an obstacle takes from the open slopes what its square covers,
          |. '  ####         so that all behind it is hidden
          o-----####----> u

Two squares that share a corner leave a gap of no width between them: a diagonal wall does not leak.
"""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid

EDGE = 1e-9
"""Radians by which the fan is wider than asked for, so that cells on its edge are in it in spite of rounding."""
GAP = 1e-8
"""Slopes nearer to each other than this have nothing between them."""
_CORNER = 1.0 + 1e-12  # a cell on the diagonal belongs to both quadrants
_QUARTER = math.pi / 2


@njit(cache=True, nogil=True)
def sector_scan(
    solid: Grid,
    x: float,
    y: float,
    heading: float,
    half_fov: float,
    range_px: float,
    free: Cells,
    hit: Cells,
    slopes: Floats,
) -> tuple[int, int]:
    """List the cells that are seen from a pose, some of them twice.

    A free cell is seen where the line to its centre lies in the fan and crosses no obstacle's square; an obstacle where
    some line in the fan meets it first. The centre of either lies within range.

    Parameters
    ----------
    solid
        (rows, cols), not 0 where an obstacle is; its border should be solid, for nothing ends the sight there.
    half_fov
        Half the angle of the fan, radians, at most pi.
    free, hit
        Filled with flat indices; as long as the square around the sensor has cells.
    slopes
        (4, n) scratch, n >= 2 * range_px + 8.

    Returns
    -------
    How many cells there are in ``free`` and in ``hit``.
    """
    rows, cols = solid.shape
    flat = solid.ravel()
    col, row = math.floor(x), math.floor(y)
    if not (0 <= row < rows and 0 <= col < cols) or flat[row * cols + col] != 0:
        return 0, 0  # inside an obstacle nothing is seen
    here = row * cols + col
    free[0] = here
    n_free, n_hit = 1, 0
    right, down = x - col - 0.5, y - row - 0.5  # from the middle of the robot's cell
    east, south = cols - 1 - col, rows - 1 - row  # cells up to the border
    for quadrant in range(4):
        open_now = _open_slopes(heading - quadrant * _QUARTER, half_fov + EDGE, slopes)
        if open_now == 0:
            continue
        if quadrant == 0:
            off_u, off_v, along, across, ahead, left, behind = right, -down, 1, -cols, east, row, south
        elif quadrant == 1:
            off_u, off_v, along, across, ahead, left, behind = -down, -right, -cols, -1, row, col, east
        elif quadrant == 2:
            off_u, off_v, along, across, ahead, left, behind = -right, down, -1, cols, col, south, row
        else:
            off_u, off_v, along, across, ahead, left, behind = down, right, cols, 1, south, east, col
        n_free, n_hit = _quadrant(
            flat, here, off_u, off_v, along, across, ahead, left, behind, range_px,
            slopes, open_now, free, n_free, hit, n_hit,
        )  # fmt: skip
    return n_free, n_hit


@njit(cache=True, nogil=True)
def _quadrant(
    flat: Grid,
    here: int,
    off_u: float,
    off_v: float,
    along: int,
    across: int,
    ahead: int,
    left: int,
    right: int,
    range_px: float,
    slopes: Floats,
    open_now: int,
    free: Cells,
    n_free: int,
    hit: Cells,
    n_hit: int,
) -> tuple[int, int]:
    """Go out line by line in one quadrant; steps ``along`` and ``across`` are flat, the borders so many off."""
    lo, hi, new_lo, new_hi = slopes
    for k in range(min(ahead, math.floor(range_px + off_u)) + 1):
        u = k - off_u
        near, far = u - 0.5, u + 0.5
        if far <= 0.0:
            continue
        reach = math.sqrt(max(range_px * range_px - u * u, 0.0))
        first, last = math.ceil(off_v - reach), math.floor(off_v + reach)  # within range
        line = here + k * along
        still_open = 0
        for i in range(open_now):
            cut, end = lo[i], hi[i]
            # R1: all cells of the line that the open slopes touch are looked at; one beyond the range may hide
            low = cut * far if cut < 0.0 else cut * max(near, 0.0)
            high = end * far if end > 0.0 else end * max(near, 0.0)
            j = max(math.floor(low + off_v + 0.5), first - 1, -right)
            j_end = min(math.ceil(high + off_v - 0.5), last + 1, left)
            # R2: a free cell is seen where its centre is
            j_free = max(math.ceil(cut * u + off_v), first, -right)
            j_free_end = min(math.floor(end * u + off_v), last, left) if k > 0 else j_free - 1
            # R3: a line that passes between two corners that touch is closed
            corner = u - EDGE
            if j_free <= j_free_end and off_v - j_free > corner and flat[line + (j_free + 1) * across] != 0:
                j_free += 1
            if j_free <= j_free_end and j_free_end - off_v > corner and flat[line + (j_free_end - 1) * across] != 0:
                j_free_end -= 1
            while j <= j_end:
                cell = line + j * across
                if flat[cell] == 0:
                    if j_free <= j <= j_free_end:
                        free[n_free] = cell
                        n_free += 1
                    j += 1
                    continue
                v = j - off_v
                bottom, top = _slope(v - 0.5, near, far), -_slope(-v - 0.5, near, far)
                if v < -0.5 and near > 0.0 and j < left and flat[cell + across] != 0:
                    top = (v + 0.5) / near  # the neighbour stands before this side
                # R4: an obstacle is seen where some of its square is
                if first <= j <= last and min(top, end) - max(bottom, cut) > GAP:
                    hit[n_hit] = cell
                    n_hit += 1
                # R5: what its square covers is open no more
                if min(bottom, end) - cut > GAP:
                    new_lo[still_open], new_hi[still_open] = cut, min(bottom, end)
                    still_open += 1
                cut = max(cut, top)
                if cut >= end:
                    break
                j += 1
            if end - cut > GAP:
                new_lo[still_open], new_hi[still_open] = cut, end
                still_open += 1
        if still_open == 0:
            break
        lo, hi, new_lo, new_hi = new_lo, new_hi, lo, hi
        open_now = still_open
    return n_free, n_hit


@njit(cache=True, nogil=True)
def _open_slopes(heading: float, half_fov: float, slopes: Floats) -> int:
    """Write the part of a fan that lies in the quadrant, none, one or two intervals of slopes; return how many."""
    lo, hi = slopes[0], slopes[1]
    if half_fov >= math.pi:
        lo[0], hi[0] = -_CORNER, _CORNER
        return 1
    middle = math.atan2(math.sin(heading), math.cos(heading))
    found = 0
    for turns in range(-1, 2):
        start = max(middle - half_fov + turns * 2 * math.pi, -_QUARTER / 2)
        stop = min(middle + half_fov + turns * 2 * math.pi, _QUARTER / 2)
        if stop - start > GAP:
            lo[found] = -_CORNER if start == -_QUARTER / 2 else math.tan(start)
            hi[found] = _CORNER if stop == _QUARTER / 2 else math.tan(stop)
            found += 1
    return found


@njit(cache=True, nogil=True)
def _slope(v: float, near: float, far: float) -> float:
    """Return the lowest slope of a square whose lower side is at ``v``, by its far corner if that is above the axis."""
    if v >= 0.0:
        return v / far
    return v / near if near > 0.0 else -math.inf
