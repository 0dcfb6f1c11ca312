"""Scale a grid of cells to an image, and draw antialiased shapes on it, whose coordinates are those of the grid."""

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

_FRACTION_BITS = 4  # fractional bits of OpenCV's fixed-point coordinates


def scale_for(shape: tuple[int, ...], most_px: tuple[int, int]) -> float:
    """Return pixels per cell, n or 1/n for a whole number n, so that (rows, cols) fit into ``most_px`` (width, height).

    Raise ConfigError if there is no space for a pixel.
    """
    (rows, cols), (wide, high) = shape, most_px
    if min(wide, high) < 1:
        raise ConfigError(f"picture: expected a size of at least one pixel, found {wide} x {high}")
    times = min(wide // cols, high // rows)
    return float(times) if times >= 1 else 1.0 / max(math.ceil(cols / wide), math.ceil(rows / high))


def scale_cells(
    cells: npt.NDArray[np.uint8], priority: npt.NDArray[np.uint8], most_px: tuple[int, int]
) -> tuple[float, npt.NDArray[np.uint8]]:
    """Return pixels per cell, and the cells (rows, cols) at that scale, which fit into ``most_px`` (width, height).

    Either cells become squares of whole pixels, or a pixel stands for a square of cells and shows the one with the
    highest ``priority[number]``.
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
    """An image (rows, cols, 3) to draw on, with ``scale`` pixels per cell of the grid."""

    def __init__(self, image: Image, scale: float) -> None:
        self.image, self.scale = np.ascontiguousarray(image), scale

    def blob(self, corners: Points, radius: float, colour: Colour) -> None:
        """Fill a polygon (n, 2) that is enlarged by a radius; with one corner, a disc."""
        if len(corners) > 1:
            cv2.fillPoly(self.image, [self._fixed_point(corners)], colour, cv2.LINE_AA, _FRACTION_BITS)
            self.line(np.vstack([corners, corners[:1]]), 2 * radius, colour)
        for x, y in self._fixed_point(corners).tolist():
            cv2.circle(
                self.image,
                (x, y),
                round(radius * self.scale * 2**_FRACTION_BITS),
                colour,
                cv2.FILLED,
                cv2.LINE_AA,
                _FRACTION_BITS,
            )

    def line(self, points: Points, width: float, colour: Colour) -> None:
        """Draw a line through points (n, 2), at least one pixel wide."""
        thick = max(round(width * self.scale), 1)
        cv2.polylines(self.image, [self._fixed_point(points)], False, colour, thick, cv2.LINE_AA, _FRACTION_BITS)

    def tint(self, corners: Points, colour: Colour, share: float, where: npt.NDArray[np.bool_]) -> None:
        """Blend a share of a colour into a polygon (n, 2), for the pixels in the mask ``where`` (rows, cols)."""
        mask = np.zeros(self.image.shape[:2], np.uint8)
        cv2.fillPoly(mask, [self._fixed_point(corners)], 255, cv2.LINE_AA, _FRACTION_BITS)
        mask[~where] = 0
        left, top, width, height = cv2.boundingRect(mask)
        part = self.image[top : top + height, left : left + width]
        weight = mask[top : top + height, left : left + width, None] * np.float32(share / 255)
        part[:] = np.rint(part + weight * (np.array(colour, np.float32) - part)).astype(np.uint8)

    def _fixed_point(self, points: Points) -> npt.NDArray[np.int32]:
        """Return points in OpenCV's coordinates, in which the centre of a pixel is a whole number."""
        places: npt.NDArray[np.int32] = np.rint((points * self.scale - 0.5) * 2**_FRACTION_BITS).astype(np.int32)
        return places
