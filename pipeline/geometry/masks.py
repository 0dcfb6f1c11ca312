"""Masks on a raster: grown, closed, opened, and the parts of them that meet something."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

Bools = npt.NDArray[np.bool_]
Pixels = npt.NDArray[np.uint8]

SHEET = 3
"""So many cells wide a sheet must be, if it is to last."""


def square(cells: int) -> Pixels:
    """A square as the kernel of a filter."""
    return np.ones((cells, cells), np.uint8)


def line(angle: float, cells: int) -> Pixels:
    """A straight line, so many cells long, as the kernel of a filter."""
    half = (cells + 1) // 2
    x, y = (round(half * float(v)) for v in (np.cos(angle), np.sin(angle)))
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.uint8)
    cv2.line(kernel, (half - x, half - y), (half + x, half + y), 1)
    return kernel


def grown(mask: Bools, cells: int) -> Bools:
    """A mask and all cells at most so far from it."""
    return dilated(mask, square(2 * cells + 1))


def dilated(mask: Bools, kernel: Pixels) -> Bools:
    """A mask drawn with a kernel."""
    return np.asarray(cv2.dilate(mask.view(np.uint8), kernel).view(bool))


def closed(mask: Bools, cells: int) -> Bools:
    """A mask with all that is narrower than so many cells filled."""
    return np.asarray(cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_CLOSE, square(cells)).view(bool))


def opened(mask: Bools, kernel: Pixels) -> Bools:
    """A mask without all that a kernel does not fit into."""
    return np.asarray(cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, kernel).view(bool))


def mostly(mask: Bools, marked: Bools, share: float) -> Bools:
    """The connected parts of a mask of which so much is marked."""
    count, label = cv2.connectedComponents(mask.view(np.uint8), connectivity=8)
    kept = np.bincount(label[mask & marked], minlength=count) >= share * np.bincount(label[mask], minlength=count)
    return np.asarray(kept[label] & mask)


def touching(mask: Bools, marked: Bools) -> Bools:
    """The connected parts of a mask that share a cell with another."""
    count, label = cv2.connectedComponents(mask.view(np.uint8), connectivity=8)
    kept = np.bincount(label[mask & marked], minlength=count) > 0
    return np.asarray(kept[label] & mask)
