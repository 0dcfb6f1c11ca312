"""The score of a frontier: a weighted sum of its features (``outlook``)."""

from __future__ import annotations

from numba import njit

from houseexpo.pseudoslam.kernels.types import Floats


@njit(cache=True, nogil=True)
def best_of(outlooks: Floats, n: int, weights: Floats, scores: Floats) -> int:
    """Write the scores of the first n frontiers; return the index of the highest, of equal ones the first."""
    best = 0
    for i in range(n):
        score = 0.0
        for k in range(len(weights)):
            score += weights[k] * outlooks[i, k]
        scores[i] = score
        if score > scores[best]:
            best = i
    return best
