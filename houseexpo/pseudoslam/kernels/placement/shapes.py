"""The cells that a shape covers, as spans of rows."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Floats

TIE = 1e-7
"""Distance within which a centre counts as being on an edge, cells; sides on the 1 cm grid run through centres."""
_INWARD = 1.0 - 1e-6  # a thin shape that only touches a cell's side does not cross the cell


@njit(cache=True, nogil=True)
def shape_spans(points: Floats, is_round: bool, thickness: float, rows: int, cols: int) -> tuple[Cells, int, bool]:
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
    inside = min(left, top) >= -TIE and right <= cols + TIE and bottom <= rows + TIE
    first, last = _centre_from(top, rows), _centre_from(bottom, rows)
    pairs = 1 if is_round else len(points) // 2
    edges = 2 if is_round else len(points)
    spans = np.empty((max(last - first, 0) * pairs + edges * (_cell(bottom, rows) - _cell(top, rows) + 1), 3), np.int32)
    crossings = np.empty(len(points))
    count = 0
    for row in range(first, last):
        found = _across_ellipse(points, row + 0.5, crossings) if is_round else _across(points, row, rows, crossings)
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
def _across(points: Floats, row: int, rows: int, crossings: Floats) -> int:
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
def _across_ellipse(points: Floats, y: float, crossings: Floats) -> int:
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
            right, down = (points[i, 0] - x) * _INWARD, (points[i, 1] - y) * _INWARD
            count = _crossed(x - right, y - down, x + right, y + down, rows, cols, spans, count)
        return count
    for i in range(1, len(points)):
        x, y = x + points[i, 0], y + points[i, 1]
    x, y = x / len(points), y / len(points)
    for i in range(len(points)):
        from_x, from_y = x + (points[i - 1, 0] - x) * _INWARD, y + (points[i - 1, 1] - y) * _INWARD
        to_x, to_y = x + (points[i, 0] - x) * _INWARD, y + (points[i, 1] - y) * _INWARD
        count = _crossed(from_x, from_y, to_x, to_y, rows, cols, spans, count)
    return count


@njit(cache=True, nogil=True)
def _crossed(x1: float, y1: float, x2: float, y2: float, rows: int, cols: int, spans: Cells, count: int) -> int:
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
    return int(min(max(np.ceil(position - 0.5 - TIE), 0.0), float(size)))


@njit(cache=True, nogil=True)
def _cell(position: float, size: int) -> int:
    """Return the cell at a position, or the nearest one if it is off the grid."""
    return int(min(max(np.floor(position), 0.0), size - 1.0))
