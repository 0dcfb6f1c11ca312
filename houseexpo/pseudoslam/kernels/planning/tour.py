"""Short tours of places: nearest neighbours, then 2-opt until nothing improves."""

from __future__ import annotations

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.types import Counts, Floats


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
