"""Find, when a world is loaded, the free cells that can be seen from where the robot can stand, also through gaps.

Most cells see the nearest standing cell (``find_nearest_standing_cells``, ``mark_seen_from_nearest``). The others lie
in *gaps*: a gap is a 4-connected piece of the free cells that are (or were assumed to be) farther than a sure distance
from all standing cells: a corner, or an opening too narrow for the robot and the rooms behind it. Its *windows* are the
free cells beside it that are not part of it.

R1  A line of sight from a cell of a gap to a standing cell meets a window of that gap. A standing cell is not part of a
    gap, so that the line leaves the gap somewhere. If it crosses a border between two cells there, the cell that it
    enters is free and beside the gap, and therefore a window. If it crosses a corner, one of the two cells beside the
    corner is free, since the corner would be closed otherwise. That cell is a window, or it is part of the gap, and
    then the cell that the line enters is a window. In both cases the line meets the square of a window.
R2  Therefore a cell has to look only towards the windows of its own gap (``sector.box_scan``), and sees a standing
    cell there exactly if it would see one in any direction. Windows side by side are processed together.
R3  A standing cell that was seen looks back through the same windows, since visibility is symmetric, and also sees the
    cell's neighbours.
R4  A line through a window has the same slope on both sides. Only slopes at which lines lead from the window to a
    standing cell are useful, and only the cells to which they lead through the gap have to look (``_follow_lines``).
    Additional slopes and cells do no harm, but only cost time.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.sensing.rays import beam_length
from houseexpo.pseudoslam.kernels.sensing.sector import box_scan
from houseexpo.pseudoslam.kernels.tolerances import GRAZE_SLOPE, STRIP_PX
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Offsets, Runs, as_int64

NOWHERE = 1 << 14
"""The approximate offset in cells, down and to the right, if no standing cell was found."""


@njit(cache=True, nogil=True)
def find_nearest_standing_cells(
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
        _take_over_neighbour(away, asked[k], -cols, -1)
    for k in range(n_asked - 1, -1, -1):
        _take_over_neighbour(away, asked[k], cols, 1)
    return n_asked


@njit(inline="always")
def _still_stands(standing: Grid, before: Offsets, at: int, cols: int, sure_px: float) -> bool:
    """Return whether the former standing cell near a cell is within a distance and still a standing cell."""
    cell = np.uint64(at)
    down, right = np.int64(before[cell, 0]), np.int64(before[cell, 1])
    near = down * down + right * right <= sure_px * sure_px
    return bool(near and standing[np.uint64(at + down * cols + right)] != 0)


@njit(inline="always")
def _take_over_neighbour(away: Offsets, cell: int, row_step: int, col_step: int) -> None:
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
def mark_seen_from_nearest(
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
    for aside in (-STRIP_PX, STRIP_PX):
        clear = clear and beam_length(occupied, x - down * aside, y + right * aside, right, down, way) >= way
    return clear


@njit(cache=True, nogil=True)
def mark_visible_cells(
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
        n_windows = _find_gap(flat, standing, away, sure_px, occupied.shape[1], asked[k], marks, cells, windows)
        for w in range(n_windows):
            if windows[w] >= 0:
                n_looks = _list_lookers(
                    occupied, standing, seen, marks, windows, w, n_windows, sure_px, range_px, beams, box, cells
                )
                for i in range(n_looks):
                    marks[cells[i]] ^= LOOKS
                    if seen[cells[i]] == 0:
                        _look(occupied, standing, cells[i], box, range_px, seen, runs, hit, slopes)


@njit(inline="always")
def _list_lookers(
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
    cols, n_looks = occupied.shape[1], as_int64(0)
    box[0], box[1], box[2], box[3] = len(standing), -1, len(standing), -1  # a slice takes seconds to compile
    for w in range(first, n_windows):
        window = windows[w]
        if window < 0 or not _enlarge_box(box, window // cols, window % cols, sure_px):
            continue
        windows[w] = -1
        marks[window] ^= LISTED
        for quadrant in range(4):
            low, top, rest_px = 0.0, math.inf, range_px
            for inwards in (True, False):  # a constant instead of the variable would be compiled separately
                low, top, near_px, n_looks = _follow_lines(
                    occupied, standing if inwards else seen, marks, window, 3 - quadrant if inwards else quadrant,
                    low, top, inwards, rest_px, beams, looks, n_looks,
                )  # fmt: skip
                if low > top:
                    break
                rest_px = range_px - near_px + GRAZE_SLOPE
    return n_looks


@njit(inline="always")
def _enlarge_box(box: Cells, row: int, col: int, side_px: float) -> bool:
    """Enlarge a box to include a cell, unless it would be too large; return whether it does."""
    top, bottom, left, right = min(box[0], row), max(box[1], row), min(box[2], col), max(box[3], col)
    if max(bottom - top, right - left) > 2.0 * side_px:
        return False
    box[0], box[1], box[2], box[3] = top, bottom, left, right
    return True


@njit(inline="always")
def _find_gap(
    flat: Grid,
    standing: Grid,
    away: Offsets,
    sure_px: float,
    cols: int,
    first: int,
    marks: Grid,
    gap: Cells,
    windows: Cells,
) -> int:
    """Mark the gap of a cell, and list its windows; return their number."""
    gap[0], n_cells, n_windows, at = first, 1, 0, 0
    marks[first] |= FOUND
    while at < n_cells:
        cell = np.int64(gap[at])
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
                gap[n_cells] = other
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
    n_runs = box_scan(occupied, as_int64(cell), box, range_px, runs, hit, slopes)
    found = _first_of(standing, runs, n_runs)
    if found >= 0:
        seen[cell] = 1
        n_runs = box_scan(occupied, as_int64(found), box, range_px, runs, hit, slopes)
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


ASKED, FOUND, LOOKS, LISTED = 1, 2, 4, 8
"""Bits of a cell: it is asked for, is in a gap, has to look, is listed as a window."""


@njit(cache=True, nogil=True)
def _follow_lines(
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
                    low = max(low, (v - 1) / (u + 1) - GRAZE_SLOPE)
                    top = min(top, (v + 1) / (u - 1) + GRAZE_SLOPE) if u > 1 else top
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
