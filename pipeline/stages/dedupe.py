"""Stage dedupe: over all plans of a build, find those that are the same house, and keep one of each.

The measure is ``houseexpo.analysis.similarity``'s: |A xor B| / max(|A|, |B|) of free pixels after cropping, the least
under the symmetries of the square and with the crops meeting at one end of each axis or the other, shifted by up to two
cells.
All pairs within the threshold are found; then, in the order of ids, a plan stays unless it is a duplicate of one that
stays. So plans that are added are compared, and only this last pass is made again.

Nearly all pairs are ruled out unseen, and none wrongly. Let D = |A xor B| for A and B as they lie in the best position.

1. Areas: ||A| - |B|| <= D, since the areas differ by no more than the cells that only one of them has. With the plans
   in the order of their areas, the partners of a plan are a run that ends where the area is too large.
2. Profiles: let a, b be the row sums of A and B as they lie, or 0 if one has no row. Row by row |a_i - b_i| is at most
   the number of cells of the row in which they differ, so sum |a_i - b_i| <= D. Sorting both in falling order does not
   enlarge this sum (of all ways to pair two lists of numbers, pairing them in order has the least sum of differences),
   nor does adding up runs of them (triangle inequality). What is left, the ``print``, is the same wherever A lies,
   since rows of zeros sort to the end; flips permute rows, and turns exchange rows and columns. So a pair whose prints
   differ by more than the limit, rows with rows and columns with columns, and also rows with columns, is ruled out.
   Prints whose bins are added up further, to a line of the cache, are compared first.
3. Position: the cells that two rows share are at most the lesser of their sums; so
   D >= |A| + |B| - 2 sum min(a_i, b_i), by rows and by columns. Most pairs end here, by their profiles alone. Plans of
   the others are read again; most of their positions end here too, and those left are counted row by row, each row's
   bound giving way to its count, until the sum cannot come below the best position found.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, lru_cache, partial
from itertools import islice
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from houseexpo.analysis.similarity import SYMMETRIES, Duplicate, compared_space, comparison_frame, crop
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import Mask, edges_in_pixels, rings_of
from pipeline.config import DedupeConfig
from pipeline.kernels import shapes
from pipeline.kernels.prints import BINS, grouped, near_prints, pooled
from pipeline.kernels.profiles import Cells, Profiles, may_be_near, profiles_of

Load = Callable[[int], FloorPlan | Mask]
"""Gives the plan, or the mask, of a number."""

_NAMES = tuple(SYMMETRIES)
_BLOCK, _PART, _AHEAD = 256, 64, 64
_SHAPES = 16_384  # as many are kept in memory, 15 kB each in the median; others are made again when they are needed


Numbers = tuple[int, int]
Limits = tuple[float, int, int]
"""The threshold, the shift in cells, and how many symmetries are tried."""


class Pair(NamedTuple):
    """Two plans within the threshold, by their numbers; ``symmetry`` takes the second onto the first."""

    first: int
    second: int
    difference: float
    symmetry: str


@dataclass(frozen=True, eq=False)
class Shapes:
    """What is known of plans by themselves and of each other, by their numbers; a print is (129,) int32."""

    prints: Mapping[int, npt.NDArray[np.int32]] = field(default_factory=dict)
    pairs: tuple[Pair, ...] = ()


def compared(load: Load, count: int, config: DedupeConfig, known: Shapes | None = None, threads: int = 1) -> Shapes:
    """Find all pairs within the threshold among plans 0 to ``count`` - 1, which are numbered in the order of ids.

    Parameters
    ----------
    load
        Gives a plan or a cropped mask; asked for each new one, and again for those that need a closer look.
    known
        The result for some of these plans: they are not compared with each other again.
    threads
        How many compute at a time; the result does not depend on it.
    """
    known = known or Shapes()
    mask_of = partial(_mask, load, config.pixels_per_metre)
    limits = (config.threshold, config.shift_px, len(_NAMES) if config.symmetries else 1)
    fresh = np.array([i not in known.prints for i in range(count)], bool)
    prints = np.zeros((count, 1 + 2 * BINS), np.int32)
    profiles_at = cache(lambda number: profiles_of(mask_of(number)))
    shape_of = lru_cache(maxsize=_SHAPES)(lambda number: shapes.shape_of(mask_of(number)))
    for i in range(count):
        prints[i] = print_of(profiles_at(i)) if fresh[i] else known.prints[i]
    with ThreadPoolExecutor(threads) as pool:
        candidates = _candidates(prints, fresh, config.threshold, pool)
        near = _results(pool, partial(_near, limits), ((pair, *map(profiles_at, pair)) for pair in candidates))
        pairs = _results(pool, partial(_pairs, limits), ((pair, *map(shape_of, pair)) for pair in near))
        return Shapes(dict(enumerate(prints)), tuple(sorted([*known.pairs, *pairs])))


def dedupe(ids: Sequence[str], pairs: Collection[Pair], keep: Collection[str] = ()) -> list[Duplicate]:
    """Return the plans to drop, sorted by id.

    1. In the order of ids, a plan stays unless it is a duplicate of one that stays; the first such is named.
    2. A plan in ``keep`` is never dropped: a person said so.

    Parameters
    ----------
    ids
        The plans' ids, sorted; ``pairs`` name them by their numbers.
    """
    partners: dict[int, list[Pair]] = {}
    for pair in sorted(pairs):
        partners.setdefault(pair.second, []).append(pair)
    dropped: dict[int, Duplicate] = {}
    for i, name in enumerate(ids):
        kept = next((pair for pair in partners.get(i, []) if pair.first not in dropped), None)
        if kept is not None and name not in keep:  # R1, R2
            dropped[i] = Duplicate(name, ids[kept.first], round(kept.difference, 6), kept.symmetry)
    return list(dropped.values())


def print_of(profiles: Profiles) -> npt.NDArray[np.int32]:
    """Return a mask's area and its two pooled profiles, the greater first: ``analysis.similarity.fingerprint``."""
    first, second = sorted((pooled(sums).tolist() for sums in profiles), reverse=True)
    return np.array([int(profiles.rows.sum()), *first, *second], np.int32)


