"""Correct the rooms of a map by its rays: where the robot saw single rays, cells between them are unseen, not taken.

R1  Free cells that no room has belong to the nearest room, ``AROUND_M`` away at most, around what is occupied. They
    are the ends of a fan of rays. Pieces of ``SPACE_M2`` or more are not.
R2  What is unseen between rays, ``BETWEEN_M`` wide at most, is as open as they are, unless it is occupied. A ray is
    narrower than that: between two wide spaces, what is unseen is the inside of a wall.
R3  An island of unseen space, with walls at less than ``QUARTER`` of its edge, is floor at which nobody looked. Necks
    of ``NARROWEST_GAP_M`` or less join it to nothing.
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

BETWEEN_M: Final = 0.4
_SQUARE: Final = np.ones((3, 3), np.uint8)


def fill_between_rays(free: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the free cells (rows, cols) and those between them of R2."""
    size = 2 * round(BETWEEN_M / cell_m / 2) + 1
    disc = np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
    cells = free.view(np.uint8)
    wide = cv2.morphologyEx(cells, cv2.MORPH_OPEN, disc)
    closed, walls = (cv2.morphologyEx(each, cv2.MORPH_CLOSE, disc).view(bool) for each in (cells, wide))
    return np.asarray(free | (closed & ~walls & ~occupied))


def unseen_islands(clear: Bools, occupied: Bools, cell_m: float) -> Bools:
    """Return the cells (rows, cols) of R3 around which there is ``clear`` space."""
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
    """Return the labels (rows, cols) with the free cells of R1."""
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
