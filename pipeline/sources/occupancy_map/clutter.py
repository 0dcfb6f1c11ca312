"""Tell clutter in the free space of a map from pieces of its walls, and noise from rooms; ``rooms`` divides the rest.

R1  A piece that stands alone in free space, shorter than ``REACH_M``, is clutter: the space goes on under it. A patch
    of free cells smaller than ``PATCH_M2`` is noise.
R2  A piece of wall between two doors stands alone too. It is at least ``PIECE_M`` long, at most ``THICKEST_PIECE_M``
    thick, and at least ``SLENDER`` times as long as thick. Over ``REACH_M`` beyond its ends, its line is wall, or
    another such piece, for ``HARDLY`` of either side and ``STANDS`` of both together.
R4  A wall that hangs on another wall stands alone where the robot did not see it whole. The line of a slender piece, at
    least ``RUN_M`` long, is followed over pieces that stand alone and are at most ``THICKEST_PIECE_M`` thick, and over
    gaps of less than ``NARROWEST_GAP_M``, since a wider gap may be a way (``gaps``). A line that comes to a wall and is
    at least ``PIECE_M`` long is wall, with its gaps.
R5  An object seen in a room, farther than ``HAND_M`` from the room's edge, is a thing. It consists of its cells, also
    those nearer to the edge, the places between its parts up to ``BESIDE_M`` wide, and unseen cells that it surrounds.
R3  Pieces that stand alone are dashes of a wall if they, with what stands against them, are at most ``PIECE_M`` thick.
    Tables and racks in a row are thicker.
"""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.sources.occupancy_map.gaps import NARROWEST_GAP_M, REACH_M
from pipeline.sources.occupancy_map.narrow_places import Bools, Floats
from pipeline.tolerances import BESIDE_M, HAND_M, HARDLY, PATCH_M2, RUN_M, STANDS

PIECE_M: Final = 0.8
THICKEST_PIECE_M: Final = 0.4
SLENDER: Final = 3.0


def fill_clutter(free: Bools, cell_m: float, occupied: Bools | None = None) -> Bools:
    """Return the free cells (rows, cols) and those under clutter, without scraps; cells are ``cell_m`` wide.

    ``occupied`` (rows, cols) are the cells at which a ray ended; None if that is not known, and all may be.
    """
    _, pieces, stats, _ = cv2.connectedComponentsWithStats((~free).view(np.uint8), connectivity=8)
    rows, cols = free.shape
    left, top, wide, high = stats[:, : cv2.CC_STAT_AREA].T
    inside = (left > 0) & (top > 0) & (left + wide < cols) & (top + high < rows)
    length_m = np.hypot(wide, high) * cell_m
    alone = inside & (length_m < REACH_M)
    alone[0] = False
    numbers, ends = slender_pieces(pieces, stats, np.flatnonzero(alone & (length_m >= PIECE_M)), cell_m)
    if len(numbers):
        clutter = alone.copy()
        clutter[numbers] = False
        alone[numbers[_in_line(ends, ~free & ~clutter[pieces], cell_m)]] = False
    hit = ~free if occupied is None else occupied & ~free
    walls = _hanging_walls(pieces, stats, alone & (np.bincount(pieces[hit], minlength=len(alone)) > 0), hit, cell_m)
    alone[np.unique(pieces[walls])] = False
    return drop_scraps((free | alone[pieces]) & ~walls, cell_m)


def _hanging_walls(
    pieces: npt.NDArray[Any], stats: npt.NDArray[Any], alone: Bools, taken: Bools, cell_m: float
) -> Bools:
    """Return the cells (rows, cols) on the lines of walls that hang on others; ``alone`` is by piece."""
    thin = alone & (stats[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].min(axis=1) * cell_m <= REACH_M / 2)
    numbers = np.flatnonzero(thin & (np.hypot(stats[:, 2], stats[:, 3]) * cell_m >= RUN_M))
    _, ends = slender_pieces(pieces, stats, numbers, cell_m, RUN_M)
    dashes, wall = _dilate(alone[pieces], cell_m), taken & ~alone[pieces]
    found = np.zeros(taken.shape, np.uint8)
    left = list(ends)
    while left:
        walls = _dilate(wall | found.view(bool), cell_m)
        spans = [_follow_line(line, dashes, walls, cell_m) for line in left]
        hanging = [span for span in spans if span is not None]
        for one, other in np.rint(hanging).astype(int).tolist():
            cv2.line(found, one, other, 1, 1)
        left = [line for line, span in zip(left, spans, strict=True) if span is None] if hanging else []
    return found.view(bool)


def _dilate(cells: Bools, cell_m: float) -> Bools:
    """Return cells (rows, cols) and those within HAND_M of them."""
    # R2: a wall so near to the line of a piece is in line with it
    reach = max(round(HAND_M / cell_m), 1)
    return cv2.dilate(cells.view(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)).view(bool)


