"""Cells that can be seen from places where the robot can stand only through gaps, if at all.

A *pocket* is a 4-connected piece of the free cells that are (or were assumed to be) farther than a sure distance from
all standing cells: a corner, or a gap too narrow for the robot and the rooms behind it. Its *windows* are the free
cells beside it that are not part of it.

R1  A line of sight from a cell of a pocket to a standing cell meets a window of that pocket. A standing cell is not
    part of a pocket, so that the line leaves the pocket somewhere. If it crosses a border between two cells there, the
    cell that it enters is free and beside the pocket, and therefore a window. If it crosses a corner, one of the two
    cells beside the corner is free, since the corner would be closed otherwise. That cell is a window, or it is part of
    the pocket, and then the cell that the line enters is a window. In both cases the line meets the square of a window.
R2  Therefore a cell has to look only towards the windows of its own pocket (``sector.window_scan``), and sees a
    standing cell there exactly if it would see one in any direction. Windows side by side are processed together.
R3  A standing cell that was seen looks back through the same windows, since visibility is symmetric, and also sees the
    cell's neighbours.
R4  A line through a window has the same slope on both sides. Only slopes at which lines lead from the window to a
    standing cell are useful, and only the cells to which they lead through the pocket have to look (``window_sweep``).
    Additional slopes and cells do no harm, but only cost time.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.sensing.sector import window_scan
from houseexpo.pseudoslam.kernels.sensing.window_sweep import ASKED, FOUND, GRAZE, LISTED, LOOKS, sweep
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Offsets, Runs
from houseexpo.pseudoslam.kernels.whole import whole


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
    """Set ``visible`` to 1 for the asked free cells whose centre can be seen from the centre of a standing cell.

    Parameters
    ----------
    occupied, traversable
        (rows, cols), not 0 for obstacles (including the border); 1 for cells where the robot can stand.
    asked
        Flat indices of free cells where it cannot stand, of which the first ``n_asked`` are used.
    away
        (rows * cols, 2), rows down and columns to the right to a standing cell, or farther than ``sure_px``.
    runs, hit, slopes
        Working memory as in ``sector_scan``.
    """
    if n_asked == 0:
        return
    flat, standing, seen = occupied.ravel(), traversable.ravel(), visible.ravel()
    marks, cells = np.zeros(len(flat), np.uint8), np.empty(len(flat), np.int32)
    windows, box, beams = np.empty(len(flat), np.int32), np.empty(4, np.int32), np.empty((2, max(occupied.shape)))
    for k in range(n_asked):
        marks[asked[k]] = ASKED
    for k in range(n_asked):
        if marks[asked[k]] != ASKED:
            continue
        n_windows = _find_pocket(flat, standing, away, sure_px, occupied.shape[1], asked[k], marks, cells, windows)
        for w in range(n_windows):
            if windows[w] >= 0:
                n_looks = _who_looks(
                    occupied, standing, seen, marks, windows, w, n_windows, sure_px, range_px, beams, box, cells
                )
                for i in range(n_looks):
                    marks[cells[i]] ^= LOOKS
                    if seen[cells[i]] == 0:
                        _look(occupied, standing, cells[i], box, range_px, seen, runs, hit, slopes)


@njit(inline="always")
def _who_looks(
    occupied: Grid,
    standing: Grid,
    seen: Grid,
    marks: Grid,
    windows: Cells,
    first: int,
    n_windows: int,
    sure_px: float,
    range_px: float,
    beams: Floats,
    box: Cells,
    looks: Cells,
) -> int:
    """List the cells that have to look through a window and those near it; return their number.

    ``box`` is set to those windows, which are then -1 in ``windows``.
    """
    cols, n_looks = occupied.shape[1], whole(0)
    box[0], box[1], box[2], box[3] = len(standing), -1, len(standing), -1  # a slice takes seconds to compile
    for w in range(first, n_windows):
        window = windows[w]
        if window < 0 or not _takes_in(box, window // cols, window % cols, sure_px):
            continue
        windows[w] = -1
        marks[window] ^= LISTED
        for quadrant in range(4):
            low, top, rest_px = 0.0, math.inf, range_px
            for inwards in (True, False):  # a constant instead of the variable would be compiled separately
                low, top, near_px, n_looks = sweep(
                    occupied, standing if inwards else seen, marks, window, 3 - quadrant if inwards else quadrant,
                    low, top, inwards, rest_px, beams, looks, n_looks,
                )  # fmt: skip
                if low > top:
                    break
                rest_px = range_px - near_px + GRAZE
    return n_looks


@njit(inline="always")
def _takes_in(box: Cells, row: int, col: int, side_px: float) -> bool:
    """Enlarge a box to include a cell, unless it would be too large; return whether it does."""
    top, bottom, left, right = min(box[0], row), max(box[1], row), min(box[2], col), max(box[3], col)
    if max(bottom - top, right - left) > 2.0 * side_px:
        return False
    box[0], box[1], box[2], box[3] = top, bottom, left, right
    return True


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
    """Mark the pocket of a cell, and list its windows; return their number."""
    pocket[0], n_cells, n_windows, at = first, 1, 0, 0
    marks[first] |= FOUND
    while at < n_cells:
        cell = np.int64(pocket[at])
        at += 1
        for step in (-cols, -1, 1, cols):
            other = cell + step
            if flat[other] != 0 or marks[other] & FOUND != 0:
                continue
            down, right = np.int64(away[other, 0]), np.int64(away[other, 1])
            if standing[other] != 0 or down * down + right * right <= sure_px * sure_px:
                if marks[other] & LISTED == 0:
                    marks[other] |= LISTED
                    windows[n_windows] = other
                    n_windows += 1
            else:
                marks[other] |= FOUND
                pocket[n_cells] = other
                n_cells += 1
    return n_windows


@njit(inline="always")
def _look(
    occupied: Grid,
    standing: Grid,
    cell: int,
    box: Cells,
    range_px: float,
    seen: Grid,
    runs: Runs,
    hit: Cells,
    slopes: Floats,
) -> None:
    """Set ``seen`` of a cell that sees a standing cell through a box, and of the cells that this one sees (R3)."""
    n_runs = window_scan(occupied, whole(cell), box, range_px, runs, hit, slopes)
    found = _first_of(standing, runs, n_runs)
    if found >= 0:
        seen[cell] = 1
        n_runs = window_scan(occupied, whole(found), box, range_px, runs, hit, slopes)
        for i in range(n_runs):
            for other in range(runs[i, 0], runs[i, 1] + 1):
                seen[other] = 1


@njit(inline="always")
def _first_of(standing: Grid, runs: Runs, n_runs: int) -> int:
    """Return the flat index of the first standing cell in runs, -1 if there is none."""
    for i in range(n_runs):
        for cell in range(runs[i, 0], runs[i, 1] + 1):
            if standing[cell] != 0:
                return cell
    return -1
