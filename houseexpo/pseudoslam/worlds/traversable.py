"""The cells where the robot can stand and go, and the pieces of free space with such cells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

Cells = npt.NDArray[np.uint8]

_FREE, _REACHED = 1, 2


def traversable_cells(occupied: Cells, radius_px: float) -> Cells:
    """Return 1 for cells around whose centre a disc is free, in the largest piece of such cells (4-connected).

    Of pieces of equal size, the one with the first cell in row order is used.
    """
    import cv2

    if 2 * radius_px > min(occupied.shape):
        return np.zeros_like(occupied)
    taken = np.zeros_like(occupied)
    for rows, cols in _rectangles(radius_px):
        square = np.ones((rows, cols), np.uint8)
        nearby = cv2.dilate(occupied, square, borderType=cv2.BORDER_CONSTANT, borderValue=1)
        np.bitwise_or(taken, nearby, out=taken)
    return _biggest_piece(_where(taken, 0))


def pieces_with(traversable: Cells, occupied: Cells) -> Cells:
    """Return 1 in the pieces of free space (4-connected) where the robot can stand; it cannot see other pieces."""
    image = _where(occupied, 0)
    standing, start = traversable, int(traversable.argmax())
    while standing.flat[start]:  # usually once
        _flood(image, start)
        standing = traversable & (image == _FREE)
        start = int(standing.argmax())
    return _where(image, _REACHED)


def _rectangles(radius_px: float) -> Iterator[tuple[int, int]]:
    """Yield rows and columns of rectangles that together form a disc (by near sides of cells), for fast dilation."""
    offsets = np.maximum(np.arange(math.ceil(radius_px) + 1) - 0.5, 0.0)  # distance to the near side of a cell
    wide = (np.hypot(offsets[:, None], offsets) < radius_px - 1e-9).sum(axis=1).tolist()  # including the middle one
    for away, (here, next_row) in enumerate(zip(wide, [*wide[1:], 0], strict=True)):
        if here > next_row:
            yield 2 * away + 1, 2 * here - 1


def _biggest_piece(image: Cells) -> Cells:
    """Return 1 in the largest piece of the cells that are 1."""
    import cv2

    cells = int(np.count_nonzero(image))
    if not cells:
        return image
    flooded = image.copy()
    if 2 * _flood(flooded, int(image.argmax())) >= cells:  # usually there is only one
        return _where(flooded, _REACHED)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(image, connectivity=4)
    return _where(labels, 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()))


def _flood(image: Cells, start: int) -> int:
    """Set the piece of equal cells at a flat index to ``_REACHED``; return its number of cells."""
    import cv2

    rows, cols = image.shape
    row, col = divmod(start, cols)
    beside = np.zeros((rows + 2, cols + 2), np.uint8)
    return int(cv2.floodFill(image, beside, (col, row), _REACHED, flags=4)[0])


def _where(values: npt.NDArray[Any], value: int) -> Cells:
    """Return 1 for cells with this value, 0 elsewhere."""
    found: Cells = (values == value).view(np.uint8)
    return found
