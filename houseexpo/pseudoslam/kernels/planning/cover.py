"""Choose few places that together see everything, and order places in a short tour; used by explorers.

The views of places are listed, a greedy cover selects some of the places, and the tour visits the nearest neighbour
first and is then improved by 2-opt until nothing shortens it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Floats, Grid, Scratch


@njit(cache=True, nogil=True)
def list_visible_cells(
    occupied: Grid, wanted: Grid, places: Cells, range_px: float, scratch: Scratch, starts: Counts, views: Cells
) -> bool:
    """List the wanted cells that are visible from the centre of each place; return False if ``views`` is too short.

    Parameters
    ----------
    occupied, wanted
        (rows, cols), not 0 for obstacles and for cells that count.
    places
        (n,), flat indices of free cells.
    starts
        (n + 1,), output: place ``i`` sees ``views[starts[i] : starts[i + 1]]``, each cell once.
    views
        Output: flat indices.
    """
    rows, cols = occupied.shape
    counts, last = wanted.ravel(), np.full(rows * cols, -1, np.int32)
    starts[0], n = 0, 0
    for i in range(len(places)):
        row, col = places[i] // cols, places[i] % cols
        n_runs, _ = sector_scan(
            occupied, col + 0.5, row + 0.5, 0.0, math.pi, range_px, scratch.runs, scratch.hit, scratch.slopes
        )
        for k in range(n_runs):
            for cell in range(scratch.runs[k, 0], scratch.runs[k, 1] + 1):
                if counts[cell] != 0 and last[cell] != i:
                    if n == len(views):
                        return False
                    last[cell] = i
                    views[n] = cell
                    n += 1
        starts[i + 1] = n
    return True


@njit(cache=True, nogil=True)
def count_new_cells(starts: Counts, views: Cells, i: int, covered: Grid) -> int:
    """Return the number of cells that place ``i`` sees and that are not covered."""
    new = 0
    for k in range(starts[i], starts[i + 1]):
        new += 1 if covered[np.uint64(views[np.uint64(k)])] == 0 else 0
    return new


@njit(cache=True, nogil=True)
def count_new_cells_of_all(starts: Counts, views: Cells, covered: Grid) -> Counts:
    """Return ``count_new_cells`` of all places (n,)."""
    counts = np.zeros(len(starts) - 1, np.int64)
    for i in range(len(counts)):
        counts[i] = count_new_cells(starts, views, i, covered)
    return counts


@njit(cache=True, nogil=True)
def greedy_cover(starts: Counts, views: Cells, least: int, covered: Grid, chosen: Counts) -> int:
    """Choose places greedily, each time the one that adds most visible cells; return their number.

    The number of cells that a place adds never grows, so that earlier counts are upper bounds: only the place with the
    highest bound is counted again, until the bound is exact.

    Parameters
    ----------
    starts, views
        The output of ``list_visible_cells``.
    least
        Smallest number of cells that a place must add.
    covered
        (cells,), not 0 for cells that need not be seen; visible cells are set.
    chosen
        (n,), output: the numbers of places; of equal ones the first.
    """
    bounds = count_new_cells_of_all(starts, views, covered)
    n = 0
    while n < len(chosen) and len(bounds) > 0:
        best = int(np.argmax(bounds))
        while True:
            bounds[best] = count_new_cells(starts, views, best, covered)
            other = int(np.argmax(bounds))
            if other == best:
                break
            best = other
        if bounds[best] < least:
            return n
        for k in range(starts[best], starts[best + 1]):
            covered[views[k]] = 1
        chosen[n] = best
        n += 1
    return n


@njit(cache=True, nogil=True)
def short_tour(lengths: Floats) -> Counts:
    """Return the places in the order of a short path through all of them (n,), from the first to any last one.

    Reversing any part of the path would not shorten it. Of equal steps, the one to the lower number is taken.

    Parameters
    ----------
    lengths
        (n, n), distances between places, symmetric and finite.
    """
    n = len(lengths)
    order = np.arange(n)
    for i in range(1, n - 1):
        best = i
        for k in range(i + 1, n):
            if lengths[order[i - 1], order[k]] < lengths[order[i - 1], order[best]]:
                best = k
        nearest = order[best]
        order[i + 1 : best + 1] = order[i:best].copy()
        order[i] = nearest
    improved = True
    while improved:
        improved = False
        for i in range(1, n - 1):
            for k in range(i + 1, n):
                before = lengths[order[i - 1], order[i]]
                after = lengths[order[i - 1], order[k]]
                if k < n - 1:
                    before += lengths[order[k], order[k + 1]]
                    after += lengths[order[i], order[k + 1]]
                if after < before - 1e-9:
                    order[i : k + 1] = order[i : k + 1][::-1].copy()
                    improved = True
    return order