def _follow_line(ends: Floats, dashes: Bools, walls: Bools, cell_m: float) -> Floats | None:
    """Return the ends (2, 2) of the line that continues a piece with ``ends`` (2, 2); None if it meets no wall."""
    along = ends[1] - ends[0]
    along = along / max(float(np.hypot(*along)), 1e-9)
    reach, bridge = max(round(HAND_M / cell_m), 1), round(NARROWEST_GAP_M / cell_m)
    found, hangs = [], False
    for end, way in ((ends[0], -along), (ends[1], along)):
        last, step = reach, 0  # what is thickened reaches so far beyond its end, and begins so far before it
        while step < last + bridge + 1 - 2 * reach:
            step += 1
            col, row = np.rint(end + way * step).astype(int).tolist()
            if not (0 <= row < len(walls) and 0 <= col < walls.shape[1]):
                break
            if walls[row, col]:
                last, hangs = step + 2 * reach, True
                break
            if dashes[row, col]:
                last = step
        found.append(end + way * max(last - reach, 0))
    long_m = float(np.hypot(*(found[1] - found[0]))) * cell_m
    return np.stack(found) if hangs and long_m >= PIECE_M else None


def free_beside_dashes(free: Bools, clear: Bools, cell_m: float) -> Bools:
    """Return the cells (rows, cols) of ``clear``, which are free or under clutter, without those under dashes; R3."""
    count, pieces, stats, _ = cv2.connectedComponentsWithStats((clear & ~free).view(np.uint8), connectivity=8)
    thickest = PIECE_M / cell_m
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
    large = stats[:, cv2.CC_STAT_AREA] * cell_m**2 >= PATCH_M2
    large[0] = False
    return np.asarray(large[pieces])


def things_in_rooms(rooms: Bools, free: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the cells (rows, cols) of things that stand in rooms; ``rooms`` has the cells inside rooms."""
    # R5: occupied cells nearer to the edge of a room belong to the wall, which a plan draws straight
    deep = cv2.erode(rooms.view(np.uint8), _square(HAND_M, cell_m), borderValue=0)
    near = cv2.dilate(deep & occupied.view(np.uint8), _square(HAND_M, cell_m))
    seen = near & (rooms & occupied).view(np.uint8)
    reach = round(BESIDE_M / 2 / cell_m)
    padded = cv2.copyMakeBorder(seen, reach, reach, reach, reach, cv2.BORDER_CONSTANT)
    joined = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, _square(BESIDE_M / 2, cell_m))
    things = joined[reach : joined.shape[0] - reach, reach : joined.shape[1] - reach].view(bool) & rooms & ~free
    count, pieces = cv2.connectedComponents((rooms & ~free & ~occupied).view(np.uint8), connectivity=4)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inner = cv2.erode((pieces > 0).view(np.uint8), cross, borderValue=0).view(bool)
    edge = np.bincount(pieces[~inner], minlength=count)
    open_edge = np.bincount(pieces[cv2.dilate(free.view(np.uint8), cross).view(bool)], minlength=count)
    shut = open_edge <= HARDLY * edge  # R5: things and walls surround it
    shut[0] = False
    return np.asarray(things | shut[pieces])


def _square(reach_m: float, cell_m: float) -> npt.NDArray[np.uint8]:
    """Return the cells no farther than this from one, along the rows and columns."""
    side = 2 * round(reach_m / cell_m) + 1
    return np.ones((side, side), np.uint8)


def slender_pieces(  # noqa: PLR0917 - the pieces, and what is asked of them
    pieces: npt.NDArray[Any],
    stats: npt.NDArray[Any],
    numbers: npt.NDArray[np.int64],
    cell_m: float,
    least_m: float = PIECE_M,
    thickest_m: float = THICKEST_PIECE_M,
) -> tuple[npt.NDArray[np.int64], Floats]:
    """Return those of the pieces that are long and thin, and their ends (n, 2, 2), (across, down) in cells."""
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
        if long * cell_m >= least_m and thick * cell_m <= thickest_m and long >= SLENDER * thick:
            line = middle + across * (float(aside.max() + aside.min()) / 2)
            found.append(number)
            ends.append([line + along * float(far.min()), line + along * float(far.max())])
    return np.array(found, np.int64), np.array(ends, np.float64).reshape(-1, 2, 2)


def _in_line(ends: Floats, wall: Bools, cell_m: float) -> Bools:
    """Return which pieces (n) have wall in their line."""
    reach = max(round(HAND_M / cell_m), 1)
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
    return np.asarray((np.minimum(*shares) >= HARDLY) & (shares[0] + shares[1] >= 2 * STANDS))
