"""Decide whether two plans are the same house, by their pixel difference under symmetries and a fast bound of it.

The difference of two masks A and B is |A xor B| / max(|A|, |B|). It is minimised over the eight symmetries of the
square, and over positions in which the cropped masks are aligned at either end of each axis, shifted by up to two
cells.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from itertools import product
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import Mask, Space, fill, rings_of
from houseexpo.plan.model import PlanData

PIXELS_PER_METRE: Final = 20.0
THRESHOLD: Final = 0.02

SYMMETRIES: Final[Mapping[str, tuple[bool, bool, bool]]] = {
    # plan terms (x right, y up, angles counter-clockwise): swap the axes, then flip y (rows), then flip x (columns)
    "identity": (False, False, False),
    "mirror_x": (False, False, True),
    "mirror_y": (False, True, False),
    "rotate_180": (False, True, True),
    "transpose": (True, False, False),
    "rotate_90": (True, False, True),
    "rotate_270": (True, True, False),
    "antitranspose": (True, True, True),
}

SHIFT_PX: Final = 2
"""The largest shift of two cropped masks from being aligned, in cells."""

_EPS: Final = 1e-4
_BINS: Final = 64
_BIN_PX: Final = 8


class Match(NamedTuple):
    """The difference of two masks, and the symmetry that maps the second onto the first."""

    difference: float
    symmetry: str


class Duplicate(NamedTuple):
    """A plan that is a duplicate of one that is kept; ``symmetry`` maps it onto the kept one."""

    id: str
    kept_id: str
    difference: float
    symmetry: str


def comparison_mask(space: Space, pixels_per_metre: float = PIXELS_PER_METRE) -> Mask:
    """Rasterise a plan or polygon so that rotating or mirroring it does the same to its mask, which is cropped.

    The grid is centred on the bounds, has an even number of cells on each axis and is finer than requested by 1 in
    10,000. Therefore no wall on the 1 cm grid runs through cell centres, where one side would have to be preferred.
    """
    space = compared_space(space)
    frame = comparison_frame(space, pixels_per_metre)
    mask = np.zeros(frame.shape, dtype=bool)
    fill(mask, space, frame, True)
    return crop(mask)


def compared_space(space: Space) -> Space:
    """Return the area that is compared: the free space and that under furniture, which does not change the house."""
    return space.floor if isinstance(space, PlanData) and space.objects else space


def comparison_frame(space: Space, pixels_per_metre: float = PIXELS_PER_METRE) -> GridFrame:
    """Return the grid of ``comparison_mask``."""
    corners = np.concatenate(rings_of(space))
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = pixels_per_metre * (1 + _EPS)
    cols, rows = (2 * math.ceil(size * scale / 2) for size in (high - low).tolist())
    x, y = ((low + high) / 2 - np.array([cols, rows]) / (2 * scale)).tolist()
    return GridFrame((x, y), scale, (max(rows, 2), max(cols, 2)))


def crop(mask: Mask) -> Mask:
    """Return the smallest part of the mask with all True cells, of shape (0, 0) if there are none."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return np.zeros((0, 0), dtype=bool)
    return mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]


def transformed(mask: Mask, symmetry: str) -> Mask:
    """Return the mask under one of ``SYMMETRIES``."""
    swap, flip_rows, flip_cols = SYMMETRIES[symmetry]
    turned = mask.T if swap else mask
    return turned[:: -1 if flip_rows else 1, :: -1 if flip_cols else 1]


def compare(one: Mask, other: Mask, limit: float = math.inf) -> Match | None:
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
        moved = transformed(other, symmetry)
        for (down, bound), (right, bound_) in product(downs, rights):
            if max(bound, bound_) < best:
                here, there = _window(one, down, right, moved.shape), _window(moved, -down, -right, one.shape)
                differ = areas - 2 * int(np.count_nonzero(here & there))
                if differ < best:
                    best, found = differ, Match(differ / larger, symmetry)
    return found


def fingerprint(mask: Mask) -> npt.NDArray[np.int32]:
    """Return numbers (1 + 2 * 64,) that do not change under the eight symmetries and shifts.

    They are the area, the row sums and the column sums. The sums are sorted and added up in bins of 8; the greater of
    the two profiles comes first. ``lower_bound`` derives a bound from them.
    """
    profiles = [_pooled(np.sort(mask.sum(axis=axis))[::-1]) for axis in (1, 0)]
    profiles.sort(key=lambda sums: sums.tolist(), reverse=True)
    return np.concatenate([[mask.sum()], *profiles]).astype(np.int32)


