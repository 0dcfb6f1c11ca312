"""Tell what walls enclose in a map from what a robot saw beyond them: fans of rays through doors, windows and glass.

From a place in a room, one sees walls in most directions. Behind an opening, the space that was seen is a wedge: its
sides are the first and the last ray, with unseen space beyond them. In the opening itself, half of the directions lead
back into the room, and half of them out. So the line where half of what one sees is wall closes the opening.

R1  A cell is enclosed if at least ``MOST`` of the lines from it over free cells end at a wall, in ``DIRECTIONS``
    directions all around. A line ends at a wall if an occupied cell is ``PARTITION_M`` or nearer to its end, or if it
    ends less than ``THICKEST_M`` before other space, both of which are wider than that: in the inside of a wall.
    Lines that end at the picture's border count neither way: people crop maps.
R2  A piece of free space that is not enclosed is a fan if it is at least ``FOOT_M`` wide and ``PATCH_M2`` large.
    Smaller pieces are corners, and places at gaps.
R3  A fan has enclosed space on one side only. A piece that leads from one enclosed space to another is not a fan, if
    both are at least as large as the piece and ``SPACE_M2``.
R4  A room of which more than half is a fan is outside, and so are enclosed spaces behind it. Any other room ends where
    its fans begin. If less than ``SCARCELY`` of all rooms would be left, the walls of this map enclose nothing, and
    all stays.
R5  A map of which less than ``FEW`` of the edge of free space is occupied does not show its walls: it has no fans.
R6  A room is a fan, too, if most of its edge is at no wall, unless it is the largest.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.geometry.groups import connected_groups
from pipeline.sources.occupancy_map.gaps import NARROWEST_GAP_M, THICKEST_M
from pipeline.sources.occupancy_map.narrow_places import Bools, Labels
from pipeline.sources.tolerances import FEW, QUARTER, SCARCELY
from pipeline.tolerances import AROUND_M, FOOT_M, MOST, PARTITION_M, PATCH_M2

DIRECTIONS: Final = 32
SPACE_M2: Final = 5.0
ENCLOSURE_CELLS: Final = 1_000_000
"""Of larger maps, blocks of cells are looked at."""
_SQUARE: Final = np.ones((3, 3), np.uint8)
_CLEAR, _UNSEEN, _WALL, _BEYOND = 0, 1, 2, 3
_VOTES: Final = np.array([0, 0, 1, 100], np.uint8)
"""The count of a line by where it ends: 1 at a wall, 100 at the border, so that one sum holds both numbers."""


def find_fans(clear: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return which of the cells (rows, cols) that are ``clear`` are in a fan (R2); cells are ``cell_m`` wide."""
    if not is_marked(clear, occupied, cell_m):
        return np.zeros_like(clear)
    share = wall_share(clear, occupied, cell_m)
    bare = (clear & (share < MOST)).view(np.uint8)
    size = 2 * max(round(FOOT_M / 2 / cell_m), 1) + 1
    disc = np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
    wide = cv2.morphologyEx(bare, cv2.MORPH_OPEN, disc)
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(wide, connectivity=8)
    large = stats[:, cv2.CC_STAT_AREA] * cell_m**2 >= PATCH_M2
    large[0] = False
    _, space, sizes, _ = cv2.connectedComponentsWithStats((clear & (bare == 0)).view(np.uint8), connectivity=4)
    beside = 2 * size + 1  # what was opened away lies between
    square = np.ones((beside, beside), np.uint8)
    for number in np.flatnonzero(large).tolist():
        left, top, across, down, area = stats[number].tolist()
        box = np.s_[max(top - size, 0) : top + down + size, max(left - size, 0) : left + across + size]
        around = cv2.dilate((pieces[box] == number).view(np.uint8), square).view(bool)
        joined = np.sort(sizes[np.unique(space[box][around & (space[box] > 0)]), cv2.CC_STAT_AREA])[::-1]
        large[number] = len(joined) < 2 or joined[1] < max(area, SPACE_M2 / cell_m**2)  # R3
    return np.asarray(large[pieces])


