"""A lower bound of the way on which an explorer sees a share of a house, from regions that it cannot leave unseen.

Some regions of cells that count are so large that not all of them may stay unseen. From a region, cells are seen in
its *view*: the places from which some cell of it is seen. Every way that sees the share enters the views of enough
regions. The bound is the length of the shortest way that does, found by breadth-first search over pairs of a square of
cells and the set of views that were entered. It adds up the ways between regions; a bound by single cells
(``research.way_bounds``) is the way to the last of them.

R1  A way is cut where it enters a view for the first time, and else into parts that are not longer than the side of a
    square. The ends of a part lie in the same or in adjacent squares, also diagonally: n parts are n moves of a king in
    chess. So a way into m views is longer than (moves - 1 - m) sides.
R2  Places between centres: the laser's range is lengthened by the diagonal of a cell, and views are wider by a cell.
R3  The robot's centre is in squares that have a cell where the planner lets it stand, or one beside such a cell.
R4  Cells are judged on a lattice. A region is seen if one of its judged cells is.
R5  Regions are chosen one after the other: first the cell whose view is farthest from the start and from the views so
    far, then those beside the region that widen its view least. Any choice gives a bound; the best of several counts.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.worlds.world import World, new_scan_buffers

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Words = npt.NDArray[np.uint64]
Counts = npt.NDArray[np.int64]
REGIONS: Final = 9
"""The largest number of regions."""
SPLITS: Final = 1, 2
"""Into how many regions the cells are split that may stay unseen; so many regions less one may be left out."""
SEEDS: Final = 80
"""The largest number of cells that are tried as the first one of a region."""
_WITHOUT: Final = np.array(
    [sum(1 << b for b in range(64) if not b >> i & 1) for i in range(6)], np.uint64
)  # for each i < 6, the sets of a word that lack member i


class Views(NamedTuple):
    """What is seen from where, on squares of ``side`` cells and a lattice of judged cells."""

    side: int
    judged: Counts
    """(n, 2), rows and columns on the lattice, not on the map."""
    seen_from: Bools
    """(n, rows, cols), the squares from which each judged cell is seen (R2)."""
    away_px: Floats
    """(n,), the least of the ways that lead to a cell from which a judged cell is seen."""


def region_way_px(views: Views, stands: Bools, x: float, y: float, share: float) -> float:
    """Return a way in pixels that no explorer from (x, y), pixels, can undercut if it sees a share, 0 to 1.

    ``stands`` (rows, cols) are the cells where the robot's centre can be.
    """
    squares = _squares_of(_widen(stands), views.side)
    start = int(y) // views.side, int(x) // views.side
    squares[start] = True
    spare, most = len(views.judged) - math.ceil(share * len(views.judged) - 1e-9), 0
    for split in SPLITS:
        chosen = choose_regions(squares, start, views.seen_from, views.judged, spare // split + 1)
        needed = len(chosen) - split + 1
        if needed > 0:
            entered = np.array([views.seen_from[region].any(axis=0) for region in chosen])
            most = max(most, fewest_moves(squares, start, entered, needed) - 1 - needed)
    return float(most * views.side)


def fewest_moves(squares: Bools, start: tuple[int, int], views: Bools, needed: int) -> int:
    """Return the least number of a king's moves from a square until ``needed`` views have been entered; 0 if it cannot.

    Parameters
    ----------
    squares
        (rows, cols), on which the king may be.
    views
        (k, rows, cols).
    """
    k = len(views)
    words = 1 << max(k - 6, 0)
    enough = np.array([bin(held).count("1") >= needed for held in range(1 << k)])
    goals = _packed(enough, words)
    rows, cols = squares.shape
    held = np.zeros((rows + 2, cols + 2, words), np.uint64)  # of each square, the sets with which it is reached
    inner = held[1:-1, 1:-1]
    inner[start][0] = 1  # the empty set
    allowed = np.where(squares, ~np.uint64(0), np.uint64(0))[..., None]
    places = [np.nonzero(view & squares) for view in views]
    before = -1
    for moves in range(rows * cols):
        for i, place in enumerate(places):
            inner[place] = _with_member(inner[place], i)
        everywhere = np.bitwise_or.reduce(inner, axis=(0, 1))
        if (everywhere & goals).any():
            return moves
        number = int(np.bitwise_count(inner).sum())
        if number == before:  # nothing new is reached
            return 0
        before = number
        wide = held[:-2] | held[1:-1] | held[2:]
        inner[:] = (wide[:, :-2] | wide[:, 1:-1] | wide[:, 2:]) & allowed
    return 0


def _packed(sets: Bools, words: int) -> Words:
    """Return which sets (2**k,) are true as bits of words."""
    wide = np.zeros(words * 64, bool)
    wide[: len(sets)] = sets
    return np.packbits(wide, bitorder="little").view(np.uint64)


def _with_member(held: Words, i: int) -> Words:
    """Return sets of sets (n, words), with each set also once more with the member ``i``."""
    if i < len(_WITHOUT):
        return held | (held & _WITHOUT[i]) << np.uint64(1 << i)
    half = 1 << (i - 6)
    high = held.reshape(len(held), held.shape[1] // (2 * half), 2, half).copy()
    high[:, :, 1] |= high[:, :, 0]
    return high.reshape(held.shape)


def choose_regions(squares: Bools, start: tuple[int, int], views: Bools, judged: Counts, size: int) -> list[Counts]:
    """Return disjoint regions of ``size`` judged cells each, at most ``REGIONS``, as indices (R5).

    Parameters
    ----------
    views
        (n, rows, cols), the squares from which each cell is seen.
    judged
        (n, 2), the cells' rows and columns on the lattice.
    """
    packed = np.packbits(views.reshape(len(views), -1), axis=1)
    packed = np.pad(packed, ((0, 0), (0, -packed.shape[1] % 8))).view(np.uint64)
    index = {tuple(cell): i for i, cell in enumerate(judged.tolist())}
    beside = [
        [index[at] for a in (-1, 0, 1) for b in (-1, 0, 1) if (at := (row + a, col + b)) in index and (a or b)]
        for row, col in index
    ]
    left, chosen = np.ones(len(judged), bool), list[Counts]()
    away = _moves_from(squares, _only(squares.shape, start))
    while len(chosen) < REGIONS:
        seeds = np.flatnonzero(left)
        seeds = seeds[:: max(len(seeds) // SEEDS, 1)]
        far = np.where(views[seeds], away, np.inf).min(axis=(1, 2), initial=np.inf)
        far[np.isinf(far)] = -1.0  # a cell that nobody sees
        order = np.argsort(-far, kind="stable")
        if not len(seeds) or far[order[0]] <= 1.0:
            break
        region = _grow(int(seeds[order[0]]), size, left, beside, packed)
        left[region] = False
        if len(region) == size:
            chosen.append(region)
            away = np.minimum(away, _moves_from(squares, views[region].any(axis=0) & squares))
    return chosen


def _grow(seed: int, size: int, left: Bools, beside: list[list[int]], packed: Words) -> Counts:
    """Return a region of at most ``size`` cells that are ``left``, grown from a cell by R5."""
    region, view, edge = [seed], packed[seed].copy(), {i for i in beside[seed] if left[i]}
    while len(region) < size and edge:
        tried = np.array(sorted(edge))
        best = int(tried[np.bitwise_count(packed[tried] | view).sum(axis=1).argmin()])
        edge.remove(best)
        region.append(best)
        view |= packed[best]
        edge |= {i for i in beside[best] if left[i] and i not in region}
    return np.array(region)


def _moves_from(squares: Bools, places: Bools) -> Floats:
    """Return the number of a king's moves to each square from the nearest of some places, inf if none."""
    found = np.full(squares.shape, np.inf)
    now, moves = places.copy(), 0
    while now.any():
        found[now] = moves
        moves += 1
        now = _widen(now) & squares & np.isinf(found)
    return found