def _mask(load: Load, pixels_per_metre: float, number: int) -> Cells:
    """Return the cropped mask of a plan: ``houseexpo.analysis.similarity.comparison_mask``."""
    given = load(number)
    if not isinstance(given, FloorPlan):
        return np.ascontiguousarray(crop(given)).view(np.uint8)
    space = compared_space(given)
    frame = comparison_frame(space, pixels_per_metre)
    start, end = edges_in_pixels(rings_of(space), frame)
    mask = shapes.filled(start, end, *frame.shape)
    rows, cols = (np.flatnonzero(sums) for sums in profiles_of(mask))
    if not len(rows):
        return mask[:0, :0]
    return np.ascontiguousarray(mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1])


def _candidates(
    prints: npt.NDArray[np.int32], fresh: npt.NDArray[np.bool_], threshold: float, pool: ThreadPoolExecutor
) -> list[Numbers]:
    """Return the pairs that their prints do not rule out; of each at least one is new.

    They come in the order of areas, so that the shapes they need are those that were needed just before.
    """
    order = np.argsort(prints[:, 0], kind="stable")
    order = order[prints[order, 0] > 0]  # a plan without a free cell is nobody's duplicate
    ordered, new = np.ascontiguousarray(prints[order]), fresh[order]
    areas, groups = np.ascontiguousarray(ordered[:, 0]), grouped(ordered)
    blocks = pool.map(
        lambda at: near_prints(ordered, areas, groups, new, threshold, at, min(at + _BLOCK, len(ordered))),
        range(0, len(ordered), _BLOCK),
    )
    found = np.sort(order[np.concatenate([np.zeros((0, 2), np.int64), *blocks])], axis=1)
    return [(int(first), int(second)) for first, second in found]


_T = TypeVar("_T")
_R = TypeVar("_R")


def _results(pool: ThreadPoolExecutor, work: Callable[[list[_T]], list[_R]], items: Iterable[_T]) -> Iterator[_R]:
    """Yield what work returns for parts of the items, in their order; the next items are made while threads work.

    Items are made in this thread: threads that take turns at Python wait for each other more than they gain.
    """
    waiting: deque[Future[list[_R]]] = deque()
    parts = iter(items)
    while part := list(islice(parts, _PART)):
        waiting.append(pool.submit(work, part))
        if len(waiting) > _AHEAD:
            yield from waiting.popleft().result()
    for future in waiting:
        yield from future.result()


def _near(limits: Limits, jobs: list[tuple[Numbers, Profiles, Profiles]]) -> list[Numbers]:
    """Return those of some pairs that their profiles do not rule out."""
    return [pair for pair, one, other in jobs if may_be_near(one, other, *limits)]


def _pairs(limits: Limits, jobs: list[tuple[Numbers, shapes.Shape, shapes.Shape]]) -> list[Pair]:
    """Return those of some pairs that are within the threshold."""
    found = []
    for pair, one, other in jobs:
        cells, symmetry = shapes.least_difference(one, other, *limits)
        if symmetry >= 0:
            area = max(int(one.profiles.rows.sum()), int(other.profiles.rows.sum()))
            found.append(Pair(*pair, cells / area, _NAMES[symmetry]))
    return found
