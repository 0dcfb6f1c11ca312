"""Masks of plans compared cell by cell (``pipeline.stages.dedupe`` has the proof of what is passed over).

Masks are (rows, cols) uint8 of 0 and 1, cropped. The twins in ``houseexpo.grids.raster`` and
``houseexpo.analysis.similarity`` say the same in NumPy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from pipeline.kernels.profiles import Cells, Profiles, Sums, common, offsets, profiles_of

Words = npt.NDArray[np.uint64]


class Shape(NamedTuple):
    """A mask in an eighth of its memory."""

    words: Words
    """(rows, cols // 64 + 1): ``packed``."""
    profiles: Profiles


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
def packed(mask: Cells) -> Words:
    """Return the mask (rows, cols) as rows of words of 64 cells, cols // 64 + 1 of them."""
    words = np.zeros((mask.shape[0], mask.shape[1] // 64 + 1), np.uint64)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            words[row, col >> 6] |= np.uint64(mask[row, col]) << np.uint64(col & 63)
    return words


@njit(cache=True, nogil=True)
def laid(words: Words, right: int, cols: int) -> Words:
    """Return the words of a mask laid ``right`` columns to the right on ``cols`` columns; what is off is cut."""
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
def unpacked(words: Words, cols: int) -> Cells:
    """Return the mask (rows, cols) of its words."""
    mask = np.empty((len(words), cols), np.uint8)
    for row in range(len(words)):
        for col in range(cols):
            mask[row, col] = (words[row, col >> 6] >> np.uint64(col & 63)) & np.uint64(1)
    return mask


def shape_of(mask: Cells) -> Shape:
    """Return a mask as ``least_difference`` takes it."""
    return Shape(packed(mask), profiles_of(mask))


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
def least_difference(one: Shape, other: Shape, limit: float, shift: int, symmetries: int) -> tuple[int, int]:
    """Return the least |A xor B| in cells within the limit, and the symmetry's number; (-1, -1) where there is none."""
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
        downs, rights = offsets(len(rows), len(down_sums), shift), offsets(len(cols), len(right_sums), shift)
        tops = np.array([common(rows, down_sums, at) for at in downs])
        sides = np.array([common(cols, right_sums, at) for at in rights])
        if areas - 2 * min(tops.max(), sides.max()) >= best:
            continue
        if symmetry == 0:
            moved = other.words
        else:
            if not len(cells):
                cells = unpacked(other.words, len(cols_))
            moved = packed(turned(cells, symmetry))
        for j in np.argsort(-sides):
            if areas - 2 * min(tops.max(), sides[j]) >= best:
                break
            words = laid(moved, rights[j], len(cols))
            for i in np.argsort(-tops):
                if areas - 2 * tops[i] >= best:
                    break
                shared = _shared(one.words, words, downs[i], rows, down_sums, tops[i], (areas - best) // 2 + 1)
                if shared >= 0:
                    best, found = areas - 2 * shared, symmetry
    return (best, found) if found >= 0 else (-1, -1)
