"""Merging what a scan saw into the map, and cutting out what the robot is shown of it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Grid, Runs

UNKNOWN, FREE, OBSTACLE = 0, 127, 255
"""What a map holds: black, gray and white in the paper's figure."""
_BITS = 16  # for parts of a cell, in a signed word of 32 for places within a view of up to 20,000 cells


@njit(cache=True, nogil=True)
def merge_cells(known: Grid, countable: Grid, cells: Cells, n_cells: int, value: int) -> tuple[int, int]:
    """Set cells of the map to ``value``; return how many were unknown before, and how many of those count.

    Parameters
    ----------
    known, countable
        (rows, cols); ``countable`` is 1 where a cell counts for coverage, else 0.
    cells
        Flat indices, the first ``n_cells`` of them; a cell may occur many times.
    """
    flat, counts = known.ravel(), countable.ravel()
    new, covered = 0, 0
    for i in range(n_cells):
        cell = np.uint64(cells[np.uint64(i)])
        if flat[cell] == UNKNOWN:
            new += 1
            covered += int(counts[cell])
        flat[cell] = value
    return new, covered


@njit(cache=True, nogil=True)
def merge_runs(known: Grid, countable: Grid, runs: Runs, n_runs: int, value: int) -> tuple[int, int]:
    """Do as ``merge_cells`` does with the first ``n_runs`` runs of cells."""
    flat, counts = known.ravel(), countable.ravel()
    new, covered = 0, 0
    for i in range(n_runs):
        first, stop = runs[i, 0], runs[i, 1] + 1
        least = np.uint8(OBSTACLE)
        for cell in range(first, stop):
            least = min(least, flat[np.uint64(cell)])
        if least == UNKNOWN:  # most runs are known already
            for cell in range(first, stop):
                if flat[np.uint64(cell)] == UNKNOWN:
                    new += 1
                    covered += int(counts[np.uint64(cell)])
        for cell in range(first, stop):
            flat[np.uint64(cell)] = value
    return new, covered


@njit(cache=True, nogil=True)
def crop(known: Grid, x: float, y: float, heading: float, out: Grid) -> None:
    """Write the square of the map round a position, heading up, by the nearest cell; off the map it is unknown.

    ``out`` is (side, side); its middle, between cells where the side is even, is the position. Places are counted in
    whole numbers, of which the lower bits are parts of a cell: less than 1e-4 of one is lost.
    """
    rows, cols = known.shape
    flat, view = known.ravel(), out.ravel()
    side = out.shape[0]
    cos, sin = math.cos(heading), math.sin(heading)
    middle = (side - 1) / 2
    spread = middle * (abs(cos) + abs(sin)) + 1.0
    from_col, from_row = math.floor(x - spread), math.floor(y - spread)  # nothing that is shown lies left of or above
    one = float(1 << _BITS)
    along_x, along_y = np.empty(side, np.int32), np.empty(side, np.int32)
    for j in range(side):
        along_x[j], along_y[j] = math.floor(j * sin * one), math.floor(j * cos * one)
    rate_x = 1.0 / (sin * one) if abs(sin * one) >= 1.0 else 0.0
    rate_y = 1.0 / (cos * one) if abs(cos * one) >= 1.0 else 0.0
    low_x, high_x = -from_col * (1 << _BITS), (cols - from_col) * (1 << _BITS)
    low_y, high_y = -from_row * (1 << _BITS), (rows - from_row) * (1 << _BITS)
    left, top = x - middle * sin - from_col, y - middle * cos - from_row
    cells = np.empty(side, np.int32)
    width = np.int32(cols)
    here = np.int32(from_row * cols + from_col)
    for i in range(side):
        ahead = middle - i
        start_x = np.int32(math.floor((left + ahead * cos) * one))
        start_y = np.int32(math.floor((top - ahead * sin) * one))
        first, last = _span(along_x, rate_x, low_x - int(start_x), high_x - int(start_x), 0, side)
        first, last = _span(along_y, rate_y, low_y - int(start_y), high_y - int(start_y), first, last)
        for j in range(first, last):
            across = np.int32(np.int32(start_x + along_x[np.uint64(j)]) >> np.int32(_BITS))
            down = np.int32(np.int32(start_y + along_y[np.uint64(j)]) >> np.int32(_BITS))
            cells[np.uint64(j)] = np.int32(np.int32(down * width) + np.int32(across + here))
        line = i * side
        for j in range(first):
            view[np.uint64(line + j)] = UNKNOWN
        for j in range(first, last):
            view[np.uint64(line + j)] = flat[np.uint32(cells[np.uint64(j)])]
        for j in range(last, side):
            view[np.uint64(line + j)] = UNKNOWN


@njit(cache=True, nogil=True)
def shrink(
    known: Grid, middle_x: float, middle_y: float, side_px: float, x: float, y: float, spread: float, out: Grid
) -> None:
    """Draw the map coarsely, (cells, cells) round a middle, row 0 on top, as far as within ``spread`` of (x, y).

    A coarse cell, ``side_px`` wide, is an obstacle where one of its cells is, else free where one is, else unknown.
    """
    cells = len(out)
    left, top = middle_x - cells / 2 * side_px, middle_y - cells / 2 * side_px
    first, last = _near(y - top, spread, side_px, cells)
    first_col, last_col = _near(x - left, spread, side_px, cells)
    for i in range(first, last):
        one, other = top + i * side_px, top + (i + 1) * side_px
        for j in range(first_col, last_col):
            out[i, j] = _most(known, one, other, left + j * side_px, left + (j + 1) * side_px)


@njit(cache=True, nogil=True)
def _near(at: float, spread: float, side_px: float, cells: int) -> tuple[int, int]:
    """Return the coarse cells, first and last (excluded), within ``spread``, which may be infinite, of a place."""
    first, last = max((at - spread) / side_px, 0.0), min((at + spread) / side_px, float(cells))
    return math.floor(first), math.ceil(last)


@njit(cache=True, nogil=True)
def _most(known: Grid, top: float, bottom: float, left: float, right: float) -> int:
    """Return the highest value of the cells that begin in a coarse one, one at least; off the map it is unknown."""
    first_row, first_col = math.floor(top), math.floor(left)
    last_row, last_col = max(math.floor(bottom), first_row + 1), max(math.floor(right), first_col + 1)
    most = UNKNOWN
    for row in range(max(first_row, 0), min(last_row, known.shape[0])):
        for col in range(max(first_col, 0), min(last_col, known.shape[1])):
            most = max(most, known[row, col])
    return most


@njit(inline="always")
def _span(along: Cells, rate: float, low: int, high: int, first: int, last: int) -> tuple[int, int]:
    """Return the part of first..last (excluded) where ``along``, which goes 1 / ``rate`` a step, is in [low, high)."""
    if rate != 0.0:  # nearly there at once
        one, other = low * rate, high * rate
        first = int(min(max(min(one, other) - 1.0, first), last))
        last = int(max(min(max(one, other) + 2.0, last), first))
    while first < last and not low <= along[np.uint64(first)] < high:
        first += 1
    while last > first and not low <= along[np.uint64(last - 1)] < high:
        last -= 1
    return first, last
