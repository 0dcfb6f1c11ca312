"""Cells that are seen from where the robot can stand only through gaps, if at all.

A *pocket* is a piece (4-connected) of the free cells that lie further than a sure distance from all standing cells, or
were taken to: a corner, a gap too narrow for the robot and the rooms behind it. Its *windows* are the free cells beside
it that are none of its own.

R1  A line of sight from a cell of a pocket to a standing cell meets a window of that pocket. For a standing cell is no
    part of a pocket, so the line leaves the pocket somewhere. Where it crosses a border between two cells there, the
    one that it enters is free and beside the pocket: a window. Where it crosses a corner, one of the two cells beside
    the corner is free, or the corner would be closed: that one is a window, or it is of the pocket, and then the cell
    that the line enters is a window. Either way the line meets the square of a window.
R2  So a cell has to look only towards the windows of its own pocket (``sector.window_scan``), and it sees a standing
    cell there exactly if it would see one all round.
R3  A standing cell that was seen looks back through the same window, for sight goes both ways: it sees the neighbours,
    too.
R4  Through a window, the line has one slope on both sides. Only slopes at which something leads from the window to a
    standing cell are of use, and only cells that they lead to from there through the pocket have to look (``_sweep``).
    More slopes and more cells than there are do no harm: they are looked at in vain.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.sensing.sector import window_scan
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Offsets, Runs

_ASKED, _FOUND = 1, 2  # bits
_GRAZE = 1e-6  # by which slopes are taken wider than they are: a line may graze a corner


@njit(cache=True, nogil=True)
def mark_visible(
    occupied: Grid,
    traversable: Grid,
    asked: Cells,
    n_asked: int,
    away: Offsets,
    sure_px: float,
    range_px: float,
    visible: Grid,
    runs: Runs,
    hit: Cells,
    slopes: Floats,
) -> None:
    """Set ``visible`` to 1 where the middle of a free cell that is asked is seen from the middle of a standing cell.

    Parameters
    ----------
    occupied, traversable
        (rows, cols), not 0 where an obstacle is (on the border, too), 1 where the robot can stand.
    asked
        Flat indices of free cells where it cannot, the first ``n_asked``.
    away
        (rows * cols, 2) rows down and columns to the right to a standing cell, or further than ``sure_px``.
    runs, hit, slopes
        ``sector_scan``'s.
    """
    if n_asked == 0:
        return
    flat, standing, seen = occupied.ravel(), traversable.ravel(), visible.ravel()
    marks, pocket = np.zeros(len(flat), np.uint8), np.empty(len(flat), np.int32)
    windows, beams = np.empty(len(flat), np.int32), np.empty((2, max(occupied.shape)))
    for k in range(n_asked):
        marks[asked[k]] = _ASKED
    for k in range(n_asked):
        if marks[asked[k]] != _ASKED:
            continue
        n_windows = _find_pocket(flat, standing, away, sure_px, occupied.shape[1], asked[k], marks, pocket, windows)
        for w in range(n_windows):
            for quadrant in range(4):
                low, top = _sweep(
                    occupied, standing, marks, windows[w], 3 - quadrant, 0.0, math.inf, True,
                    range_px, seen, beams, runs, hit, slopes
                )  # fmt: skip
                if low <= top:
                    _sweep(
                        occupied, standing, marks, windows[w], quadrant, low, top, False,
                        range_px, seen, beams, runs, hit, slopes
                    )  # fmt: skip


@njit(inline="always")
def _find_pocket(
    flat: Grid,
    standing: Grid,
    away: Offsets,
    sure_px: float,
    cols: int,
    first: int,
    marks: Grid,
    pocket: Cells,
    windows: Cells,
) -> int:
    """Mark the pocket that a cell lies in, and list its windows, some of them twice; return how many are listed."""
    pocket[0], n_cells, n_windows, at = first, 1, 0, 0
    marks[first] |= _FOUND
    while at < n_cells:
        cell = np.int64(pocket[at])
        at += 1
        for step in (-cols, -1, 1, cols):
            other = cell + step
            if flat[other] != 0 or marks[other] & _FOUND != 0:
                continue
            down, right = np.int64(away[other, 0]), np.int64(away[other, 1])
            if standing[other] != 0 or down * down + right * right <= sure_px * sure_px:
                if n_windows == 0 or windows[n_windows - 1] != other:
                    windows[n_windows] = other
                    n_windows += 1
            else:
                marks[other] |= _FOUND
                pocket[n_cells] = other
                n_cells += 1
    return n_windows


@njit(cache=True, nogil=True)
def _sweep(
    occupied: Grid,
    standing: Grid,
    marks: Grid,
    window: int,
    quadrant: int,
    low_there: float,
    top_there: float,
    inwards: bool,
    range_px: float,
    seen: Grid,
    beams: Floats,
    runs: Runs,
    hit: Cells,
    slopes: Floats,
) -> tuple[float, float]:
    """Follow lines from a window's square, of slopes ``low_there`` to ``top_there``, through one quadrant.

    Rows are visited outwards, as in ``sector``: ``u`` along an axis, ``v`` across it. A line that reaches a cell comes
    from the cell before it in the row, or in the column. So each cell has the lowest and the highest slope that may
    reach it: those of either neighbour, as far as they lead from the window to the cell at all.

    Parameters
    ----------
    inwards
        Go through free cells up to standing ones. Otherwise through the pocket, and let its cells look (R2, R3).
    beams
        (2, n) scratch: those slopes in the row before.

    Returns
    -------
    The lowest and the highest slope that lead to a standing cell, 1 and -1 where none does; only ``inwards``.
    """
    rows, cols = occupied.shape
    flat = occupied.ravel()
    row, col = window // cols, window % cols
    down, right = 1 if quadrant >= 2 else -1, 1 if quadrant % 2 == 0 else -1
    reach = math.ceil(range_px) + 1
    u_end, v_end = min(reach, rows - row if down > 0 else row + 1), min(reach, cols - col if right > 0 else col + 1)
    lowest, highest = beams
    lowest[:v_end], highest[:v_end] = 1.0, -1.0
    found_low, found_top = math.inf, -math.inf
    first, last = 0, 0
    for u in range(u_end):
        low, top, v, next_first, next_last = 1.0, -1.0, first, v_end, -1
        while v < v_end and (v <= last or low <= top):
            cell = window + u * down * cols + v * right
            if u == 0 and v == 0:
                low, top = low_there, top_there
            elif flat[cell] != 0 if inwards else marks[cell] & _FOUND == 0:
                low, top = 1.0, -1.0
            else:
                if low > top:
                    low, top = lowest[v], highest[v]
                elif lowest[v] <= highest[v]:
                    low, top = min(low, lowest[v]), max(top, highest[v])
                if low <= top:
                    low = max(low, (v - 1) / (u + 1) - _GRAZE)
                    top = min(top, (v + 1) / (u - 1) + _GRAZE) if u > 1 else top
            if low <= top:
                if inwards and standing[cell] != 0:
                    found_low, found_top = min(found_low, low), max(found_top, top)
                    low, top = 1.0, -1.0
                elif not inwards and marks[cell] == _ASKED | _FOUND and seen[cell] == 0:
                    _look(occupied, standing, cell, window, range_px, seen, runs, hit, slopes)
            lowest[v], highest[v] = low, top
            if low <= top:
                next_first, next_last = min(next_first, v), v
            v += 1
        first, last = next_first, next_last
        if last < 0:
            break
    return found_low, found_top


@njit(inline="always")
def _look(
    occupied: Grid,
    standing: Grid,
    cell: int,
    window: int,
    range_px: float,
    seen: Grid,
    runs: Runs,
    hit: Cells,
    slopes: Floats,
) -> None:
    """Set ``seen`` of a cell that sees a standing cell through a window, and of what that one sees through it (R3)."""
    n_runs = window_scan(occupied, cell, window, range_px, runs, hit, slopes)
    found = _first_of(standing, runs, n_runs)
    if found >= 0:
        seen[cell] = 1
        n_runs = window_scan(occupied, found, window, range_px, runs, hit, slopes)
        for i in range(n_runs):
            for other in range(runs[i, 0], runs[i, 1] + 1):
                seen[other] = 1


@njit(inline="always")
def _first_of(standing: Grid, runs: Runs, n_runs: int) -> int:
    """Return the first standing cell in runs, flat; -1 where there is none."""
    for i in range(n_runs):
        for cell in range(runs[i, 0], runs[i, 1] + 1):
            if standing[cell] != 0:
                return cell
    return -1
