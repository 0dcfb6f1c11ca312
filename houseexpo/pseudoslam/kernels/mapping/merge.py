"""Merge scans into the map, and draw a coarse overview of it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Grid, Runs

UNKNOWN, FREE, OBSTACLE = 0, 127, 255
"""The values of a map: black, gray and white in the paper's figure."""


@njit(cache=True, nogil=True)
def merge_cells(known: Grid, observable: Grid, cells: Cells, n_cells: int, value: int) -> tuple[int, int]:
    """Set cells of the map to ``value``; return how many were unknown before, and how many of those count.

    Parameters
    ----------
    known, observable
        (rows, cols); the latter is 1 for cells that count for coverage, else 0.
    cells
        Flat indices, of which the first ``n_cells`` are used; a cell may occur several times.
    """
    flat, counts = known.ravel(), observable.ravel()
    new, covered = 0, 0
    for i in range(n_cells):
        cell = np.uint64(cells[np.uint64(i)])
        if flat[cell] == UNKNOWN:
            new += 1
            covered += int(counts[cell])
        flat[cell] = value
    return new, covered


@njit(cache=True, nogil=True)
def merge_runs(known: Grid, observable: Grid, runs: Runs, n_runs: int, value: int) -> tuple[int, int]:
    """Do the same as ``merge_cells`` with the first ``n_runs`` runs of cells."""
    flat, counts = known.ravel(), observable.ravel()
    new, covered = 0, 0
    for i in range(n_runs):
        first, stop = runs[i, 0], runs[i, 1] + 1
        least = np.uint8(OBSTACLE)
        for cell in range(first, stop):
            least = min(least, flat[np.uint64(cell)])
        if least == UNKNOWN:  # most runs are already known
            for cell in range(first, stop):
                if flat[np.uint64(cell)] == UNKNOWN:
                    new += 1
                    covered += int(counts[np.uint64(cell)])
        for cell in range(first, stop):
            flat[np.uint64(cell)] = value
    return new, covered


@njit(cache=True, nogil=True)
def shrink(
    known: Grid, middle_x: float, middle_y: float, side_px: float, x: float, y: float, spread: float, out: Grid
) -> None:
    """Draw the overview of the map (cells, cells) around a centre, row 0 on top, within ``spread`` of (x, y).

    A coarse cell, ``side_px`` wide, is an obstacle if one of its cells is one, else free if one is free, else unknown.
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
    """Return the first and the last (excluded) coarse cell within ``spread``, which may be infinite, of a place."""
    first, last = max((at - spread) / side_px, 0.0), min((at + spread) / side_px, float(cells))
    return math.floor(first), math.ceil(last)


@njit(cache=True, nogil=True)
def _most(known: Grid, top: float, bottom: float, left: float, right: float) -> int:
    """Return the highest value of the cells that start in a coarse one, at least one; unknown outside the map."""
    first_row, first_col = math.floor(top), math.floor(left)
    last_row, last_col = max(math.floor(bottom), first_row + 1), max(math.floor(right), first_col + 1)
    most = UNKNOWN
    for row in range(max(first_row, 0), min(last_row, known.shape[0])):
        for col in range(max(first_col, 0), min(last_col, known.shape[1])):
            most = max(most, known[row, col])
    return most
