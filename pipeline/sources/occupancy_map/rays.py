"""Correct the rooms of a map by its rays: where the robot saw single rays, cells between them are unseen, not taken.

R1  Through a window, a robot sees rays that end at nothing. What has fewer than ``FREE`` of its cells free, and less
    than ``QUARTER`` of its edge at occupied cells, is no room but outside.
R2  Free cells that no room has belong to the nearest room, ``AROUND_M`` away at most, around what is occupied. They
    are the ends of a fan of rays. Pieces of ``SPACE_M2`` or more are outside, as in R1.
R3  What is unseen between rays, ``BETWEEN_M`` wide at most, is as open as they are, unless it is occupied. A ray is
    narrower than that: between two wide spaces, what is unseen is the inside of a wall.
R5  An island of unseen space, with walls at less than ``QUARTER`` of its edge, is floor at which nobody looked. Necks
    of ``NARROWEST_GAP_M`` or less join it to nothing.
R4  A cell that few rays passed is likely free, not surely. It belongs to the room whose cells it touches, itself or by
    other such cells, ``AROUND_M`` away at most. So it never joins rooms. Beside an occupied cell, its shade is that
    of both, in a picture that was scaled: it is left out.
"""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.sources.occupancy_map.enclosure import SPACE_M2
from pipeline.sources.occupancy_map.gaps import NARROWEST_GAP_M
from pipeline.sources.occupancy_map.narrow_places import Bools, Labels
from pipeline.sources.tolerances import QUARTER
from pipeline.tolerances import AROUND_M, PARTITION_M

FREE: Final = 0.65
BETWEEN_M: Final = 0.4
_SQUARE: Final = np.ones((3, 3), np.uint8)


def rooms_of_rays(label: Labels, free: Bools, occupied: Bools, cell_m: float) -> npt.NDArray[np.int64]:
    """Return the numbers of the rooms that R1 takes for outside; all arrays are (rows, cols), cells ``cell_m`` wide."""
    count = int(label.max(initial=0)) + 1
    reach = 2 * max(round(PARTITION_M / cell_m), 1) + 1  # R1: the wall of a room is so near
    near = cv2.dilate(occupied.view(np.uint8), np.ones((reach, reach), np.uint8)).view(bool)
    rim = cv2.dilate(label.astype(np.float32), _SQUARE)
    rim[label > 0] = 0
    edge, walled = (np.bincount(rim[rim > 0].astype(np.int64), minlength=count) for rim in (rim, rim[near]))
    area, seen = (np.bincount(cells[cells > 0], minlength=count) for cells in (label, label[free]))
    few = (walled < QUARTER * edge) & (seen < FREE * area)
    few[0] = False
    return np.flatnonzero(few)


def fill_between_rays(free: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the free cells (rows, cols) and those between them of R3."""
    size = 2 * round(BETWEEN_M / cell_m / 2) + 1
    disc = np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
    cells = free.view(np.uint8)
    wide = cv2.morphologyEx(cells, cv2.MORPH_OPEN, disc)
    closed, walls = (cv2.morphologyEx(each, cv2.MORPH_CLOSE, disc).view(bool) for each in (cells, wide))
    return np.asarray(free | (closed & ~walls & ~occupied))


def unseen_islands(clear: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the cells (rows, cols) of R5 around which there is ``clear`` space."""
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
    """Return the labels (rows, cols) with the free cells of R2."""
    left = free & (label == 0)
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(left.view(np.uint8), connectivity=8)
    scattered = stats[:, cv2.CC_STAT_AREA] * cell_m**2 < SPACE_M2
    scattered[0] = False
    if not scattered.any():
        return label
    return np.where(scattered[pieces], _grow(label, ~occupied, cell_m), label)


def with_likely_cells(label: Labels, likely: Bools, occupied: Bools, cell_m: float) -> Labels:
    """Return the labels (rows, cols) with the cells of R4; ``likely`` (rows, cols) are those that are likely free."""
    if not likely.any():
        return label
    return _grow(label, likely & ~cv2.dilate(occupied.view(np.uint8), _SQUARE).view(bool), cell_m)


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
