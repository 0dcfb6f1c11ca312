"""Prints of masks, which rule out nearly all pairs of plans (``pipeline.stages.dedupe`` has the proof).

A print is (129,) int32: a mask's area and its two profiles, sorted and pooled. The twins in
``houseexpo.analysis.similarity`` say the same in NumPy.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Sums = npt.NDArray[np.int32]
Prints = npt.NDArray[np.int32]
Areas = npt.NDArray[np.int32]

BINS, BIN_PX = 64, 8
GROUPS = 8  # of bins, which are compared first: those of a print are one line of a processor's cache


@njit(cache=True, nogil=True)
def pooled(sums: Sums) -> npt.NDArray[np.int64]:
    """Return sums in falling order, added up in 64 bins of 8; the last takes the rest."""
    ordered = np.sort(sums)[::-1]
    bins = np.zeros(BINS, np.int64)
    for i in range(len(ordered)):
        bins[min(i // BIN_PX, BINS - 1)] += ordered[i]
    return bins


@njit(cache=True, nogil=True)
def _are_near(one: Prints, other: Prints, at_rows: int, at_cols: int, limit: float) -> bool:
    """Tell whether rows and columns of one print are within the limit of what stands there in the other."""
    rows_apart, cols_apart = 0, 0
    for i in range(BINS):
        rows_apart += abs(one[1 + i] - other[at_rows + i])
        cols_apart += abs(one[1 + BINS + i] - other[at_cols + i])
    return max(rows_apart, cols_apart) <= limit


@njit(cache=True, nogil=True)
def grouped(prints: Prints) -> Prints:
    """Return (n, 2 * GROUPS) int32: both profiles of each print, neighbouring bins added up."""
    groups = np.zeros((len(prints), 2 * GROUPS), np.int32)
    for i in range(len(prints)):
        for k in range(2 * BINS):
            groups[i, k * GROUPS // BINS] += prints[i, 1 + k]
    return groups


@njit(cache=True, nogil=True)
def near_prints(
    prints: Prints, areas: Areas, groups: Prints, fresh: npt.NDArray[np.bool_], threshold: float, first: int, last: int
) -> npt.NDArray[np.int64]:
    """Return the pairs (k, 2) of rows, the lower one within [first, last), that their prints do not rule out.

    ``prints`` (n, 129) are in the order of their ``areas`` (n,), and ``groups`` is ``grouped`` of them; of each pair at
    least one is ``fresh``.
    """
    found = np.empty((1024, 2), np.int64)
    count = 0
    rows, cols = 1, 1 + BINS
    for i in range(first, last):
        one = groups[i]
        for j in range(i + 1, len(areas)):
            limit = threshold * areas[j]
            if areas[j] - areas[i] > limit:
                break
            other = groups[j]
            rows_apart, cols_apart, rows_cols, cols_rows = 0, 0, 0, 0
            for k in range(GROUPS):
                rows_apart += abs(one[k] - other[k])
                cols_apart += abs(one[GROUPS + k] - other[GROUPS + k])
                rows_cols += abs(one[k] - other[GROUPS + k])
                cols_rows += abs(one[GROUPS + k] - other[k])
            as_is, crossed = max(rows_apart, cols_apart) <= limit, max(rows_cols, cols_rows) <= limit
            if not (as_is or crossed) or not (fresh[i] or fresh[j]):
                continue
            if (as_is and _are_near(prints[i], prints[j], rows, cols, limit)) or (
                crossed and _are_near(prints[i], prints[j], cols, rows, limit)
            ):
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]
