"""Merging what a scan saw into the map, and cutting out what the robot is shown of it."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Grid

UNKNOWN, FREE, OBSTACLE = 0, 127, 255
"""What a map holds: black, gray and white in the paper's figure."""


@njit(cache=True, nogil=True)
def merge(known: Grid, countable: Grid, cells: Cells, n_cells: int, value: int) -> tuple[int, int]:
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
        cell = cells[i]
        if flat[cell] == UNKNOWN:
            new += 1
            covered += int(counts[cell])
        flat[cell] = value
    return new, covered


@njit(cache=True, nogil=True)
def crop(known: Grid, x: float, y: float, heading: float, out: Grid) -> None:
    """Write the square of the map round a position, heading up, by the nearest cell; off the map it is unknown.

    ``out`` is (side, side); its middle, between cells where the side is even, is the position.
    """
    rows, cols = known.shape
    flat = known.ravel()
    side = out.shape[0]
    cos, sin = math.cos(heading), math.sin(heading)
    middle = (side - 1) / 2
    for i in range(side):
        ahead = middle - i
        left_x = x + ahead * cos - middle * sin
        left_y = y - ahead * sin - middle * cos
        first, last = _span(left_x, sin, cols, 0, side)
        first, last = _span(left_y, cos, rows, first, last)
        line = out[i]
        line[:first] = UNKNOWN
        for j in range(first, last):
            line[j] = flat[int(left_y + j * cos) * cols + int(left_x + j * sin)]
        line[last:] = UNKNOWN


@njit(cache=True, nogil=True)
def _span(start: float, step: float, size: int, first: int, last: int) -> tuple[int, int]:
    """Return the part of first..last (excluded) whose ``start + j * step`` lies in [0, size)."""
    if step != 0.0:
        one, other = -start / step, (size - start) / step
        first = int(min(max(math.floor(min(one, other)), first), last))
        last = int(max(min(math.ceil(max(one, other)) + 1, last), first))
    while first < last and not 0.0 <= start + first * step < size:
        first += 1
    while last > first and not 0.0 <= start + (last - 1) * step < size:
        last -= 1
    return first, last
