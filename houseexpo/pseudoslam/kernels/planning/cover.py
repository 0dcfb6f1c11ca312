"""Few places from which everything is seen: what each sees, and those that together see most, the best first."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Grid, Scratch


@njit(cache=True, nogil=True)
def list_views(
    occupied: Grid, wanted: Grid, places: Cells, range_px: float, scratch: Scratch, starts: Counts, views: Cells
) -> bool:
    """List the wanted cells that are seen all round from the middle of each place; False where there is no room.

    Parameters
    ----------
    occupied, wanted
        (rows, cols), not 0 where an obstacle is, and where a cell counts.
    places
        (n,) flat indices of free cells.
    starts
        (n + 1,) filled: place ``i`` sees ``views[starts[i] : starts[i + 1]]``, each cell once.
    views
        Filled with flat indices.
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
def count_views(starts: Counts, views: Cells, i: int, covered: Grid) -> int:
    """Return how many cells place ``i`` sees that are not covered."""
    new = 0
    for k in range(starts[i], starts[i + 1]):
        new += 1 if covered[np.uint64(views[np.uint64(k)])] == 0 else 0
    return new


@njit(cache=True, nogil=True)
def count_all(starts: Counts, views: Cells, covered: Grid) -> Counts:
    """Return (n,) ``count_views`` of all places."""
    counts = np.zeros(len(starts) - 1, np.int64)
    for i in range(len(counts)):
        counts[i] = count_views(starts, views, i, covered)
    return counts


@njit(cache=True, nogil=True)
def greedy_cover(starts: Counts, views: Cells, least: int, covered: Grid, chosen: Counts) -> int:
    """Choose places, each time the one that sees most of what none before sees; return how many.

    What a place adds never grows, so that what it added before is a bound: only the place with the highest bound is
    counted anew, until that is what it adds.

    Parameters
    ----------
    starts, views
        As ``list_views`` fills them.
    least
        Cells that a place must add.
    covered
        (cells,) not 0 where a cell needs not be seen; set where one is.
    chosen
        (n,) filled with the numbers of places; of equal ones the first.
    """
    bounds = count_all(starts, views, covered)
    n = 0
    while n < len(chosen) and len(bounds) > 0:
        best = int(np.argmax(bounds))
        while True:
            bounds[best] = count_views(starts, views, best, covered)
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
