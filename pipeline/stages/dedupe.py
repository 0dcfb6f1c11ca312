"""Stage dedupe: over all plans of a build, find those that are the same house, and keep one of each.

The measure is ``houseexpo.analysis.similarity``'s: |A xor B| / max(|A|, |B|) of free pixels after cropping, the least
under the symmetries of the square and with the crops meeting at one end of each axis or the other, shifted by up to two
cells.
All pairs within the threshold are found; then, in the order of ids, a plan stays unless it is a duplicate of one that
stays. So plans that are added are compared, and only this last pass is made anew.

Nearly all pairs are ruled out unseen, and none wrongly. Let D = |A xor B| for A and B as they lie in the best position.

1. Areas: ||A| - |B|| <= D, since the areas differ by no more than the cells that only one of them has. With the plans
   in the order of their areas, the partners of a plan are a run that ends where the area is too large.
2. Profiles: let a, b be the row sums of A and B as they lie, 0 where one has no row. Row by row |a_i - b_i| is at most
   the number of cells of the row in which they differ, so sum |a_i - b_i| <= D. Sorting both in falling order does not
   enlarge this sum (of all ways to pair two lists of numbers, pairing them in order has the least sum of differences),
   nor does adding up runs of them (triangle inequality). What is left, the ``print``, is the same wherever A lies,
   since rows of zeros sort to the end; flips permute rows, and turns exchange rows and columns. So a pair whose prints
   differ by more than the limit, rows with rows and columns with columns, and also rows with columns, is ruled out.
   Prints whose bins are added up further, to a line of the cache, are compared first.
3. Position: the cells that two rows share are at most the lesser of their sums; so
   D >= |A| + |B| - 2 sum min(a_i, b_i), by rows and by columns. Most positions end here; the others are counted row by
   row, each row's bound giving way to its count, until the sum cannot come below the best position found.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import islice
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.analysis.similarity import SYMMETRIES, Duplicate, compared_space, comparison_frame, crop
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import Mask, edges_in_pixels, rings_of
from pipeline.config import DedupeConfig
from pipeline.kernels import shapes
from pipeline.kernels.prints import BINS, grouped, near_prints, pooled

Load = Callable[[int], FloorPlan | Mask]
"""Gives the plan, or the mask, of a number."""

_NAMES = tuple(SYMMETRIES)
_BLOCK, _PARTS = 256, 16
_SHAPES = 16_384  # as many are kept in memory, 15 kB each in the median; others are made again when they are needed


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
    shape_of = lru_cache(maxsize=_SHAPES)(lambda number: shapes.shape_of(mask_of(number)))
    limits = (config.threshold, config.shift_px, shapes.SYMMETRIES if config.symmetries else 1)
    fresh = np.array([i not in known.prints for i in range(count)], bool)
    prints = np.zeros((count, 1 + 2 * BINS), np.int32)
    for i in range(count):
        prints[i] = print_of(mask_of(i)) if fresh[i] else known.prints[i]
    with ThreadPoolExecutor(threads) as pool:
        jobs = (
            (first, second, shape_of(first), shape_of(second))
            for first, second in _candidates(prints, fresh, config.threshold, pool)
        )
        # plans are read in this thread: threads that take turns at Python wait for each other more than they gain
        found = [pair for batch in _batches(jobs) for pair in pool.map(partial(_pairs, limits), batch)]
    pairs = tuple(sorted([*known.pairs, *(pair for some in found for pair in some)]))
    return Shapes(dict(enumerate(prints)), pairs)


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


def print_of(mask: shapes.Cells) -> npt.NDArray[np.int32]:
    """Return a mask's area and its two pooled profiles, the greater first: ``analysis.similarity.fingerprint``."""
    rows, cols = shapes.row_sums(mask), shapes.col_sums(mask)
    profiles = sorted((pooled(rows).tolist(), pooled(cols).tolist()), reverse=True)
    return np.array([int(rows.sum()), *profiles[0], *profiles[1]], np.int32)


def _mask(load: Load, pixels_per_metre: float, number: int) -> shapes.Cells:
    """Return the cropped mask of a plan: ``houseexpo.analysis.similarity.comparison_mask``."""
    given = load(number)
    if not isinstance(given, FloorPlan):
        return np.ascontiguousarray(crop(given)).view(np.uint8)
    space = compared_space(given)
    frame = comparison_frame(space, pixels_per_metre)
    start, end = edges_in_pixels(rings_of(space), frame)
    mask = shapes.filled(start, end, *frame.shape)
    rows, cols = np.flatnonzero(shapes.row_sums(mask)), np.flatnonzero(shapes.col_sums(mask))
    if not len(rows):
        return mask[:0, :0]
    return np.ascontiguousarray(mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1])


def _candidates(
    prints: npt.NDArray[np.int32], fresh: npt.NDArray[np.bool_], threshold: float, pool: ThreadPoolExecutor
) -> list[tuple[int, int]]:
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


_Job = tuple[int, int, shapes.Shape, shapes.Shape]


def _batches(jobs: Iterator[_Job]) -> Iterator[list[list[_Job]]]:
    """Yield jobs by the thousand, so that few shapes are held at a time, in parts that threads take."""
    while part := list(islice(jobs, _BLOCK * _PARTS)):
        yield [part[at : at + _PARTS] for at in range(0, len(part), _PARTS)]


def _pairs(limits: tuple[float, int, int], jobs: list[_Job]) -> list[Pair]:
    """Return those of some pairs that are within the threshold."""
    found = []
    for first, second, one, other in jobs:
        cells, symmetry = shapes.least_difference(one, other, *limits)
        if symmetry >= 0:
            area = max(int(one.row_sums.sum()), int(other.row_sums.sum()))
            found.append(Pair(first, second, cells / area, _NAMES[symmetry]))
    return found
