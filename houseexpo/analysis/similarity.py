"""Find plans that show the same house, by the difference of their masks under symmetries and small shifts.

The difference of two masks A and B is |A xor B| / max(|A|, |B|). It is minimised over the eight symmetries of the
square, and over positions in which the cropped masks are aligned at either end of each axis, shifted by up to two
cells. ``find_similar_pairs`` finds all pairs within a threshold among many plans.

``find_similar_pairs`` rules out nearly all pairs without comparing their masks, and none wrongly. Let D = |A xor B| for
A and B in their best position.

1. Areas: ||A| - |B|| <= D, since the areas differ at most by the cells that only one mask has. Among plans sorted by
   area, the partners of a plan are a run that ends where the area is too large.
2. Fingerprints: let a and b be the row sums of A and B in this position, 0 where a mask has no row. In each row,
   |a_i - b_i| is at most the number of cells in which A and B differ, so that sum |a_i - b_i| <= D. Sorting both in
   descending order does not increase this sum (of all ways to pair two lists of numbers, pairing them in order has the
   least sum of differences). Neither does adding up runs of them (triangle inequality). The result does not depend on
   the position, since rows without cells are sorted to the end. Flips permute rows; turns exchange rows and columns.
   A pair is therefore ruled out if its fingerprints differ by more than the limit both ways: rows from rows and columns
   from columns, and rows from columns. Fingerprints with fewer, wider bins, which fit in one line of the cache, are
   compared first.
3. Positions: two rows share at most the smaller of their sums, so that D >= |A| + |B| - 2 sum min(a_i, b_i), by rows
   and by columns. Most pairs are ruled out by these profiles alone. For the others, the plans are read again. Most of
   their positions are ruled out as well; in those that remain, cells are counted row by row. The bound of each row is
   replaced by its count until the sum cannot fall below the best position found.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, lru_cache, partial
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import Mask, Space, all_rings, edges_in_pixels
from houseexpo.plan.model import PlanData
from houseexpo.progress import show_progress
from houseexpo.tolerances import FINER_GRID

if TYPE_CHECKING:
    from houseexpo.analysis.kernels.masks import Cells, MaskProfiles, PackedMask

PIXELS_PER_METRE: Final = 20.0
THRESHOLD: Final = 0.02

SHIFT_PX: Final = 2
"""The largest shift of two cropped masks from being aligned, in cells."""

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

_BINS: Final = 64
_FINGERPRINTS_PER_TASK: Final = 256  # fingerprints for one task of a thread
_TASK: Final = 64  # pairs for one task of a thread
_TASKS_AHEAD: Final = 64  # tasks that are prepared before their results are needed
KEPT_MASKS: Final = 16_384  # masks in memory, 15 kB each in the median; others are made again when they are needed

Fingerprint = npt.NDArray[np.int32]
Load = Callable[[int], PlanData | Mask]
"""A function that returns the plan, or the mask, with a number."""

_Numbers = tuple[int, int]
Confirm = Callable[[_Numbers], str | None]
_Limits = tuple[float, int, int]  # the threshold, the shift in cells, and how many symmetries are tried
_T = TypeVar("_T")
_R = TypeVar("_R")


class SimilarPair(NamedTuple):
    """Two plans within the threshold, by their numbers; ``symmetry`` maps the second onto the first."""

    first: int
    second: int
    difference: float
    symmetry: str


@dataclass(frozen=True, eq=False)
class PairSearchResult:
    """The result of comparing plans: the fingerprint of each, by its number, and all pairs within the threshold."""

    fingerprints: Mapping[int, Fingerprint] = field(default_factory=dict)
    pairs: tuple[SimilarPair, ...] = ()


def space_with_furniture(space: Space) -> Space:
    """Return the compared area: the free space and the area under furniture, which does not change the house."""
    return space.floor if isinstance(space, PlanData) and space.objects else space


def comparison_frame(space: Space, pixels_per_metre: float = PIXELS_PER_METRE) -> GridFrame:
    """Return the grid of ``comparison_cells``."""
    corners = np.concatenate(all_rings(space))
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = pixels_per_metre * (1 + FINER_GRID)
    cols, rows = (2 * math.ceil(size * scale / 2) for size in (high - low).tolist())
    x, y = ((low + high) / 2 - np.array([cols, rows]) / (2 * scale)).tolist()
    return GridFrame((x, y), scale, (max(rows, 2), max(cols, 2)))


def crop_mask(mask: Mask) -> Mask:
    """Return the smallest rectangle of the mask with all True cells; its shape is (0, 0) without True cells."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return np.zeros((0, 0), dtype=bool)
    return mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]


