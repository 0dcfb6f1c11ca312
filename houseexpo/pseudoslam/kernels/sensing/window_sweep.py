"""Follow lines through a window, row by row, with their possible slopes (R4 of ``pockets``)."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid

ASKED, FOUND, LOOKS, LISTED = 1, 2, 4, 8
"""Bits of a cell: it is asked for, is in a pocket, has to look, is listed as a window."""
GRAZE = 1e-6  # by which slopes are widened, since a line may graze a corner


@njit(cache=True, nogil=True)
def sweep(
    occupied: Grid,
    known: Grid,
    marks: Grid,
    window: int,
    quadrant: int,
    low_there: float,
    top_there: float,
    inwards: bool,
    range_px: float,
    beams: Floats,
    looks: Cells,
    n_looks: int,
) -> tuple[float, float, float, int]:
    """Follow lines from a window's square, with slopes ``low_there`` to ``top_there``, through one quadrant.

    Rows are visited outwards, as in ``sector``: ``u`` along an axis, ``v`` across it. A line that reaches a cell comes
    from the previous cell in the row or in the column. Therefore the lowest and the highest slope that may reach a cell
    are those of these neighbours, as far as they lead from the window to the cell at all.

    Parameters
    ----------
    known
        With ``inwards``, not 0 for standing cells; otherwise for cells that are already visible.
    inwards
        Whether to go through free cells up to standing ones, or through the pocket to list its cells that have to look.
    beams
        (2, n), working memory: the slopes of the previous row.
    looks, n_looks
        The listed cells, and their number.

    Returns
    -------
    With ``inwards``, the lowest and the highest slope that lead to a standing cell (lowest > highest if there is none);
    the distance of the nearest one; and the number of listed cells.
    """
    rows, cols = occupied.shape
    flat = occupied.ravel()
    row, col = window // cols, window % cols
    down, right = 1 if quadrant >= 2 else -1, 1 if quadrant % 2 == 0 else -1
    reach = math.ceil(range_px) + 1
    u_end, v_end = min(reach, rows - row if down > 0 else row + 1), min(reach, cols - col if right > 0 else col + 1)
    lowest, highest = beams
    lowest[:v_end], highest[:v_end] = 1.0, -1.0
    found_low, found_top, nearest = math.inf, -math.inf, math.inf  # the last one squared
    first, last = 0, 0
    for u in range(u_end):
        low, top, v, next_first, next_last = 1.0, -1.0, first, v_end, -1
        while v < v_end and (v <= last or low <= top):
            cell = window + u * down * cols + v * right
            if u == 0 and v == 0:
                low, top = low_there, top_there
            elif flat[cell] != 0 if inwards else marks[cell] & FOUND == 0:
                low, top = 1.0, -1.0
            else:
                if low > top:
                    low, top = lowest[v], highest[v]
                elif lowest[v] <= highest[v]:
                    low, top = min(low, lowest[v]), max(top, highest[v])
                if low <= top:
                    low = max(low, (v - 1) / (u + 1) - GRAZE)
                    top = min(top, (v + 1) / (u - 1) + GRAZE) if u > 1 else top
            if low <= top:
                squared = (
                    max(u - 0.5, 0.0) ** 2 + max(v - 0.5, 0.0) ** 2
                )  # from the window's square to the cell's centre
                if squared > range_px * range_px:
                    low, top = 1.0, -1.0
                elif inwards and known[cell] != 0:
                    nearest = min(nearest, squared)
                    found_low, found_top = min(found_low, low), max(found_top, top)
                    low, top = 1.0, -1.0
                elif not inwards and marks[cell] == ASKED | FOUND and known[cell] == 0:
                    marks[cell] |= LOOKS
                    looks[n_looks] = cell
                    n_looks += 1
            lowest[v], highest[v] = low, top
            if low <= top:
                next_first, next_last = min(next_first, v), v
            v += 1
        first, last = next_first, next_last
        if last < 0:
            break
    return found_low, found_top, math.sqrt(nearest), n_looks
