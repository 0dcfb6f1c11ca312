"""Walls and the free places in them, from the columns of a scan: masks on its raster.

R1  What reaches the top of the walls, above doors, furniture and open leaves, is wall or hangs over a doorway.
R2  A part of every scan is missing: holes in the walls are closed (``geometry.scan_holes``).
R3  Two faces with no more than a wall between them are the two sides of one.
R4  Around all that is inside stands an outer wall, also where none was seen.
R5  A region between walls in which no ground was seen is no room, and filled, if the scan has ground elsewhere.
R6  A doorway is a place in a wall where nothing stands from the floor to head height, as long as a door is wide, with
    air of the house on both sides: the place of a window or of a door to the outside has a back.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import scipy.ndimage

from pipeline.geometry.masks import SHEET, closed, grown, opened, square
from pipeline.geometry.scan_columns import SPREAD, Bools, Columns, Floats, Raster
from pipeline.geometry.scan_holes import without_holes

FOOT_M, HEAD_M = 0.2, 1.85
TOP_BAND_M = 0.2
RIM_M = 0.04
"""So much of the top is frayed."""
MIN_TOP_M = 2.0
CEILING_BAND_M = 0.1
"""Where the ceiling was seen, all that reaches it is wall, and a lintel may be as low as this."""
TALL_BAND_M, ABOVE_DOORS_M = 0.45, 2.2
"""In a high house, more of the wall can be looked at above all doors."""
FULL = 0.5
STANDS = 0.4
PASSED = 0.15
"""In a doorway stands something in less than this share of the heights (noise, a threshold, the edge of a leaf)."""
WALL_M = 0.38
OUTER_M = 0.2
LEAK_M = 1.0
SEEN = 0.3
SHORTEST_M = 0.5
SPECK_M = 0.3
RIMMED = 0.4
HALF = 0.5
FILLED = 0.6
BEFORE = 4
"""So many cells before a wall its air is looked at."""


@dataclass(frozen=True, eq=False)
class WallMasks:
    """``walls`` (rows, columns) with all doorways closed, and the ``doorways``: rectangles (4, 2) of pixels (x, y)."""

    raster: Raster
    walls: Bools
    doorways: tuple[Floats, ...]


def top_of_walls(columns: Columns) -> float:
    """Up to which height (m) walls stand: above it, far less is seen than in the middle of the house."""
    amount = columns.amount
    middle = np.median(amount[columns.heights < HEAD_M]) if len(amount) else 0.0
    high = columns.heights[amount > RIMMED * middle]
    return float(high.max()) if len(high) else 0.0


def wall_masks(columns: Columns) -> WallMasks:
    """Judge all columns."""
    raster, top = columns.raster, columns.ceiling_m or top_of_walls(columns) - RIM_M
    body = columns.share(FOOT_M, HEAD_M)
    if columns.ceiling_m is not None:
        lowest = top - CEILING_BAND_M
    else:
        lowest = max(top - TOP_BAND_M, min(MIN_TOP_M, top - RIM_M))
    high = columns.share(lowest, top) >= FULL
    if lowest > ABOVE_DOORS_M:
        high |= columns.share(max(top - TALL_BAND_M, ABOVE_DOORS_M), top) >= FULL
    reaching = _without_specks(high, raster)  # R1
    seen = (body >= PASSED) | (columns.share(lowest, top) > 0)
    reaching = without_holes(reaching, body >= STANDS, seen, raster, has_ceiling=columns.ceiling_m is not None)  # R2
    thick = closed(reaching, raster.size(WALL_M))  # R3
    outside = _outside(thick | columns.ground | (body >= STANDS), raster)
    band = outside & grown(~outside, raster.size(OUTER_M))  # R4
    house = closed(thick | band, raster.size(WALL_M))
    solid = house | _unseen(~(house | outside), columns)  # R5
    standing = closed((body >= PASSED) & thick, raster.size(WALL_M)) & thick
    behind = grown(standing, raster.size(OUTER_M)) & solid & ~thick
    free = solid & ~(standing | behind)
    walls = _shrunk(solid)
    return WallMasks(raster, walls, _doorways(free & walls, ~(walls | outside), raster))  # R6


def _without_specks(mask: Bools, raster: Raster) -> Bools:
    """Without what is shorter than any wall."""
    count, label, boxes, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    long = np.maximum(boxes[:, cv2.CC_STAT_WIDTH], boxes[:, cv2.CC_STAT_HEIGHT]) >= raster.size(SPECK_M)
    long[0] = False
    return np.asarray(long[label]) if count else mask


def _outside(inside: Bools, raster: Raster) -> Bools:
    """R4: the air around the house, entered through nothing that is narrower than ``LEAK_M``."""
    half = raster.size(LEAK_M / 2)
    air = (~grown(inside, half)).view(np.uint8)
    _, label = cv2.connectedComponents(np.pad(air, 1, constant_values=1), connectivity=4)
    around = (label == label[0, 0])[1:-1, 1:-1]
    return grown(around, half) & ~inside


def _unseen(air: Bools, columns: Columns) -> Bools:
    """R5; where little ground was seen at all, it says nothing."""
    if not air.any() or columns.ground[air].mean() < SEEN:
        return np.zeros_like(air)
    count, label = cv2.connectedComponents(air.view(np.uint8), connectivity=4)
    share = scipy.ndimage.mean(columns.ground, label, np.arange(count))
    hidden = np.asarray(share) < SEEN
    hidden[0] = False
    return np.asarray(hidden[label])


def _shrunk(solid: Bools) -> Bools:
    """Drawn in by what noise and raster have spread the faces; a lone sheet, which would vanish, is kept."""
    core = opened(cv2.erode(solid.view(np.uint8), square(2 * SPREAD + 1)).view(bool), square(SHEET)).view(bool)
    return core | (solid & ~grown(core, SPREAD + 1))


def _doorways(free: Bools, air: Bools, raster: Raster) -> tuple[Floats, ...]:
    """R6."""
    count, label, boxes, _ = cv2.connectedComponentsWithStats(free.view(np.uint8), connectivity=4)
    found = []
    for k in range(1, count):
        x, y, w, h, pixels = (int(v) for v in boxes[k])
        if max(w, h) < raster.size(SHORTEST_M):
            continue
        box = _box(np.argwhere(label[y : y + h, x : x + w] == k)[:, ::-1] + (x, y), pixels)
        if all(_share(air, side) > HALF for side in _sides(box)):
            found.append(_stretched(box))
    return tuple(found)


def _box(points: npt.NDArray[np.int64], pixels: int) -> Floats:
    """The rectangle (4, 2) around pixels, long side first: along the raster if they fill it well, else the smallest."""
    low, high = points.min(axis=0), points.max(axis=0)
    (x1, y1), (x2, y2) = low, high
    box = np.array([[x1, y1], [x2, y1], [x2, y2], [x1, y2]], float)
    if pixels < FILLED * np.prod(high - low + 1):
        box = np.asarray(cv2.boxPoints(cv2.minAreaRect(points.astype(np.float32))), float)
    return box if np.hypot(*(box[1] - box[0])) >= np.hypot(*(box[2] - box[1])) else np.roll(box, -1, axis=0)


def _sides(box: Floats) -> tuple[Floats, Floats]:
    """The middle lines (2, 2) of what lies before each long side."""
    across = box[3] - box[0]
    off = BEFORE * across / max(float(np.hypot(*across)), 1e-9) if across.any() else np.array([0.0, BEFORE])
    return box[:2] - off, box[2:] + off


def _share(mask: Bools, line: Floats) -> float:
    """The share of a line that lies in a mask."""
    points = np.round(np.linspace(line[0], line[1], 20)).astype(int)
    rows, columns = np.clip(points[:, 1], 0, mask.shape[0] - 1), np.clip(points[:, 0], 0, mask.shape[1] - 1)
    return float(mask[rows, columns].mean())


def _stretched(box: Floats) -> Floats:
    """From jamb to jamb: faces were spread by so much along the wall, and the wall may bulge across."""
    centre = box.mean(axis=0)
    along, across = box[1] - box[0], box[3] - box[0]
    length, depth = float(np.hypot(*along)), float(np.hypot(*across))
    along /= length
    across = np.array([-along[1], along[0]])
    half_along, half_across = along * (length / 2 + SPREAD), across * (depth / 2 + 2 * SPREAD)
    return np.array([centre + i * half_along + j * half_across for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
