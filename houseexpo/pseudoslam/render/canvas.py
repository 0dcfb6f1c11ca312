"""A canvas over a grid of cells: smooth shapes, given in the grid's pixels, on squares of whole pixels."""

from __future__ import annotations

import math
from typing import TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError

Image: TypeAlias = npt.NDArray[np.uint8]
Points: TypeAlias = npt.NDArray[np.float64]
Colour: TypeAlias = tuple[int, int, int]

_BITS = 4  # OpenCV takes fixed-point places


def scale_for(shape: tuple[int, ...], most_px: tuple[int, int]) -> float:
    """Return pixels a cell, a whole number or one by a whole number, so that (rows, cols) are at most so (wide, high).

    ConfigError where there is no room for a pixel.
    """
    (rows, cols), (wide, high) = shape, most_px
    if min(wide, high) < 1:
        raise ConfigError(f"picture: expected room for a pixel at least, found {wide} x {high}")
    times = min(wide // cols, high // rows)
    return float(times) if times >= 1 else 1.0 / max(math.ceil(cols / wide), math.ceil(rows / high))


def scaled(
    cells: npt.NDArray[np.uint8], priority: npt.NDArray[np.uint8], most_px: tuple[int, int]
) -> tuple[float, npt.NDArray[np.uint8]]:
    """Return pixels a cell, and cells (rows, cols) of small numbers at that scale, at most so (wide, high).

    Cells become squares of whole pixels; or a pixel stands for a square of cells, for the one of them with the highest
    ``priority[number]``.
    """
    scale = scale_for(cells.shape, most_px)
    if scale >= 1:
        return scale, cells.repeat(int(scale), axis=0).repeat(int(scale), axis=1)
    (rows, cols), share = cells.shape, round(1 / scale)
    ranks = np.zeros((math.ceil(rows / share) * share, math.ceil(cols / share) * share), np.uint8)
    ranks[:rows, :cols] = priority[cells]
    blocks = ranks.reshape(len(ranks) // share, share, -1, share)
    return scale, np.argsort(priority).astype(np.uint8)[blocks.max(axis=(1, 3))]


class Canvas:
    """An image (rows, cols, 3) that is drawn on, ``scale`` of its pixels a pixel of the grid."""

    def __init__(self, image: Image, scale: float) -> None:
        self.image, self.scale = np.ascontiguousarray(image), scale

    def blob(self, corners: Points, radius: float, colour: Colour) -> None:
        """Fill a polygon (n, 2) that is grown by a radius; of one corner, a disc."""
        if len(corners) > 1:
            cv2.fillPoly(self.image, [self._fixed(corners)], colour, cv2.LINE_AA, _BITS)
            self.line(np.vstack([corners, corners[:1]]), 2 * radius, colour)
        for x, y in self._fixed(corners).tolist():
            cv2.circle(
                self.image, (x, y), round(radius * self.scale * 2**_BITS), colour, cv2.FILLED, cv2.LINE_AA, _BITS
            )

    def line(self, points: Points, width: float, colour: Colour) -> None:
        """Draw a line through points (n, 2), a pixel wide at least."""
        thick = max(round(width * self.scale), 1)
        cv2.polylines(self.image, [self._fixed(points)], False, colour, thick, cv2.LINE_AA, _BITS)

    def tint(self, corners: Points, colour: Colour, share: float, where: npt.NDArray[np.bool_]) -> None:
        """Lay a share of a colour over a polygon (n, 2), where the image's pixels (rows, cols) are to take it."""
        mask = np.zeros(self.image.shape[:2], np.uint8)
        cv2.fillPoly(mask, [self._fixed(corners)], 255, cv2.LINE_AA, _BITS)
        mask[~where] = 0
        left, top, width, height = cv2.boundingRect(mask)
        part = self.image[top : top + height, left : left + width]
        weight = mask[top : top + height, left : left + width, None] * np.float32(share / 255)
        part[:] = np.rint(part + weight * (np.array(colour, np.float32) - part)).astype(np.uint8)

    def _fixed(self, points: Points) -> npt.NDArray[np.int32]:
        """Return OpenCV's places: the middle of a pixel is a whole number."""
        places: npt.NDArray[np.int32] = np.rint((points * self.scale - 0.5) * 2**_BITS).astype(np.int32)
        return places
