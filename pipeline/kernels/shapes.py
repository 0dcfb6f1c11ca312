"""Masks of plans compared cell by cell, and what rules pairs out before (``pipeline.stages.dedupe`` has the proof).

Masks are (rows, cols) uint8 of 0 and 1, cropped. The twins in ``houseexpo.grids.raster`` and
``houseexpo.analysis.similarity`` say the same in NumPy.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

Cells = npt.NDArray[np.uint8]
Sums = npt.NDArray[np.int64]
Words = npt.NDArray[np.uint64]
Prints = npt.NDArray[np.int32]
Areas = npt.NDArray[np.int32]

BINS, BIN_PX = 64, 8
GROUPS = 8  # of bins, which are compared first: those of a print are one line of a processor's cache
SYMMETRIES = 8
_TIE = 1e-7  # as houseexpo.grids.raster has it


@njit(cache=True, nogil=True)
def filled(start: npt.NDArray[np.float64], end: npt.NDArray[np.float64], rows: int, cols: int) -> Cells:
    """Return which cells' centres lie inside rings (even-odd); ``start``, ``end`` (n, 2) pixels, the left one first."""
    mask = np.zeros((rows, cols), np.uint8)
    for edge in range(len(start)):
        first = min(max(math.ceil(start[edge, 0] - 0.5 - _TIE), 0), cols)
        last = min(max(math.ceil(end[edge, 0] - 0.5 - _TIE), 0), cols)
        if first >= last:
            continue
        slope = (end[edge, 1] - start[edge, 1]) / (end[edge, 0] - start[edge, 0])
        for col in range(first, last):
            crossing = start[edge, 1] + (col + 0.5 - start[edge, 0]) * slope
            row = max(math.ceil(crossing - 0.5 - _TIE), 0)
            if row < rows:
                mask[row, col] ^= 1
    for row in range(1, rows):
        for col in range(cols):
            mask[row, col] ^= mask[row - 1, col]
    return mask


@njit(cache=True, nogil=True)
def row_sums(mask: Cells) -> Sums:
    """Return how many cells of each row are set."""
    sums = np.zeros(mask.shape[0], np.int64)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            sums[row] += mask[row, col]
    return sums


@njit(cache=True, nogil=True)
def col_sums(mask: Cells) -> Sums:
    """Return how many cells of each column are set."""
    sums = np.zeros(mask.shape[1], np.int64)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            sums[col] += mask[row, col]
    return sums


@njit(cache=True, nogil=True)
def pooled(sums: Sums) -> Sums:
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


@njit(cache=True, nogil=True)
def turned(mask: Cells, symmetry: int) -> Cells:
    """Return the mask under the symmetry of that number, in the order of ``analysis.similarity.SYMMETRIES``."""
    swap, flip_rows, flip_cols = symmetry & 4, symmetry & 2, symmetry & 1
    rows, cols = (mask.shape[1], mask.shape[0]) if swap else mask.shape
    result = np.empty((rows, cols), np.uint8)
    for row in range(rows):
        for col in range(cols):
            r, c = rows - 1 - row if flip_rows else row, cols - 1 - col if flip_cols else col
            result[row, col] = mask[c, r] if swap else mask[r, c]
    return result


@njit(cache=True, nogil=True)
def offsets(size: int, size_: int, shift: int) -> Sums:
    """Return where a profile of ``size_`` may lie on one of ``size``: near one end or the other, each once."""
    slack = size - size_
    found = np.empty(4 * shift + 2, np.int64)
    count = 0
    for end in (0, slack):
        for by in range(-shift, shift + 1):
            at = end + by
            if end == slack and slack != 0 and abs(at) <= shift:
                continue  # that is near the other end too
            if end == slack and slack == 0 and count > 2 * shift:
                continue
            found[count] = at
            count += 1
    return found[:count]


@njit(cache=True, nogil=True)
def _common(sums: Sums, sums_: Sums, at: int) -> int:
    """Return the most cells that two masks can share whose sums are these, the second laid at ``at``."""
    shared = 0
    for i in range(max(at, 0), min(at + len(sums_), len(sums))):
        shared += min(sums[i], sums_[i - at])
    return shared


@njit(cache=True, nogil=True)
def _ones(word: np.uint64) -> np.uint64:
    """Return how many bits of a word are set: added up in pairs, in fours, in eights, and over all bytes."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    word += word >> np.uint64(8)
    word += word >> np.uint64(16)
    word += word >> np.uint64(32)
    return word & np.uint64(127)


@njit(cache=True, nogil=True)
def packed(mask: Cells, right: int, cols: int) -> Words:
    """Return the mask, laid ``right`` columns to the right on ``cols`` columns, as rows of words of 64 cells."""
    words = np.zeros((mask.shape[0], cols // 64 + 1), np.uint64)
    for row in range(mask.shape[0]):
        for col in range(max(-right, 0), min(mask.shape[1], cols - right)):
            at = col + right
            words[row, at >> 6] |= np.uint64(mask[row, col]) << np.uint64(at & 63)
    return words


@njit(cache=True, nogil=True)
def _shared(one: Words, other: Words, down: int, sums: Sums, sums_: Sums, most: int, least: int) -> int:
    """Return how many cells two masks share, at most ``most``; -1 as soon as they cannot be ``least``."""
    for row in range(max(down, 0), min(down + len(other), len(one))):
        here = np.uint64(0)
        for word in range(one.shape[1]):
            here += _ones(one[row, word] & other[row - down, word])
        most -= min(sums[row], sums_[row - down]) - np.int64(here)
        if most < least:
            return -1
    return most


@njit(cache=True, nogil=True)
def least_difference(one: Cells, other: Cells, limit: float, shift: int, symmetries: int) -> tuple[int, int]:
    """Return the least |A xor B| in cells within the limit, and the symmetry's number; (-1, -1) where there is none."""
    rows, cols, rows_, cols_ = row_sums(one), col_sums(one), row_sums(other), col_sums(other)
    areas = rows.sum() + rows_.sum()
    best, found = math.floor(limit * max(rows.sum(), rows_.sum())) + 1, -1
    still = packed(one, 0, len(cols))
    for symmetry in range(symmetries):
        down_sums, right_sums = (cols_, rows_) if symmetry & 4 else (rows_, cols_)
        if symmetry & 2:
            down_sums = down_sums[::-1].copy()
        if symmetry & 1:
            right_sums = right_sums[::-1].copy()
        downs, rights = offsets(len(rows), len(down_sums), shift), offsets(len(cols), len(right_sums), shift)
        tops = np.array([_common(rows, down_sums, at) for at in downs])
        sides = np.array([_common(cols, right_sums, at) for at in rights])
        if areas - 2 * min(tops.max(), sides.max()) >= best:
            continue
        moved = turned(other, symmetry)
        for j in np.argsort(-sides):
            if areas - 2 * min(tops.max(), sides[j]) >= best:
                break
            words = packed(moved, rights[j], len(cols))
            for i in np.argsort(-tops):
                if areas - 2 * tops[i] >= best:
                    break
                shared = _shared(still, words, downs[i], rows, down_sums, tops[i], (areas - best) // 2 + 1)
                if shared >= 0:
                    best, found = areas - 2 * shared, symmetry
    return (best, found) if found >= 0 else (-1, -1)