def without_fans(
    label: Labels, fans: Bools, occupied: Bools, outside: frozenset[int], cell_m: float
) -> tuple[Labels | None, frozenset[int]]:
    """Return the labels (rows, cols) without fans, or None if no room has one, and the rooms that are fans (R4, R6)."""
    count = int(label.max(initial=0)) + 1
    area, bare = np.bincount(label.ravel(), minlength=count), np.bincount(label[fans], minlength=count)
    is_room = np.ones(count, bool)
    is_room[[0, *outside]] = False
    largest = int(np.where(is_room, area, -1).argmax())
    is_fan = 2 * bare > area
    if is_marked(label > 0, occupied, cell_m):
        is_fan |= (open_shares(label, occupied, cell_m) > MOST) & (np.arange(count) != largest)  # R6
    is_fan &= is_room
    kept = is_room & ~is_fan
    if not (is_fan | (is_room & (bare > 0))).any() or float((area - bare)[kept].sum()) < SCARCELY * float(
        area[is_room].sum()
    ):
        return None, frozenset()
    left = np.where(fans & kept[label], 0, label).astype(np.int32)
    for number in np.flatnonzero(kept & (bare > 0)).tolist():
        _, pieces, stats, _ = cv2.connectedComponentsWithStats((left == number).view(np.uint8), connectivity=4)
        left[(pieces > 0) & (pieces != 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()))] = 0
    return left, frozenset(np.flatnonzero(is_fan).tolist())


def open_shares(label: Labels, occupied: Bools, cell_m: float) -> npt.NDArray[np.float64]:
    """Return the share of the edge of each room (n,) away from walls; borders between rooms do not count as edge."""
    around = cv2.dilate(label.astype(np.float32), _SQUARE).astype(np.int64)
    around[label > 0] = 0
    near = _wall_cells(label > 0, occupied, cell_m)
    edge, seen = (np.bincount(each, minlength=int(label.max(initial=0)) + 1) for each in (around.ravel(), around[near]))
    return np.asarray(1 - seen / np.maximum(edge, 1))


def is_marked(clear: Bools, occupied: Bools, cell_m: float) -> bool:
    """Whether a map shows its walls as occupied cells."""
    edge = cv2.dilate(clear.view(np.uint8), _SQUARE).view(bool) & ~clear
    return bool(np.count_nonzero(edge & _around(occupied, cell_m)) >= FEW * np.count_nonzero(edge))


def _around(occupied: Bools, cell_m: float) -> Bools:
    """Return which cells (rows, cols) are ``PARTITION_M`` or nearer to an occupied one."""
    reach = 2 * max(round(PARTITION_M / cell_m), 1) + 1
    return np.asarray(cv2.dilate(occupied.view(np.uint8), np.ones((reach, reach), np.uint8)).view(bool))


