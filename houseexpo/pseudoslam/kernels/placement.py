"""List the cells that a shape covers, find the n-th cell of a value, and set down obstacles that close off nothing."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.tolerances import EDGE_TIE_PX, THIN_SHARE
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Floats, Grid


@njit(cache=True, nogil=True)
def count_before_rows(raster: Grid, value: int) -> Counts:
    """Return the number of cells with a value before each row, and in total (rows + 1,)."""
    rows, cols = raster.shape
    before = np.zeros(rows + 1, np.int64)
    for row in range(rows):
        found = 0
        for col in range(cols):
            found += raster[row, col] == value
        before[row + 1] = before[row] + found
    return before


@njit(cache=True, nogil=True)
def nth_cell(raster: Grid, value: int, before: Counts, n: int) -> tuple[int, int]:
    """Return row and column of the ``n``-th cell with a value, 0 <= n < ``before[-1]``."""
    row = 0
    while before[row + 1] <= n:
        row += 1
    left, col = n - before[row], 0
    while raster[row, col] != value or left > 0:
        left -= raster[row, col] == value
        col += 1
    return row, col


@njit(cache=True, nogil=True)
def list_shape_spans(points: Floats, is_round: bool, thickness: float, rows: int, cols: int) -> tuple[Cells, int, bool]:
    """List the cells that a shape covers.

    - R1: a cell is covered if its centre lies in the shape. Upper and left edges belong to the shape, lower and right
      ones do not, so that shapes with a common edge have no common cell.
    - R2: a shape that is thinner than a cell or contains no centre also covers each cell that its outline (for an
      ellipse, its axes) crosses, so that no shape disappears.

    Parameters
    ----------
    points
        (n, 2), pixels (across, down): the corners of a polygon (even-odd), or the centre of an ellipse and an end of
        each of its axes.
    thickness
        The thickness of the shape, pixels.
    rows, cols
        The size of the grid; cells outside it are left out.

    Returns
    -------
    spans : (m, 3), row, first column, column after the last; the first ``count`` are valid
    count
    inside : whether the whole shape lies on the grid
    """
    left, top, right, bottom = _bounds(points, is_round)
    inside = min(left, top) >= -EDGE_TIE_PX and right <= cols + EDGE_TIE_PX and bottom <= rows + EDGE_TIE_PX
    first, last = _centre_from(top, rows), _centre_from(bottom, rows)
    pairs = 1 if is_round else len(points) // 2
    edges = 2 if is_round else len(points)
    spans = np.empty((max(last - first, 0) * pairs + edges * (_cell(bottom, rows) - _cell(top, rows) + 1), 3), np.int32)
    crossings = np.empty(len(points))
    count = 0
    for row in range(first, last):
        found = (
            _ellipse_crossings(points, row + 0.5, crossings)
            if is_round
            else _polygon_crossings(points, row, rows, crossings)
        )
        for i in range(0, found - 1, 2):  # R1
            start, stop = _centre_from(crossings[i], cols), _centre_from(crossings[i + 1], cols)
            if start < stop:
                spans[count, 0], spans[count, 1], spans[count, 2] = row, start, stop
                count += 1
    if thickness < 1.0 or count == 0:
        count = _outline(points, is_round, rows, cols, spans, count + 0)  # R2; for the constant 0 numba compiles anew
    return spans, count, inside


@njit(cache=True, nogil=True)
def _bounds(points: Floats, is_round: bool) -> tuple[float, float, float, float]:
    """Return the smallest and the largest x and y as (left, top, right, bottom)."""
    if is_round:
        x, y = points[0, 0], points[0, 1]
        half_x = math.hypot(points[1, 0] - x, points[2, 0] - x)
        half_y = math.hypot(points[1, 1] - y, points[2, 1] - y)
        return x - half_x, y - half_y, x + half_x, y + half_y
    left, top, right, bottom = math.inf, math.inf, -math.inf, -math.inf
    for i in range(len(points)):
        left, right = min(left, points[i, 0]), max(right, points[i, 0])
        top, bottom = min(top, points[i, 1]), max(bottom, points[i, 1])
    return left, top, right, bottom


@njit(cache=True, nogil=True)
def _polygon_crossings(points: Floats, row: int, rows: int, crossings: Floats) -> int:
    """Write the crossings of a polygon's edges with the line through a row's centres, in order; return their number."""
    count = 0
    for i in range(len(points)):
        j = i + 1 if i + 1 < len(points) else 0
        x1, y1, x2, y2 = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
        if y1 > y2:  # one direction for both neighbours of an edge: they compute the same crossing to the last bit
            x1, y1, x2, y2 = x2, y2, x1, y1
        if _centre_from(y1, rows) <= row < _centre_from(y2, rows):
            crossing = x1 + (row + 0.5 - y1) * ((x2 - x1) / (y2 - y1))
            place = count
            while place > 0 and crossings[place - 1] > crossing:
                crossings[place] = crossings[place - 1]
                place -= 1
            crossings[place] = crossing
            count += 1
    return count


@njit(cache=True, nogil=True)
def _ellipse_crossings(points: Floats, y: float, crossings: Floats) -> int:
    """Write the crossings of a horizontal line with an ellipse, left to right; return 2, or 0 if there are none.

    The points of the ellipse are centre + cos(t) a + sin(t) b with the half-axes a and b.
    """
    a_x, a_y = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1]
    b_x, b_y = points[2, 0] - points[0, 0], points[2, 1] - points[0, 1]
    height2 = a_y * a_y + b_y * b_y
    off = y - points[0, 1]
    if off * off >= height2:
        return 0
    middle = points[0, 0] + off / height2 * (a_x * a_y + b_x * b_y)
    half = math.sqrt(1.0 - off * off / height2) * abs(a_x * b_y - a_y * b_x) / math.sqrt(height2)
    crossings[0], crossings[1] = middle - half, middle + half
    return 2


@njit(cache=True, nogil=True)
def _outline(points: Floats, is_round: bool, rows: int, cols: int, spans: Cells, count: int) -> int:
    """Append the cells that the edges of a polygon or the axes of an ellipse cross; return the number of spans."""
    x, y = points[0, 0], points[0, 1]
    if is_round:
        for i in range(1, 3):
            right, down = (points[i, 0] - x) * THIN_SHARE, (points[i, 1] - y) * THIN_SHARE
            count = _append_crossed_cells(x - right, y - down, x + right, y + down, rows, cols, spans, count)
        return count
    for i in range(1, len(points)):
        x, y = x + points[i, 0], y + points[i, 1]
    x, y = x / len(points), y / len(points)
    for i in range(len(points)):
        from_x, from_y = x + (points[i - 1, 0] - x) * THIN_SHARE, y + (points[i - 1, 1] - y) * THIN_SHARE
        to_x, to_y = x + (points[i, 0] - x) * THIN_SHARE, y + (points[i, 1] - y) * THIN_SHARE
        count = _append_crossed_cells(from_x, from_y, to_x, to_y, rows, cols, spans, count)
    return count


@njit(cache=True, nogil=True)
def _append_crossed_cells(
    x1: float, y1: float, x2: float, y2: float, rows: int, cols: int, spans: Cells, count: int
) -> int:
    """Append the cells that a line crosses, row by row; return the number of spans."""
    if y1 > y2:
        x1, y1, x2, y2 = x2, y2, x1, y1
    slope = (x2 - x1) / (y2 - y1) if y2 > y1 else 0.0
    if y2 < 0.0 or y1 >= rows:
        return count
    for row in range(_cell(y1, rows), _cell(y2, rows) + 1):
        enter = x1 + (row - y1) * slope if row > y1 else x1
        leave = x1 + (row + 1 - y1) * slope if row + 1 < y2 else x2
        start, stop = min(enter, leave), max(enter, leave)
        if stop >= 0.0 and start < cols:
            spans[count, 0], spans[count, 1], spans[count, 2] = row, _cell(start, cols), _cell(stop, cols) + 1
            count += 1
    return count


@njit(cache=True, nogil=True)
def _centre_from(position: float, size: int) -> int:
    """Return the first cell whose centre lies at or after a position, 0 to ``size``."""
    return int(min(max(np.ceil(position - 0.5 - EDGE_TIE_PX), 0.0), float(size)))


@njit(cache=True, nogil=True)
def _cell(position: float, size: int) -> int:
    """Return the cell at a position, or the nearest one if it is off the grid."""
    return int(min(max(np.floor(position), 0.0), size - 1.0))


FITS, OVERLAPS, CLOSES_OFF = 0, 1, 2
"""The outcome of placing an obstacle."""
_OPEN, _MARKED, _REACHED = 1, 2, 3  # cells of ``traversable``; marks are removed before a function returns


@njit(cache=True, nogil=True)
def place_obstacle(
    occupied: Grid, traversable: Grid, spans: Cells, count: int, gap: Cells, robot: Cells, least: int, scratch: Cells
) -> int:
    """Mark an obstacle's cells as occupied and clear those where the robot can no longer stand, or change nothing.

    Parameters
    ----------
    occupied, traversable
        (rows, cols); the latter is 1 for cells where the robot can stand, one 4-connected piece without the border.
    spans, count
        The cells of the obstacle, all on the grid, in the form of ``list_shape_spans``.
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
    n_gone, n_found = _give_up_small_pieces(flat, cols, gone, n_taken, found, n_found, least, queue)
    if n_taken > 0 and (n_found == 0 or not _are_connected(flat, cols, found, n_found, queue)):
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
def _give_up_small_pieces(
    flat: Grid, cols: int, gone: Cells, n_gone: int, found: Cells, n_found: int, least: int, queue: Cells
) -> tuple[int, int]:
    """Clear pieces of fewer than ``least`` cells; return the numbers of cleared cells and of remaining pieces.

    A piece is traversed only until it is large enough.
    """
    n_kept = 0
    for i in range(n_found):
        if flat[found[i]] != _OPEN:
            continue  # in a piece found from another cell
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
def _are_connected(flat: Grid, cols: int, found: Cells, n_found: int, queue: Cells) -> bool:
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