def find_views(world: World, ways_px: Floats, range_px: float, side: int, every: int) -> Views:
    """Return what is seen from where; one scan a cell is enough, for who sees is seen.

    Parameters
    ----------
    ways_px
        (rows * cols,), the way to each cell, inf where the robot cannot be.
    side, every
        The side of squares and the pitch of the lattice, cells.
    """
    occupied = world.occupied.copy()  # the kernel is compiled for arrays that can be written
    rows, cols = occupied.shape
    high, wide = -(-rows // side), -(-cols // side)
    judged = np.argwhere(world.observable[::every, ::every] != 0)
    runs, hit, slopes = new_scan_buffers(range_px)
    ways_px = np.append(ways_px, np.inf)  # the end of the last run
    found, size = np.zeros((len(judged), high * (wide + 1)), bool), high * (wide + 1) + 1
    away = np.empty(len(judged))
    for k, (row, col) in enumerate((judged * every).tolist()):
        n_runs, _ = sector_scan(occupied, col + 0.5, row + 0.5, 0.0, math.pi, range_px, runs, hit, slopes)
        line, first = np.divmod(runs[:n_runs, 0], cols)
        last = runs[:n_runs, 1] - line * cols
        lines = np.concatenate([np.maximum(line - 1, 0), np.minimum(line + 1, rows - 1)]) // side * (wide + 1)
        starts = lines + np.tile(np.maximum(first - 1, 0) // side, 2)
        ends = lines + np.tile(np.minimum(last + 1, cols - 1) // side + 1, 2)
        found[k] = (np.bincount(starts, minlength=size) - np.bincount(ends, minlength=size)).cumsum()[:-1] > 0
        parts = runs[:n_runs].astype(np.int64)
        parts[:, 1] += 1
        away[k] = np.minimum.reduceat(ways_px, parts.ravel())[::2].min(initial=ways_px[row * cols + col])
    return Views(side, judged, found.reshape(len(judged), high, wide + 1)[..., :wide], away)


def _squares_of(cells: Bools, side: int) -> Bools:
    """Return which squares have a true cell."""
    rows, cols = cells.shape
    padded = np.pad(cells, ((0, -rows % side), (0, -cols % side)))
    found: Bools = padded.reshape(-(-rows // side), side, -1, side).any(axis=(1, 3))
    return found


def _widen(places: Bools) -> Bools:
    """Return places (..., rows, cols) and those beside them, also diagonally."""
    wide = places.copy()
    wide[..., 1:, :] |= places[..., :-1, :]
    wide[..., :-1, :] |= places[..., 1:, :]
    found = wide.copy()
    found[..., 1:] |= wide[..., :-1]
    found[..., :-1] |= wide[..., 1:]
    return found


def _only(shape: tuple[int, int], place: tuple[int, int]) -> Bools:
    found = np.zeros(shape, bool)
    found[place] = True
    return found
