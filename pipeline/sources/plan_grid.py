"""A coarse plan grid on which floors and walls are compared while levels are looked for (never what is cut)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Cells = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class PlanGrid:
    """Cells of ``size_m``; row and column count from ``origin`` (x, y) along +y and +x; masks are uint8 0 or 1."""

    origin: tuple[float, float]
    shape: tuple[int, int]
    size_m: float = 0.1

    @classmethod
    def over(cls, low: Floats, high: Floats, margin_m: float = 1.0, size_m: float = 0.1) -> PlanGrid:
        """Cover the rectangle from ``low`` (x, y) to ``high`` with a margin."""
        columns, rows = np.ceil((high - low + 2 * margin_m) / size_m).astype(int) + 1
        return cls((float(low[0]) - margin_m, float(low[1]) - margin_m), (int(rows), int(columns)), size_m)

    def blank(self) -> Cells:
        """Return an empty mask."""
        return np.zeros(self.shape, np.uint8)

    def area(self, mask: Cells) -> float:
        """Area of a mask in m2."""
        return float(np.count_nonzero(mask)) * self.size_m**2

    def cover(self, triangles: Floats) -> Cells:
        """Mask of plan triangles (k, 3, 2): large ones are painted, small ones mark the cell of their centre."""
        mask = self.blank()
        small = np.ptp(triangles, axis=1).max(axis=1, initial=0.0) <= self.size_m
        self._mark(mask, triangles[small].mean(axis=1))
        large = np.round(self._cells(triangles[~small])).clip(-(1 << 20), 1 << 20).astype(np.int32)
        for triangle in large:
            cv2.fillConvexPoly(mask, triangle, 1)
        return mask

    def trace(self, segments: Floats) -> Cells:
        """Mask of the cells that plan segments (k, 2, 2) run through."""
        mask = self.blank()
        length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
        count = np.ceil(length / (self.size_m / 2)).astype(int) + 1
        owner = np.repeat(np.arange(len(segments)), count)
        step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        share = (step / np.maximum(count[owner] - 1, 1))[:, None]
        self._mark(mask, segments[owner, 0] * (1 - share) + segments[owner, 1] * share)
        return mask

    def at(self, mask: Cells, points: Floats) -> Bools:
        """Tell which plan points (k, 2) lie on the mask."""
        column, row = np.round(self._cells(points)).astype(np.int64).T
        inside = self._within(row, column)
        inside[inside] = mask[row[inside], column[inside]] > 0
        return inside

    def grown(self, mask: Cells, radius_m: float) -> Cells:
        """Cells within a radius of the mask."""
        return np.asarray(cv2.dilate(mask, self._disc(radius_m)), np.uint8)

    def opened(self, mask: Cells, radius_m: float) -> Cells:
        """Drop what is narrower than a disc of the radius."""
        return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, self._disc(radius_m)), np.uint8)

    def closed(self, mask: Cells, radius_m: float) -> Cells:
        """Fill gaps narrower than a disc of the radius."""
        return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, self._disc(radius_m)), np.uint8)

    def _disc(self, radius_m: float) -> Cells:
        side = 2 * round(radius_m / self.size_m) + 1
        return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)), np.uint8)

    def _cells(self, points: Floats) -> Floats:
        cells: Floats = (points - np.asarray(self.origin)) / self.size_m - 0.5
        return cells

    def _within(self, row: Indices, column: Indices) -> Bools:
        inside: Bools = (row >= 0) & (row < self.shape[0]) & (column >= 0) & (column < self.shape[1])
        return inside

    def _mark(self, mask: Cells, points: Floats) -> None:
        column, row = np.round(self._cells(points)).astype(np.int64).T
        inside = self._within(row, column)
        mask[row[inside], column[inside]] = 1
