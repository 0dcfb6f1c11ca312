"""Compare the masks of two plans in compiled loops: least difference in cells under symmetries and shifts, and bounds.

``houseexpo.analysis.similarity`` calls it and proves what it rules out.

A mask is (rows, cols) uint8 of 0 and 1, cropped to its cells. Its *profiles* are the sums of its rows and of its
columns. A *fingerprint* is (129,) int32: the area and both profiles, each sorted and pooled in 64 bins. The tests have
a twin of each function in NumPy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

Cells = npt.NDArray[np.uint8]
Sums = npt.NDArray[np.int32]
Offsets = npt.NDArray[np.int64]
Fingerprints = npt.NDArray[np.int32]
Words = npt.NDArray[np.uint64]

# Compiled code that is kept knows when files of this folder change, and no others: hence these three stand here again.
BINS, BIN_PX = 64, 8  # as in ``houseexpo.analysis.similarity``
_TIE = 1e-7  # ``houseexpo.tolerances.TIE_PX``
GROUPS = 8  # of bins, which are compared first: those of one fingerprint fit in a line of a processor's cache


class MaskProfiles(NamedTuple):
    """The number of cells in each row and in each column of a mask: ``rows`` (rows,) and ``cols`` (cols,)."""

    rows: Sums
    cols: Sums


class PackedMask(NamedTuple):
    """A mask as bits, with its profiles: an eighth of its memory."""

    words: Words
    """(rows, cols // 64 + 1): ``pack_words``."""
    profiles: MaskProfiles


@njit(cache=True, nogil=True)
def fill_rings(start: npt.NDArray[np.float64], end: npt.NDArray[np.float64], rows: int, cols: int) -> Cells:
    """Return the mask of the cells whose centres lie inside rings (even-odd).

    ``start`` and ``end`` (n, 2) are the ends of the edges in pixels, the left one first.
    """
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
    """Return the number of cells in each row."""
    sums = np.zeros(mask.shape[0], np.int32)
    for row in range(mask.shape[0]):
        for cell in mask[row]:
            sums[row] += cell
    return sums


@njit(cache=True, nogil=True)
def col_sums(mask: Cells) -> Sums:
    """Return the number of cells in each column."""
    sums = np.zeros(mask.shape[1], np.int32)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            sums[col] += mask[row, col]
    return sums


@njit(cache=True, nogil=True)
def mask_profiles(mask: Cells) -> MaskProfiles:
    """Return the profiles of a mask."""
    return MaskProfiles(row_sums(mask), col_sums(mask))


@njit(cache=True, nogil=True)
def profile_offsets(size: int, size_: int, shift: int) -> Offsets:
    """Return the offsets of a profile of ``size_`` on one of ``size``: up to ``shift`` from either end, each once."""
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
def max_shared_cells(sums: Sums, sums_: Sums, at: int) -> int:
    """Return an upper bound of the cells that two masks share, from their sums, with the second one at ``at``."""
    here, there = sums[max(at, 0) : at + len(sums_)], sums_[max(-at, 0) :]
    shared = 0
    for i in range(min(len(here), len(there))):
        shared += min(here[i], there[i])
    return shared


@njit(cache=True, nogil=True)
def _max_shared_anywhere(sums: Sums, sums_: Sums, shift: int) -> int:
    """Return an upper bound of the cells that two masks share, from their sums, at any offset."""
    most = 0
    for at in profile_offsets(len(sums), len(sums_), shift):
        most = max(most, max_shared_cells(sums, sums_, at))
    return most


@njit(cache=True, nogil=True)
def profiles_may_match(one: MaskProfiles, other: MaskProfiles, limit: float, shift: int, symmetries: int) -> bool:
    """Return whether the profiles of two masks allow a difference within the limit, for any symmetry and offset.

    The eight symmetries compare the rows of one mask with the rows or the columns of the other, forwards or backwards.
    Each of these pairs of sums is compared once.
    """
    areas = one.rows.sum() + other.rows.sum()
    most = math.floor(limit * max(one.rows.sum(), other.rows.sum()))
    least = (areas - most + 1) // 2  # |A xor B| = |A| + |B| - 2 |A and B|
    for swap in range(2 if symmetries > 1 else 1):
        downs, rights = (other.cols, other.rows) if swap else (other.rows, other.cols)
        shared = _max_shared_anywhere(one.rows, downs, shift)
        if shared < least and symmetries > 1:
            shared = _max_shared_anywhere(one.rows, downs[::-1].copy(), shift)
        if shared < least:
            continue
        shared = _max_shared_anywhere(one.cols, rights, shift)
        if shared < least and symmetries > 1:
            shared = _max_shared_anywhere(one.cols, rights[::-1].copy(), shift)
        if shared >= least:
            return True
    return False


@njit(cache=True, nogil=True)
def pool_sums(sums: Sums) -> npt.NDArray[np.int64]:
    """Return the sums in descending order, added up in 64 bins of 8; the last bin takes the rest."""
    ordered = np.sort(sums)[::-1]
    bins = np.zeros(BINS, np.int64)
    for i in range(len(ordered)):
        bins[min(i // BIN_PX, BINS - 1)] += ordered[i]
    return bins


@njit(cache=True, nogil=True)
def _are_near(one: Fingerprints, other: Fingerprints, at_rows: int, at_cols: int, limit: float) -> bool:
    """Return whether both profiles of one fingerprint are within the limit of those at two places of the other."""
    rows_apart, cols_apart = 0, 0
    for i in range(BINS):
        rows_apart += abs(one[1 + i] - other[at_rows + i])
        cols_apart += abs(one[1 + BINS + i] - other[at_cols + i])
    return max(rows_apart, cols_apart) <= limit


@njit(cache=True, nogil=True)
def pool_fingerprints(fingerprints: Fingerprints) -> Fingerprints:
    """Return (n, 2 * GROUPS) int32: both profiles of each fingerprint, with neighbouring bins added up."""
    groups = np.zeros((len(fingerprints), 2 * GROUPS), np.int32)
    for i in range(len(fingerprints)):
        for k in range(2 * BINS):
            groups[i, k * GROUPS // BINS] += fingerprints[i, 1 + k]
    return groups


@njit(cache=True, nogil=True)
def near_fingerprint_pairs(
    fingerprints: Fingerprints,
    areas: Sums,
    groups: Fingerprints,
    fresh: npt.NDArray[np.bool_],
    threshold: float,
    first: int,
    last: int,
) -> npt.NDArray[np.int64]:
    """Return the pairs (k, 2) of rows, the lower one within [first, last), that fingerprints do not rule out.

    ``fingerprints`` (n, 129) are sorted by their ``areas`` (n,), and ``groups`` is ``pool_fingerprints`` of them. At
    least one of each pair is ``fresh``.
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
            if (as_is and _are_near(fingerprints[i], fingerprints[j], rows, cols, limit)) or (
                crossed and _are_near(fingerprints[i], fingerprints[j], cols, rows, limit)
            ):
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]


@njit(cache=True, nogil=True)
def transform_mask(mask: Cells, symmetry: int) -> Cells:
    """Return the mask under a symmetry, given by its number in ``analysis.similarity.SYMMETRIES``."""
    swap, flip_rows, flip_cols = symmetry & 4, symmetry & 2, symmetry & 1
    rows, cols = (mask.shape[1], mask.shape[0]) if swap else mask.shape
    result = np.empty((rows, cols), np.uint8)
    for row in range(rows):
        for col in range(cols):
            r, c = rows - 1 - row if flip_rows else row, cols - 1 - col if flip_cols else col
            result[row, col] = mask[c, r] if swap else mask[r, c]
    return result


@njit(cache=True, nogil=True)
def _count_ones(word: np.uint64) -> np.uint64:
    """Return the number of bits that are set in a word, added up in pairs, fours, eights, and over all bytes."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    word += word >> np.uint64(8)
    word += word >> np.uint64(16)
    word += word >> np.uint64(32)
    return word & np.uint64(127)


@njit(cache=True, nogil=True)
def pack_words(mask: Cells) -> Words:
    """Return a mask (rows, cols) as words of 64 cells, (rows, cols // 64 + 1)."""
    words = np.zeros((mask.shape[0], mask.shape[1] // 64 + 1), np.uint64)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            words[row, col >> 6] |= np.uint64(mask[row, col]) << np.uint64(col & 63)
    return words


@njit(cache=True, nogil=True)
def shift_words(words: Words, right: int, cols: int) -> Words:
    """Return the words of a mask, shifted to the right by ``right`` and cut off at 0 and ``cols`` columns."""
    result = np.zeros((len(words), cols // 64 + 1), np.uint64)
    off = np.uint64(-right & 63)
    for word in range(result.shape[1]):
        first = (64 * word - right) >> 6
        keep = ~np.uint64(0) if word < cols // 64 else (np.uint64(1) << np.uint64(cols & 63)) - np.uint64(1)
        for row in range(len(words)):
            cells = np.uint64(0)
            if 0 <= first < words.shape[1]:
                cells = words[row, first] >> off
            if off and 0 <= first + 1 < words.shape[1]:
                cells |= words[row, first + 1] << (np.uint64(64) - off)
            result[row, word] = cells & keep
    return result


@njit(cache=True, nogil=True)
def unpack_words(words: Words, cols: int) -> Cells:
    """Return the mask (rows, cols) that these words hold."""
    mask = np.empty((len(words), cols), np.uint8)
    for row in range(len(words)):
        for col in range(cols):
            mask[row, col] = (words[row, col >> 6] >> np.uint64(col & 63)) & np.uint64(1)
    return mask


def pack_mask(mask: Cells) -> PackedMask:
    """Return a mask in the form that ``least_difference`` takes."""
    return PackedMask(pack_words(mask), mask_profiles(mask))


@njit(cache=True, nogil=True)
def _count_shared(one: Words, other: Words, down: int, sums: Sums, sums_: Sums, most: int, least: int) -> int:
    """Return the number of cells that two masks share, given an upper bound; -1 once ``least`` cannot be reached."""
    for row in range(max(down, 0), min(down + len(other), len(one))):
        here = np.uint64(0)
        for word in range(one.shape[1]):
            here += _count_ones(one[row, word] & other[row - down, word])
        most -= min(sums[row], sums_[row - down]) - np.int64(here)
        if most < least:
            return -1
    return most


@njit(cache=True, nogil=True)
def least_difference(one: PackedMask, other: PackedMask, limit: float, shift: int, symmetries: int) -> tuple[int, int]:
    """Return the least |A xor B| in cells and the number of its symmetry; (-1, -1) if it exceeds the limit."""
    (rows, cols), (rows_, cols_) = one.profiles, other.profiles
    areas = rows.sum() + rows_.sum()
    best, found = math.floor(limit * max(rows.sum(), rows_.sum())) + 1, -1
    cells = np.empty((0, 0), np.uint8)  # the other's, once they are needed
    for symmetry in range(symmetries):
        down_sums, right_sums = (cols_, rows_) if symmetry & 4 else (rows_, cols_)
        if symmetry & 2:
            down_sums = down_sums[::-1].copy()
        if symmetry & 1:
            right_sums = right_sums[::-1].copy()
        downs, rights = (
            profile_offsets(len(rows), len(down_sums), shift),
            profile_offsets(len(cols), len(right_sums), shift),
        )
        tops = np.array([max_shared_cells(rows, down_sums, at) for at in downs])
        sides = np.array([max_shared_cells(cols, right_sums, at) for at in rights])
        if areas - 2 * min(tops.max(), sides.max()) >= best:
            continue
        if symmetry == 0:
            moved = other.words
        else:
            if not len(cells):
                cells = unpack_words(other.words, len(cols_))
            moved = pack_words(transform_mask(cells, symmetry))
        for j in np.argsort(-sides):
            if areas - 2 * min(tops.max(), sides[j]) >= best:
                break
            words = shift_words(moved, rights[j], len(cols))
            for i in np.argsort(-tops):
                if areas - 2 * tops[i] >= best:
                    break
                shared = _count_shared(one.words, words, downs[i], rows, down_sums, tops[i], (areas - best) // 2 + 1)
                if shared >= 0:
                    best, found = areas - 2 * shared, symmetry
    return (best, found) if found >= 0 else (-1, -1)