def difference_lower_bound(print_: npt.NDArray[np.int32], prints: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
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


def find_similar_pairs(
    load: Load,
    count: int,
    *,
    threshold: float = THRESHOLD,
    pixels_per_metre: float = PIXELS_PER_METRE,
    symmetries: bool = True,
    shift_px: int = SHIFT_PX,
    known: PairSearchResult | None = None,
    threads: int = 1,
    label: str = "",
    confirm: Confirm | None = None,
) -> PairSearchResult:
    """Find all pairs of plans whose difference is at most ``threshold``.

    Parameters
    ----------
    load
        Returns the plan, or the cropped mask, with a number from 0 to ``count`` - 1. It is called for each new plan,
        and again for each plan that must be compared cell by cell.
    symmetries
        Whether a rotated or mirrored house is the same house.
    shift_px
        Largest shift from being aligned, cells.
    known
        The result for some of these plans, which are not compared with each other again.
    threads
        Number of threads; the result does not depend on it.
    label
        The text of a progress bar; by default, no bar is shown.
    confirm
        Called with a pair before its masks are compared. It returns the symmetry under which the plans agree in
        properties that masks do not show, or None to rule the pair out.
    """
    from houseexpo.analysis.kernels.masks import mask_profiles, pack_mask

    known = known or PairSearchResult()
    mask_of = partial(_cells_of, load, pixels_per_metre)
    limits = (threshold, shift_px, len(SYMMETRIES) if symmetries else 1)
    fresh = np.array([i not in known.fingerprints for i in range(count)], bool)
    prints = np.zeros((count, 1 + 2 * _BINS), np.int32)
    profiles_of = cache(lambda number: mask_profiles(mask_of(number)))
    packed_of = lru_cache(maxsize=KEPT_MASKS)(lambda number: pack_mask(mask_of(number)))
    for i in show_progress(range(count), label, count) if label else range(count):
        prints[i] = fingerprint_from_profiles(profiles_of(i)) if fresh[i] else known.fingerprints[i]
    with ThreadPoolExecutor(threads) as pool:
        possible = _possible_pairs(prints, fresh, threshold, pool)
        near = _in_threads(pool, partial(_near_pairs, limits), ((pair, *map(profiles_of, pair)) for pair in possible))
        confirmed = {pair: symmetry for pair in near if (symmetry := confirm(pair) if confirm else "") is not None}
        jobs = ((pair, *map(packed_of, pair)) for pair in confirmed)
        pairs = [
            pair._replace(symmetry=confirmed[pair[:2]] or pair.symmetry)
            for pair in _in_threads(pool, partial(_pairs_within, limits), jobs)
        ]
        return PairSearchResult(dict(enumerate(prints)), tuple(sorted([*known.pairs, *pairs])))


def fingerprint_from_profiles(profiles: MaskProfiles) -> Fingerprint:
    """Return numbers (1 + 2 * 64,) that do not change under the eight symmetries and shifts, given a mask's profiles.

    They are the area, the row sums and the column sums. The sums are sorted and added up in bins of 8; the greater of
    the two profiles comes first. ``difference_lower_bound`` derives a bound from them.
    """
    from houseexpo.analysis.kernels.masks import pool_sums

    first, second = sorted((pool_sums(sums).tolist() for sums in profiles), reverse=True)
    return np.array([int(profiles.rows.sum()), *first, *second], np.int32)


def _cells_of(load: Load, pixels_per_metre: float, number: int) -> Cells:
    given = load(number)
    if isinstance(given, PlanData):
        return comparison_cells(given, pixels_per_metre)
    return np.ascontiguousarray(crop_mask(given)).view(np.uint8)


def comparison_cells(plan: PlanData, pixels_per_metre: float = PIXELS_PER_METRE) -> Cells:
    """Rasterise a plan so that rotating or mirroring it does the same to its mask, which is cropped.

    The grid is centred on the bounds, has an even number of cells on each axis and is finer than requested by 1 in
    10,000. Therefore no wall on the 1 cm grid runs through cell centres, where one side would have to be preferred.
    """
    from houseexpo.analysis.kernels.masks import fill_rings, mask_profiles

    space = space_with_furniture(plan)
    frame = comparison_frame(space, pixels_per_metre)
    mask = fill_rings(*edges_in_pixels(all_rings(space), frame), *frame.shape)
    rows, cols = (np.flatnonzero(sums) for sums in mask_profiles(mask))
    if not len(rows):
        return mask[:0, :0]
    return np.ascontiguousarray(mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1])


