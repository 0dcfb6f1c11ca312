"""Compare the masks of two plans in NumPy, obviously: twins of the compiled loops of ``analysis.kernels.masks``."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.analysis.similarity import (
    PIXELS_PER_METRE,
    SHIFT_PX,
    SYMMETRIES,
    comparison_frame,
    crop_mask,
    space_with_furniture,
)
from houseexpo.grids.raster import Mask, Space, fill_cells

_BINS, _BIN_PX = 64, 8


class MaskDifference(NamedTuple):
    """The difference of two masks, and the symmetry that maps the second onto the first."""

    difference: float
    symmetry: str


def comparison_mask(space: Space, pixels_per_metre: float = PIXELS_PER_METRE) -> Mask:
    """Rasterise a plan or polygon so that rotating or mirroring it does the same to its mask, which is cropped.

    The grid is centred on the bounds, has an even number of cells on each axis and is finer than requested by 1 in
    10,000. Therefore no wall on the 1 cm grid runs through cell centres, where one side would have to be preferred.
    """
    space = space_with_furniture(space)
    frame = comparison_frame(space, pixels_per_metre)
    mask = np.zeros(frame.shape, dtype=bool)
    fill_cells(mask, space, frame, True)
    return crop_mask(mask)


def apply_symmetry(mask: Mask, symmetry: str) -> Mask:
    """Return the mask under one of ``SYMMETRIES``."""
    swap, flip_rows, flip_cols = SYMMETRIES[symmetry]
    turned = mask.T if swap else mask
    return turned[:: -1 if flip_rows else 1, :: -1 if flip_cols else 1]


def compare_masks(one: Mask, other: Mask, limit: float = math.inf) -> MaskDifference | None:
    """Return the exact difference of two cropped masks, or None if it exceeds ``limit``.

    Exchanging the masks gives the same difference and the inverse symmetry. Positions whose row or column sums alone
    differ by more than the best difference so far are skipped.
    """
    sizes = int(one.sum()), int(other.sum())
    areas, larger = sum(sizes), max(sizes)
    if not larger:
        return None
    best = math.floor(limit * larger) + 1 if math.isfinite(limit) else areas + 1
    found = None
    sums, sums_ = (one.sum(axis=1), one.sum(axis=0)), (other.sum(axis=1), other.sum(axis=0))
    for symmetry, (swap, flip_rows, flip_cols) in SYMMETRIES.items():
        rows, cols = sums_[::-1] if swap else sums_
        downs = _offsets(sums[0], rows[:: -1 if flip_rows else 1], areas)
        rights = _offsets(sums[1], cols[:: -1 if flip_cols else 1], areas)
        moved = apply_symmetry(other, symmetry)
        for (down, bound), (right, bound_) in product(downs, rights):
            if max(bound, bound_) < best:
                here, there = (
                    _covered_window(one, down, right, moved.shape),
                    _covered_window(moved, -down, -right, one.shape),
                )
                differ = areas - 2 * int(np.count_nonzero(here & there))
                if differ < best:
                    best, found = differ, MaskDifference(differ / larger, symmetry)
    return found


def mask_fingerprint(mask: Mask) -> npt.NDArray[np.int32]:
    """Return numbers (1 + 2 * 64,) that do not change under the eight symmetries and shifts.

    They are the area, the row sums and the column sums. The sums are sorted and added up in bins of 8; the greater of
    the two profiles comes first. ``difference_lower_bound`` derives a bound from them.
    """
    profiles = [_pool(np.sort(mask.sum(axis=axis))[::-1]) for axis in (1, 0)]
    profiles.sort(key=lambda sums: sums.tolist(), reverse=True)
    return np.concatenate([[mask.sum()], *profiles]).astype(np.int32)


def _pool(profile: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    padded = np.zeros(max(len(profile), _BINS * _BIN_PX), dtype=np.int64)
    padded[: len(profile)] = profile
    starts = np.arange(_BINS) * _BIN_PX
    sums: npt.NDArray[np.int64] = np.add.reduceat(padded, starts)  # the last bin takes the rest
    return sums


def _offsets(sums: npt.NDArray[np.int64], sums_: npt.NDArray[np.int64], areas: int) -> list[tuple[int, int]]:
    """Return the possible offsets of the second profile on the first, each with a lower bound of the difference."""
    size, size_ = len(sums), len(sums_)
    ends = sorted({end + by for end in (0, size - size_) for by in range(-SHIFT_PX, SHIFT_PX + 1)}, key=abs)
    common = [int(np.minimum(_slice_from(sums, at, size_), _slice_from(sums_, -at, size)).sum()) for at in ends]
    return [(at, areas - 2 * shared) for at, shared in zip(ends, common, strict=True)]


def _slice_from(values: npt.NDArray[np.int64], start: int, length: int) -> npt.NDArray[np.int64]:
    """Return the part of ``values`` that an array of this length covers if it begins at ``start``."""
    return values[max(start, 0) : max(start + length, 0)]


def _covered_window(mask: Mask, down: int, right: int, shape: tuple[int, ...]) -> Mask:
    """Return the part of ``mask`` that a mask of this shape covers if it is placed at (down, right)."""
    return mask[max(down, 0) : max(down + shape[0], 0), max(right, 0) : max(right + shape[1], 0)]


def blob(rng: np.random.Generator, rows: int, cols: int) -> Mask:
    """Return a room with bites taken out of it."""
    mask = np.ones((rows, cols), dtype=bool)
    for _ in range(5):
        r, c = rng.integers(0, rows), rng.integers(0, cols)
        mask[r : r + 6, c : c + 9] = False
    return crop_mask(mask)
