"""Place an obstacle if it blocks nothing; usually only its surroundings have to be checked."""

from __future__ import annotations

from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Grid

FITS, OVERLAPS, CLOSES_OFF = 0, 1, 2
"""The outcome of placing an obstacle."""
_OPEN, _MARKED, _REACHED = 1, 2, 3  # cells of ``traversable``; marks are removed before a function returns


@njit(cache=True, nogil=True)
def set_down(
    occupied: Grid, traversable: Grid, spans: Cells, count: int, gap: Cells, robot: Cells, least: int, scratch: Cells
) -> int:
    """Mark an obstacle's cells as occupied and clear those where the robot can no longer stand, or change nothing.

    Parameters
    ----------
    occupied, traversable
        (rows, cols); the latter is 1 for cells where the robot can stand, one 4-connected piece without the border.
    spans, count
        The cells of the obstacle, all on the grid, in the form of ``shape_spans``.
    gap, robot
        Discs of cells, as half their width at each distance in rows from the centre, -1 for none. No cell around the
        obstacle within ``gap`` may be occupied; a robot with its centre within ``robot`` would touch the obstacle.
    least
        Smallest number of cells of a piece; smaller pieces that are cut off are given up.
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
    """Return whether no cell of the obstacle and of the gap around it is occupied."""
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
    """Clear and list the cells where the robot would touch the obstacle; return their number."""
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
    """List one cell of each piece of the open cells around the cleared ones (8-connected); return their number.

    Every remaining piece has such cells, since all cells were one piece. Only cells around the cleared ones are used
    for connecting pieces (4-connected): in an open area there is one piece, and no further cells need to be checked.
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
    """Clear pieces of fewer than ``least`` cells; return the numbers of cleared cells and of remaining pieces.

    A piece is traversed only until it is large enough.
    """
    n_kept = 0
    for i in range(n_found):
        if flat[found[i]] != _OPEN:
            continue  # in a pocket found from another cell
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
    """Return whether all listed cells are connected; a way around is usually short, and the search ends when found."""
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