def _wall_cells(clear: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the cells (rows, cols) at which a line over ``clear`` cells ends at a wall; R1."""
    size = 2 * max(round(THICKEST_M / 2 / cell_m), 1) + 1
    disc = np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
    wide = cv2.morphologyEx(clear.view(np.uint8), cv2.MORPH_OPEN, disc)
    return np.asarray(_around(occupied, cell_m) | cv2.morphologyEx(wide, cv2.MORPH_CLOSE, disc).view(bool))


def wall_share(clear: Bools, occupied: Bools, cell_m: float) -> npt.NDArray[np.float32]:
    """Return the share (rows, cols) of the lines from each cell that end at a wall (R1); 0 where none is ``clear``."""
    scale = int(np.ceil(np.sqrt(clear.size / ENCLOSURE_CELLS)))
    near = _wall_cells(clear, occupied, cell_m)
    kinds = np.where(clear, _CLEAR, np.where(near, _WALL, _UNSEEN)).astype(np.uint8)
    if scale > 1:
        kinds = kinds[scale // 2 :: scale, scale // 2 :: scale]
    rows, cols = kinds.shape
    side = int(np.ceil(np.hypot(rows, cols))) + 2
    total = np.zeros((rows, cols), np.float32)
    for k in range(DIRECTIONS // 2):
        turn = np.asarray(cv2.getRotationMatrix2D(((cols - 1) / 2, (rows - 1) / 2), 360.0 * k / DIRECTIONS, 1.0))
        turn[:, 2] += (side - cols) / 2, (side - rows) / 2
        turned = cv2.warpAffine(
            kinds, turn, (side, side), flags=cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=_BEYOND
        )
        seen = _votes(turned) + _votes(turned[:, ::-1])[:, ::-1]
        total += cv2.warpAffine(
            seen, turn, (cols, rows), flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE
        )
    beyond, walls = np.divmod(total, 100)
    share = np.where(beyond < DIRECTIONS, walls / np.maximum(DIRECTIONS - beyond, 1), 1.0).astype(np.float32)
    whole = share if scale == 1 else cv2.resize(share, clear.shape[::-1], interpolation=cv2.INTER_NEAREST)
    return np.where(clear, whole, 0).astype(np.float32)


def _votes(kinds: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Return what the line to the left of each cell (rows, cols) counts; the first column is not clear."""
    last = np.where(kinds == _CLEAR, 0, np.arange(kinds.shape[1], dtype=np.int32))
    np.maximum.accumulate(last, axis=1, out=last)
    return np.asarray(_VOTES[np.take_along_axis(kinds, last, axis=1)])


# Tell rooms from unreached spaces: closed blocks, and spaces that a robot saw through a window or a pane of glass.
#
# U1  Rooms joined by ways form a group. The largest group by area was reached, and so was each group of at least
#     ``SCARCELY`` of its area.
# U2  Unreached spaces are not rooms if together they are less than ``FEW`` of all rooms: the rooms that a robot drove
#     through hang together, so such a space is the inside of a wall or of furniture, or was seen through a pane. If
#     more is unreached, a person drew the map without its doors; then only spaces with ``SCARCELY`` of their edge or
#     more away from walls are not rooms.
# U3  A block that stands free in one room (a pillar, a counter, a box) is not a room, with all spaces closed in it.


def unreached_rooms(
    label: Labels, ways: Iterable[tuple[int, int]], occupied: Bools, outside: frozenset[int], cell_m: float
) -> frozenset[int]:
    """Return the numbers in ``label`` (rows, cols) that are not rooms by U2 and U3; ``ways`` are pairs of rooms."""
    area = np.bincount(label.ravel())
    rooms = set((1 + np.flatnonzero(area[1:])).tolist()) - outside
    joined = connected_groups(len(area), (pair for pair in ways if rooms.issuperset(pair)))
    groups = [group for group in joined if rooms.issuperset(group)]
    if len(groups) < 2:
        return frozenset()
    sizes = [int(area[group].sum()) for group in groups]
    apart = [number for group, size in zip(groups, sizes, strict=True) if size < max(sizes) for number in group]
    small = [k for group, size in zip(groups, sizes, strict=True) if size < SCARCELY * max(sizes) for k in group]
    if area[small].sum() >= FEW * sum(sizes):
        seen_in = open_shares(label, occupied, cell_m) >= SCARCELY
        small = [number for number in small if seen_in[number]]
    return frozenset(small) | _blocks(label, apart)


def _blocks(label: Labels, apart: list[int]) -> frozenset[int]:
    """U3: return which of some rooms lie in a block that stands free in another one."""
    other = (label > 0) & ~np.isin(label, apart)
    _, pieces, stats, _ = cv2.connectedComponentsWithStats((~other).view(np.uint8), connectivity=8)
    left, top, wide, high = stats[:, : cv2.CC_STAT_AREA].T
    inside = (left > 0) & (top > 0) & (left + wide < label.shape[1]) & (top + high < label.shape[0])
    found: set[int] = set()
    for number in apart:
        piece = int(pieces[label == number][0])
        if inside[piece]:
            box = np.s_[top[piece] - 1 : top[piece] + high[piece] + 1, left[piece] - 1 : left[piece] + wide[piece] + 1]
            block = pieces[box] == piece
            around = cv2.dilate(block.view(np.uint8), _SQUARE).view(bool) & ~block
            if len(np.unique(label[box][around])) == 1:
                found.add(number)
    return frozenset(found)


BETWEEN_M: Final = 0.4


def fill_between_rays(free: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the free cells (rows, cols) and the unseen ones between rays, ``BETWEEN_M`` wide at most.

    A ray is narrower than that: between two wide spaces, what is unseen is the inside of a wall.
    """
    size = 2 * round(BETWEEN_M / cell_m / 2) + 1
    disc = np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
    cells = free.view(np.uint8)
    wide = cv2.morphologyEx(cells, cv2.MORPH_OPEN, disc)
    closed, walls = (cv2.morphologyEx(each, cv2.MORPH_CLOSE, disc).view(bool) for each in (cells, wide))
    return np.asarray(free | (closed & ~walls & ~occupied))


def unseen_islands(clear: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the islands (rows, cols) of unseen space in ``clear`` space: floor at which nobody looked.

    Walls stand at less than ``QUARTER`` of their edge. Necks of ``NARROWEST_GAP_M`` or less join them to nothing.
    """
    size = 2 * max(round(NARROWEST_GAP_M / 2 / cell_m), 1) + 1
    disc = np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
    bare = cv2.copyMakeBorder((~clear).view(np.uint8), size, size, size, size, cv2.BORDER_CONSTANT, value=1)
    wide = cv2.morphologyEx(bare, cv2.MORPH_OPEN, disc)[size:-size, size:-size]
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(np.ascontiguousarray(wide), connectivity=4)
    left, top, across, down = stats[:, : cv2.CC_STAT_AREA].T
    island = (left > 0) & (top > 0) & (left + across < clear.shape[1]) & (top + down < clear.shape[0])
    island[0] = False
    reach = 2 * max(round(PARTITION_M / cell_m), 1) + 1
    near = cv2.dilate(occupied.view(np.uint8), np.ones((reach, reach), np.uint8)).view(bool)
    around = cv2.dilate(np.where(island[pieces], pieces, 0).astype(np.float32), _SQUARE).astype(np.int64)
    around[wide > 0] = 0
    edge, walled = (np.bincount(each, minlength=len(island)) for each in (around.ravel(), around[near]))
    found = (island & (walled < QUARTER * edge))[pieces].view(np.uint8)
    return np.asarray(cv2.dilate(found, disc).view(bool) & ~clear)


def with_scattered_cells(label: Labels, free: Bools, occupied: Bools, cell_m: float) -> Labels:
    """Return the labels (rows, cols), those of free cells without one from the nearest room, ``AROUND_M`` away at most.

    They are the ends of a fan of rays. Pieces of ``SPACE_M2`` or more are not.
    """
    left = free & (label == 0)
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(left.view(np.uint8), connectivity=8)
    scattered = stats[:, cv2.CC_STAT_AREA] * cell_m**2 < SPACE_M2
    scattered[0] = False
    if not scattered.any():
        return label
    return np.where(scattered[pieces], _grow(label, ~occupied, cell_m), label)


def _grow(label: Labels, through: Bools, cell_m: float) -> Labels:
    """Return the labels (rows, cols), grown by ``AROUND_M`` over cells ``through`` which they reach."""
    cross = np.asarray(cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)), np.uint8)
    small = np.uint16 if label.max(initial=0) <= np.iinfo(np.uint16).max else np.float32  # what OpenCV dilates
    grown: npt.NDArray[Any] = label.astype(small)
    bare: npt.NDArray[Any] = (through & (label == 0)).astype(small)
    for step in range(round(AROUND_M / cell_m)):
        wider = cv2.dilate(grown, _SQUARE if step % 2 else cross)
        np.multiply(wider, bare, out=wider)  # what has a label keeps it
        np.maximum(grown, wider, out=grown)
        np.copyto(bare, 0, where=wider > 0)
    return grown.astype(np.int32)