def _possible_pairs(
    prints: Fingerprint, fresh: npt.NDArray[np.bool_], threshold: float, pool: ThreadPoolExecutor
) -> list[_Numbers]:
    """Return the pairs that their fingerprints do not rule out, each with at least one new plan.

    They are sorted by area, so that consecutive pairs need the same masks.
    """
    from houseexpo.analysis.kernels.masks import near_fingerprint_pairs, pool_fingerprints

    order = np.argsort(prints[:, 0], kind="stable")
    order = order[prints[order, 0] > 0]  # a plan without free cells has no duplicate
    ordered, new = np.ascontiguousarray(prints[order]), fresh[order]
    areas, groups = np.ascontiguousarray(ordered[:, 0]), pool_fingerprints(ordered)
    blocks = pool.map(
        lambda at: near_fingerprint_pairs(
            ordered, areas, groups, new, threshold, at, min(at + _FINGERPRINTS_PER_TASK, len(ordered))
        ),
        range(0, len(ordered), _FINGERPRINTS_PER_TASK),
    )
    found = np.sort(order[np.concatenate([np.zeros((0, 2), np.int64), *blocks])], axis=1)
    return [(int(first), int(second)) for first, second in found]


def _in_threads(pool: ThreadPoolExecutor, work: Callable[[list[_T]], list[_R]], items: Iterable[_T]) -> Iterator[_R]:
    """Yield the results of ``work`` for lists of items, in order; this thread makes items while others work.

    Items are made in this thread because threads that take turns at Python wait for each other more than they gain.
    """
    waiting: deque[Future[list[_R]]] = deque()
    remaining = iter(items)
    while some := list(islice(remaining, _TASK)):
        waiting.append(pool.submit(work, some))
        if len(waiting) > _TASKS_AHEAD:
            yield from waiting.popleft().result()
    for future in waiting:
        yield from future.result()


def _near_pairs(limits: _Limits, jobs: list[tuple[_Numbers, MaskProfiles, MaskProfiles]]) -> list[_Numbers]:
    """Return the pairs that their profiles do not rule out."""
    from houseexpo.analysis.kernels.masks import profiles_may_match

    return [pair for pair, one, other in jobs if profiles_may_match(one, other, *limits)]


def _pairs_within(limits: _Limits, jobs: list[tuple[_Numbers, PackedMask, PackedMask]]) -> list[SimilarPair]:
    """Return the pairs that are within the threshold."""
    from houseexpo.analysis.kernels.masks import least_difference

    names = tuple(SYMMETRIES)
    found = []
    for pair, one, other in jobs:
        cells, symmetry = least_difference(one, other, *limits)
        if symmetry >= 0:
            area = max(int(one.profiles.rows.sum()), int(other.profiles.rows.sum()))
            found.append(SimilarPair(*pair, cells / area, names[symmetry]))
    return found


def _l1(sums: npt.NDArray[np.int32], table: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    distance: npt.NDArray[np.int32] = np.abs(table - sums).sum(axis=1, dtype=np.int32)
    return distance