def lower_bound(print_: npt.NDArray[np.int32], prints: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return a lower bound of |A xor B|, in cells, of a fingerprint and others (n, 129), for any symmetry and shift.

    The bound holds because sums differ by no more than the masks do, and sorting and binning can only reduce the
    difference of two profiles. Therefore no pair is missed.
    """
    area, rows, cols = print_[0], print_[1 : 1 + _BINS], print_[1 + _BINS :]
    rows_, cols_ = prints[:, 1 : 1 + _BINS], prints[:, 1 + _BINS :]
    straight = np.maximum(_l1(rows, rows_), _l1(cols, cols_))
    swapped = np.maximum(_l1(rows, cols_), _l1(cols, rows_))
    bound: npt.NDArray[np.int32] = np.maximum(np.abs(prints[:, 0] - area), np.minimum(straight, swapped))
    return bound


def find_duplicates(
    shapes: Mapping[str, Mask] | Iterable[PlanData],
    threshold: float = THRESHOLD,
    pixels_per_metre: float = PIXELS_PER_METRE,
) -> list[Duplicate]:
    """Find plans that are the same house, up to rotations by 90 degrees and mirroring.

    Plans are taken in the order of their ids. A plan whose difference from a kept one is at most ``threshold`` is a
    duplicate of the first such plan; otherwise it is kept.

    Parameters
    ----------
    shapes
        Plans, or masks by id.
    threshold
        Largest difference of duplicates, as a share of the larger plan's area (0 to 1).
    pixels_per_metre
        Resolution of the comparison.

    Returns
    -------
    Duplicates, sorted by id.
    """
    spaces: Mapping[str, Mask | PlanData] = shapes if isinstance(shapes, Mapping) else {p.id: p for p in shapes}
    ids = sorted(spaces)

    @lru_cache(maxsize=1024)  # candidates are rasterised again: 34,000 masks would take 3 GB
    def mask_of(i: int) -> Mask:
        space = spaces[ids[i]]
        return comparison_mask(space, pixels_per_metre) if isinstance(space, PlanData) else crop(space)

    prints = [fingerprint(mask_of(i)) for i in range(len(ids))]
    kept_by: dict[int, tuple[int, Match]] = {}
    for i, earlier in candidates(prints, threshold):
        for j in earlier:
            match = None if j in kept_by else compare(mask_of(j), mask_of(i), threshold)
            if match is not None:
                kept_by[i] = j, match
                break
    return [Duplicate(ids[i], ids[j], round(m.difference, 6), m.symmetry) for i, (j, m) in sorted(kept_by.items())]


def candidates(prints: list[npt.NDArray[np.int32]], threshold: float) -> Iterator[tuple[int, list[int]]]:
    """Yield each index with the earlier ones, in order, that the fingerprints cannot rule out as duplicates."""
    if not prints:
        return
    table = np.stack(prints)
    by_area = np.argsort(table[:, 0], kind="stable")
    ordered = table[by_area]
    areas = ordered[:, 0]
    near: list[list[int]] = [[] for _ in prints]
    for k in range(len(ordered)):
        last = np.searchsorted(areas, areas[k] / max(1 - threshold, 1e-9) + 1, side="right")
        bounds = lower_bound(ordered[k], ordered[k + 1 : last])
        for other in by_area[k + 1 : last][bounds <= threshold * areas[k + 1 : last]].tolist():
            here = int(by_area[k])
            near[max(here, other)].append(min(here, other))
    for i, earlier in enumerate(near):
        yield i, sorted(earlier)


def _l1(sums: npt.NDArray[np.int32], table: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    distance: npt.NDArray[np.int32] = np.abs(table - sums).sum(axis=1, dtype=np.int32)
    return distance


def _pooled(profile: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    padded = np.zeros(max(len(profile), _BINS * _BIN_PX), dtype=np.int64)
    padded[: len(profile)] = profile
    starts = np.arange(_BINS) * _BIN_PX
    sums: npt.NDArray[np.int64] = np.add.reduceat(padded, starts)  # the last bin takes the rest
    return sums


def _offsets(sums: npt.NDArray[np.int64], sums_: npt.NDArray[np.int64], areas: int) -> list[tuple[int, int]]:
    """Return the possible offsets of the second profile on the first, each with a lower bound of the difference."""
    size, size_ = len(sums), len(sums_)
    ends = sorted({end + by for end in (0, size - size_) for by in range(-SHIFT_PX, SHIFT_PX + 1)}, key=abs)
    common = [int(np.minimum(_from(sums, at, size_), _from(sums_, -at, size)).sum()) for at in ends]
    return [(at, areas - 2 * shared) for at, shared in zip(ends, common, strict=True)]


def _from(values: npt.NDArray[np.int64], start: int, length: int) -> npt.NDArray[np.int64]:
    """Return the part of ``values`` that an array of this length covers if it begins at ``start``."""
    return values[max(start, 0) : max(start + length, 0)]


def _window(mask: Mask, down: int, right: int, shape: tuple[int, ...]) -> Mask:
    """Return the part of ``mask`` that a mask of this shape covers if it is placed at (down, right)."""
    return mask[max(down, 0) : max(down + shape[0], 0), max(right, 0) : max(right + shape[1], 0)]
