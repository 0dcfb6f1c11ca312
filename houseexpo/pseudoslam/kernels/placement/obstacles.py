"""Setting an obstacle down: whether it is in the way of anything, looked at where it stands and seldom further."""

from __future__ import annotations

from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Grid

FITS, OVERLAPS, CLOSES_OFF = 0, 1, 2
"""What became of an obstacle."""
_OPEN, _MARKED, _REACHED = 1, 2, 3  # cells of ``traversable``; marks are wiped off before a function returns


@njit(cache=True, nogil=True)
def set_down(
    occupied: Grid, traversable: Grid, spans: Cells, count: int, gap: Cells, robot: Cells, least: int, scratch: Cells
) -> int:
    """Make an obstacle's cells occupied and take away where the robot can no longer stand, or change nothing.

    Parameters
    ----------
    occupied, traversable
        (rows, cols); the latter is one 4-connected piece, 1 where the robot can stand, nowhere on the border.
    spans, count
        The obstacle's, all on the grid, as ``shape_spans`` lists them.
    gap, robot
        Discs of cells, as half their width so many rows from the middle, -1 for none: round the obstacle no cell of
        ``gap`` may be occupied; with its middle in ``robot``, the robot would touch it.
    least
        Cells of a piece that is a place to be; what is cut off and smaller is given up.
    scratch
        (3, rows * cols).
    """
    if not _is_clear(occupied, spans, count, gap):
        return OVERLAPS
    gone, found, queue = scratch
    n_taken = _take(traversable, spans, count, robot, gone)
    flat, cols = traversable.ravel(), traversable.shape[1]
    n_found = _pieces_beside(flat, cols, gone, n_taken, found, queue)
    n_gone, n_found = _give_up_pockets(flat, cols, gone, n_taken, found, n_found, least, queue)
    if n_taken > 0 and (n_found == 0 or not _are_one(flat, cols, found, n_found, queue)):
        for i in range(n_gone):
            flat[gone[i]] = _OPEN
        return CLOSES_OFF
    for i in range(count):
        for col in range(spans[i, 1], spans[i, 2]):
            occupied[spans[i, 0], col] = 1
    return FITS


@njit(inline="always")
def _is_clear(occupied: Grid, spans: Cells, count: int, gap: Cells) -> bool:
    """Whether no cell of the obstacle, nor of the gap round it, is occupied."""
    rows, cols = occupied.shape
    reach = len(gap) - 1
    for i in range(count):
        for row in range(max(spans[i, 0] - reach, 0), min(spans[i, 0] + reach + 1, rows)):
            wide = gap[abs(row - spans[i, 0])]
            if wide >= 0:
                for col in range(max(spans[i, 1] - wide, 0), min(spans[i, 2] + wide, cols)):
                    if occupied[row, col] != 0:
                        return False
    return True


@njit(inline="always")
def _take(traversable: Grid, spans: Cells, count: int, robot: Cells, gone: Cells) -> int:
    """Clear the cells where the robot would touch the obstacle; list them, and return how many there were."""
    rows, cols = traversable.shape
    reach = len(robot) - 1
    n_gone = 0
    for i in range(count):
        for row in range(max(spans[i, 0] - reach, 0), min(spans[i, 0] + reach + 1, rows)):
            wide = robot[abs(row - spans[i, 0])]
            if wide >= 0:
                for col in range(max(spans[i, 1] - wide, 0), min(spans[i, 2] + wide, cols)):
                    if traversable[row, col] != 0:
                        traversable[row, col] = 0
                        gone[n_gone] = row * cols + col
                        n_gone += 1
    return n_gone


@njit(inline="always")
def _pieces_beside(flat: Grid, cols: int, gone: Cells, n_taken: int, found: Cells, queue: Cells) -> int:
    """List a cell of each piece of the open cells round the taken ones (8-connected to them); return how many.

    Every piece of what is left has such cells, for all was one piece. Pieces are 4-connected by cells round the taken
    ones alone: in the open there is one, and nothing further away needs to be looked at.
    """
    n_beside = 0
    for i in range(n_taken):
        for up in (-cols, 0, cols):
            for cell in range(gone[i] + up - 1, gone[i] + up + 2):
                if flat[cell] == _OPEN:
                    flat[cell] = _MARKED
                    found[n_beside] = cell
                    n_beside += 1
    n_found = 0
    for i in range(n_beside):
        cell = found[i]
        if flat[cell] == _MARKED:
            found[n_found] = cell
            n_found += 1
            queue[0], flat[cell] = cell, _OPEN
            tail = 1
            while tail > 0:
                tail -= 1
                here = queue[tail]
                for step in (-cols, -1, 1, cols):
                    if flat[here + step] == _MARKED:
                        queue[tail], flat[here + step] = here + step, _OPEN
                        tail += 1
    return n_found


@njit(inline="always")
def _give_up_pockets(
    flat: Grid, cols: int, gone: Cells, n_gone: int, found: Cells, n_found: int, least: int, queue: Cells
) -> tuple[int, int]:
    """Clear the pieces of fewer than ``least`` cells; return how many cells are gone and how many pieces are left.

    A piece is followed only until it is large enough.
    """
    n_kept = 0
    for i in range(n_found):
        if flat[found[i]] != _OPEN:
            continue  # in a pocket that another cell led to
        queue[0], flat[found[i]] = found[i], _REACHED
        head, tail = 0, 1
        while head < tail < least:
            for step in (-cols, -1, 1, cols):
                cell = queue[head] + step
                if flat[cell] == _OPEN:
                    queue[tail], flat[cell] = cell, _REACHED
                    tail += 1
            head += 1
        if tail >= least:
            found[n_kept] = found[i]
            n_kept += 1
        for j in range(tail):
            flat[queue[j]] = _OPEN if tail >= least else 0
            if tail < least:
                gone[n_gone] = queue[j]
                n_gone += 1
    return n_gone, n_kept


@njit(inline="always")
def _are_one(flat: Grid, cols: int, found: Cells, n_found: int, queue: Cells) -> bool:
    """Whether there is a way between all the cells listed; a way round is mostly short, and the search ends there."""
    for i in range(n_found):
        flat[found[i]] = _MARKED
    queue[0], flat[found[0]] = found[0], _REACHED
    left, head, tail = n_found - 1, 0, 1
    while head < tail and left > 0:
        for step in (-cols, -1, 1, cols):
            cell = queue[head] + step
            if flat[cell] == _OPEN or flat[cell] == _MARKED:
                left -= flat[cell] == _MARKED
                queue[tail], flat[cell] = cell, _REACHED
                tail += 1
        head += 1
    for i in range(n_found):
        flat[found[i]] = _OPEN
    for i in range(tail):
        flat[queue[i]] = _OPEN
    return left == 0
