"""Tell clutter in the free space of a map from pieces of its walls, and noise from rooms; ``rooms`` divides the rest.

R1  What stands alone in free space, shorter than ``ALONE_M``, is clutter: the space goes on under it. Free cells that
    less than ``SCRAP_M2`` of others join are noise.
R2  A piece of wall between two doors stands alone, too. It is ``PIECE_M`` long or longer, ``THICKEST_M`` thick at most,
    and at least ``SLENDER`` times as long as thick. In its line there is wall: over ``REACH_M`` beyond its ends,
    ``EACH_SIDE`` of either side and ``BOTH_SIDES`` of both together is wall, or another such piece.
R3  Of what stands alone, dashes of a wall, with what stands against them, are ``DEEPEST_M`` thick at most. Tables and
    racks in a row are thicker.
"""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.sources.occupancy_map.narrow_places import Bools, Floats

ALONE_M: Final = 3.0
SCRAP_M2: Final = 0.5
PIECE_M: Final = 0.8
THICKEST_M: Final = 0.4
SLENDER: Final = 3.0
DEEPEST_M: Final = 0.8
REACH_M: Final = 3.0
EACH_SIDE: Final = 0.15
BOTH_SIDES: Final = 0.4
IN_LINE_M: Final = 0.1
"""R2: how far from the line of a piece a wall may be that is in line with it."""


def fill_clutter(free: Bools, cell_m: float) -> Bools:
    """Return the free cells (rows, cols) and those under clutter, without scraps; cells are ``cell_m`` wide."""
    _, pieces, stats, _ = cv2.connectedComponentsWithStats((~free).view(np.uint8), connectivity=8)
    rows, cols = free.shape
    left, top, wide, high = stats[:, : cv2.CC_STAT_AREA].T
    inside = (left > 0) & (top > 0) & (left + wide < cols) & (top + high < rows)
    length_m = np.hypot(wide, high) * cell_m
    alone = inside & (length_m < ALONE_M)
    alone[0] = False
    numbers, ends = _slender_pieces(pieces, stats, np.flatnonzero(alone & (length_m >= PIECE_M)), cell_m)
    if len(numbers):
        clutter = alone.copy()
        clutter[numbers] = False
        alone[numbers[_in_line(ends, ~free & ~clutter[pieces], cell_m)]] = False
    return drop_scraps(free | alone[pieces], cell_m)


def free_beside_dashes(free: Bools, clear: Bools, cell_m: float) -> Bools:
    """Return the cells (rows, cols) of ``clear``, which are free or under clutter, without those under dashes; R3."""
    count, pieces, stats, _ = cv2.connectedComponentsWithStats((clear & ~free).view(np.uint8), connectivity=8)
    thickest = DEEPEST_M / cell_m
    thin = np.ones(count, bool)
    thin[0] = False
    sides = stats[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].min(axis=1)
    for number in (1 + np.flatnonzero(sides[1:] > thickest)).tolist():
        left, top, wide, high, _ = stats[number].tolist()
        down, right = np.nonzero(pieces[top : top + high, left : left + wide] == number)
        _, size, _ = cv2.minAreaRect(np.stack([right, down], axis=1).astype(np.float32))
        thin[number] = min(size) + 1 <= thickest
    return np.asarray(clear & ~thin[pieces])


def drop_scraps(clear: Bools, cell_m: float) -> Bools:
    """Return the free cells without scraps; R1."""
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(clear.view(np.uint8), connectivity=4)
    large = stats[:, cv2.CC_STAT_AREA] * cell_m**2 >= SCRAP_M2
    large[0] = False
    return np.asarray(large[pieces])


def _slender_pieces(
    pieces: npt.NDArray[Any], stats: npt.NDArray[Any], numbers: npt.NDArray[np.int64], cell_m: float
) -> tuple[npt.NDArray[np.int64], Floats]:
    """R2: return those of the pieces that are long and thin, and their ends (n, 2, 2), (across, down) in cells."""
    found, ends = [], []
    for number in numbers.tolist():
        left, top, wide, high, _ = stats[number].tolist()
        down, right = np.nonzero(pieces[top : top + high, left : left + wide] == number)
        cells = np.stack([right + left, down + top], axis=1).astype(np.float64)
        middle = cells.mean(axis=0)
        x, y = (cells - middle).T
        angle = np.arctan2(2 * (x * y).sum(), (x * x - y * y).sum()) / 2
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        far, aside = x * along[0] + y * along[1], x * across[0] + y * across[1]
        long, thick = float(np.ptp(far)) + 1, float(np.ptp(aside)) + 1
        if long * cell_m >= PIECE_M and thick * cell_m <= THICKEST_M and long >= SLENDER * thick:
            line = middle + across * (float(aside.max() + aside.min()) / 2)
            found.append(number)
            ends.append([line + along * float(far.min()), line + along * float(far.max())])
    return np.array(found, np.int64), np.array(ends, np.float64).reshape(-1, 2, 2)


def _in_line(ends: Floats, wall: Bools, cell_m: float) -> Bools:
    """R2: return which pieces (n) have wall in their line."""
    reach = max(round(IN_LINE_M / cell_m), 1)
    lines = cv2.dilate(wall.view(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)).view(bool)
    along = ends[:, 1] - ends[:, 0]
    along = along / np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    steps = np.arange(reach + 1, max(round(REACH_M / cell_m), reach + 2))
    shares = []
    for end, way in ((ends[:, 0], -along), (ends[:, 1], along)):
        at = np.rint(end[:, None] + way[:, None] * steps[None, :, None]).astype(np.int64)
        inside = ((at >= 0) & (at < (wall.shape[1], wall.shape[0]))).all(axis=2)
        hit = np.zeros(inside.shape, bool)
        hit[inside] = lines[at[inside][:, 1], at[inside][:, 0]]
        shares.append(hit.mean(axis=1))
    return np.asarray((np.minimum(*shares) >= EACH_SIDE) & (shares[0] + shares[1] >= 2 * BOTH_SIDES))
