"""Tell rooms from spaces that no way leads to: closed blocks, and what a robot saw through a window or a pane of glass.

R1  The rooms that ways join are one group. The largest group by area was reached, and all that is as large as ``SMALL``
    of it or larger.
R2  What else no way leads to is no room where all of it is less than ``FEW`` of all rooms: what a robot drove through
    hangs together, and such a space is the inside of a wall or of a piece of furniture, or was seen through a pane.
    Where more is closed, a person drew the map without its doors. Then only those are no rooms of which ``OPEN`` of
    the edge or more is at no wall.
R3  A block that stands free in one room is no room: a pillar, a counter, or a box. All that is closed in it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import cv2
import numpy as np

from pipeline.geometry.groups import connected_groups
from pipeline.sources.occupancy_map.enclosure import open_shares
from pipeline.sources.occupancy_map.narrow_places import Bools, Labels

SMALL: Final = 0.1
FEW: Final = 0.2
OPEN: Final = 0.1
_SQUARE: Final = np.ones((3, 3), np.uint8)


def unreached_rooms(
    label: Labels, ways: Iterable[tuple[int, int]], occupied: Bools, outside: frozenset[int], cell_m: float
) -> frozenset[int]:
    """Return the rooms of a ``label`` (rows, cols) that are none by R2 and R3; ``ways`` are pairs of rooms."""
    area = np.bincount(label.ravel())
    rooms = set((1 + np.flatnonzero(area[1:])).tolist()) - outside
    joined = connected_groups(len(area), (pair for pair in ways if rooms.issuperset(pair)))
    groups = [group for group in joined if rooms.issuperset(group)]
    if len(groups) < 2:
        return frozenset()
    sizes = [int(area[group].sum()) for group in groups]
    apart = [number for group, size in zip(groups, sizes, strict=True) if size < max(sizes) for number in group]
    small = [k for group, size in zip(groups, sizes, strict=True) if size < SMALL * max(sizes) for k in group]
    if area[small].sum() >= FEW * sum(sizes):
        seen_in = open_shares(label, occupied, cell_m) >= OPEN
        small = [number for number in small if seen_in[number]]
    return frozenset(small) | _blocks(label, apart)


def _blocks(label: Labels, apart: list[int]) -> frozenset[int]:
    """R3: return which of some rooms lie in a block that stands free in another one."""
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
