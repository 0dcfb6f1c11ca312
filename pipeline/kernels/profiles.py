"""Profiles of masks: how many cells are set in each row and in each column (``pipeline.stages.dedupe`` has the proof).

They tell of most pairs of plans, at a thousandth of the cells, that they differ by too much wherever one is laid.
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


class Profiles(NamedTuple):
    """A mask's sums: ``rows`` (rows,) and ``cols`` (cols,)."""

    rows: Sums
    cols: Sums


@njit(cache=True, nogil=True)
def row_sums(mask: Cells) -> Sums:
    """Return how many cells of each row are set."""
    sums = np.zeros(mask.shape[0], np.int32)
    for row in range(mask.shape[0]):
        for cell in mask[row]:
            sums[row] += cell
    return sums


@njit(cache=True, nogil=True)
def col_sums(mask: Cells) -> Sums:
    """Return how many cells of each column are set."""
    sums = np.zeros(mask.shape[1], np.int32)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            sums[col] += mask[row, col]
    return sums


@njit(cache=True, nogil=True)
def profiles_of(mask: Cells) -> Profiles:
    """Return a mask's profiles."""
    return Profiles(row_sums(mask), col_sums(mask))


@njit(cache=True, nogil=True)
def offsets(size: int, size_: int, shift: int) -> Offsets:
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
def common(sums: Sums, sums_: Sums, at: int) -> int:
    """Return the most cells that two masks can share whose sums are these, the second laid at ``at``."""
    here, there = sums[max(at, 0) : at + len(sums_)], sums_[max(-at, 0) :]
    shared = 0
    for i in range(min(len(here), len(there))):
        shared += min(here[i], there[i])
    return shared


@njit(cache=True, nogil=True)
def _most_common(sums: Sums, sums_: Sums, shift: int) -> int:
    """Return the most cells that two masks can share whose sums are these, wherever the second is laid."""
    most = 0
    for at in offsets(len(sums), len(sums_), shift):
        most = max(most, common(sums, sums_, at))
    return most


@njit(cache=True, nogil=True)
def may_be_near(one: Profiles, other: Profiles, limit: float, shift: int, symmetries: int) -> bool:
    """Tell whether two masks may differ by no more than the limit under one of the symmetries, wherever one is laid.

    The eight symmetries lay the other's rows or columns on the rows, forwards or backwards, and so on the columns: that
    makes four pairs of sums each way, and each is looked at once.
    """
    areas = one.rows.sum() + other.rows.sum()
    most = math.floor(limit * max(one.rows.sum(), other.rows.sum()))
    least = (areas - most + 1) // 2  # |A xor B| = |A| + |B| - 2 |A and B|
    for swap in range(2 if symmetries > 1 else 1):
        downs, rights = (other.cols, other.rows) if swap else (other.rows, other.cols)
        shared = _most_common(one.rows, downs, shift)
        if shared < least and symmetries > 1:
            shared = _most_common(one.rows, downs[::-1].copy(), shift)
        if shared < least:
            continue
        shared = _most_common(one.cols, rights, shift)
        if shared < least and symmetries > 1:
            shared = _most_common(one.cols, rights[::-1].copy(), shift)
        if shared >= least:
            return True
    return False
