"""The score of a frontier: a line, and a net with two inner layers, of the numbers that describe it (``outlook``)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.types import Floats


class Scorer(NamedTuple):
    """Weights, for n numbers and layers of h and k cells; a cell is max(0, x)."""

    line: Floats
    """(n,)"""
    first: Floats
    """(h, n)"""
    first_bias: Floats
    """(h,)"""
    second: Floats
    """(k, h)"""
    second_bias: Floats
    """(k,)"""
    last: Floats
    """(k,)"""


@njit(cache=True, nogil=True)
def best_of(outlooks: Floats, n: int, scorer: Scorer, scores: Floats) -> int:
    """Score the first n, into ``scores``; return the number of the highest, of equal ones the first."""
    first, second = np.empty(len(scorer.first_bias)), np.empty(len(scorer.second_bias))
    best = 0
    for i in range(n):
        score = 0.0
        for k in range(outlooks.shape[1]):
            score += scorer.line[k] * outlooks[i, k]
        for j in range(len(first)):
            value = scorer.first_bias[j]
            for k in range(outlooks.shape[1]):
                value += scorer.first[j, k] * outlooks[i, k]
            first[j] = max(value, 0.0)
        for j in range(len(second)):
            value = scorer.second_bias[j]
            for k in range(len(first)):
                value += scorer.second[j, k] * first[k]
            second[j] = max(value, 0.0)
        for j in range(len(second)):
            score += scorer.last[j] * second[j]
        scores[i] = score
        if score > scores[best]:
            best = i
    return best
