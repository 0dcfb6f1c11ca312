"""Measure the upright and level faces of a mesh, the wall length at each height, and plan areas on a grid of cells."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.sources.tolerances import FEW, FILE_GRID_M, GRID_CELL_M, HORIZONTAL, SCARCELY, TINY, VERTICAL
from pipeline.tolerances import AROUND_M, CM_M, HAND_M, HARDLY, MOST, SAME, SPECK
from pipeline.values import Mesh

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MAX_BINS = 100_000
CHUNK = 1 << 18


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Per face, each of shape (m,): area (m2), unit normal (m, 3), lowest and highest corner (m, 3)."""

    mesh: Mesh
    area: Floats
    normal: Floats
    low: Floats
    high: Floats

    @classmethod
    def of(cls, mesh: Mesh) -> Surfaces:
        """Measure each face. Faces are read in chunks, so that millions of them need little memory."""
        n = len(mesh.faces)
        area, normal, low, high = np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
        for start in range(0, n, CHUNK):
            part = slice(start, start + CHUNK)
            corners = mesh.vertices[mesh.faces[part]]
            cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            double = np.linalg.norm(cross, axis=1)
            area[part] = double / 2
            normal[part] = cross / np.maximum(double, np.finfo(float).tiny)[:, None]
            low[part], high[part] = corners.min(axis=1), corners.max(axis=1)
        return cls(mesh, area, normal, low, high)

    def walls(self, axis: int = 2) -> Bools:
        """Faces that stand upright when ``axis`` points up."""
        return (np.abs(self.normal[:, axis]) < VERTICAL) & (self.area > 0) & self._tall(axis)

    def flats(self, axis: int = 2) -> Bools:
        """Faces that lie level when ``axis`` points up, whichever way they are wound."""
        return np.abs(self.normal[:, axis]) > HORIZONTAL

    def _tall(self, axis: int) -> Bools:
        return self.high[:, axis] - self.low[:, axis] > FILE_GRID_M

    def triangles(self, faces: Bools) -> Floats:
        """Corners (k, 3, 3) of the chosen faces."""
        return self.mesh.vertices[self.mesh.faces[faces]]


@dataclass(frozen=True, eq=False)
class WallProfile:
    """Plan length of wall faces over height: ``length[i]`` is the mean over ``edges[i]`` to ``edges[i + 1]``.

    ``top`` is the exact height of the highest wall.
    """

    edges: Floats
    length: Floats
    top: float

    @classmethod
    def of(cls, surfaces: Surfaces, walls: Bools, axis: int = 2, step: float = CM_M) -> WallProfile:
        """Integrate each wall's plan length (its area over its height) between the edges, exactly."""
        low, high = surfaces.low[walls, axis], surfaces.high[walls, axis]
        length = surfaces.area[walls] / (high - low)
        step = max(step, float(high.max() - low.min()) / MAX_BINS)
        edges = np.arange(low.min() - step, high.max() + 2 * step, step)
        below = _ramp_sum(edges, low, length) - _ramp_sum(edges, high, length)
        return cls(edges, np.maximum(np.diff(below) / step, 0.0), float(high.max()))

    @property
    def usual(self) -> float:
        """Return the middle of the lengths at heights where walls stand."""
        return float(np.median(self.length[self.length > SCARCELY * self.length.max()]))  # where walls barely stand

    def length_at(self, height: float) -> float:
        """Plan length of the walls at a height, 0 outside of the profile."""
        step = int(np.searchsorted(self.edges, height, side="right")) - 1
        return float(self.length[step]) if 0 <= step < len(self.length) else 0.0

    def end_above(self, height: float, foot: float) -> float:
        """Height over ``height`` at which the walls from ``foot`` up to it have ended, all but a chimney or a gable."""
        usual = float(np.median(self.length[(self.edges[:-1] >= foot) & (self.edges[1:] <= height)]))
        # walls may end a little under the height that they reach at least
        # the walls of a storey end where little of their usual length goes on
        ended = (self.edges[:-1] >= height - HAND_M) & (self.length < FEW * usual)  # no walls of a storey stand there
        return float(min(self.edges[np.flatnonzero(ended)[0]], self.top)) if ended.any() else self.top


def _ramp_sum(at: Floats, start: Floats, weight: Floats) -> Floats:
    """Sum of weight * max(at - start, 0) over all starts, for sorted ``at``."""
    slot = np.searchsorted(at, start, side="left")
    slope = np.cumsum(np.bincount(slot, weight, minlength=len(at) + 1)[: len(at)])
    offset = np.cumsum(np.bincount(slot, weight * start, minlength=len(at) + 1)[: len(at)])
    return at * slope - offset


def cut_at_height(surfaces: Surfaces, walls: Bools, height: float) -> Floats:
    """Segments (k, 2, 2) in plan where the chosen faces cross a height; faces that only touch it give none."""
    return cut_faces_at_height(surfaces, walls, height)[0]


def cut_faces_at_height(surfaces: Surfaces, walls: Bools, height: float) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return the segments that ``cut`` gives, and the face (k,) that each is of."""
    crossed = walls & (surfaces.low[:, 2] < height) & (surfaces.high[:, 2] > height)
    corners = surfaces.triangles(crossed)
    order = np.argsort(corners[:, :, 2], axis=1)
    bottom, middle, top = (np.take_along_axis(corners, order[:, i, None, None], axis=1)[:, 0] for i in range(3))
    below = (middle[:, 2] > height)[:, None]
    ends = _at(bottom, top, height), _at(np.where(below, bottom, middle), np.where(below, middle, top), height)
    return np.stack(ends, axis=1)[:, :, :2], np.flatnonzero(crossed)


def _at(start: Floats, end: Floats, height: float) -> Floats:
    rise = end[:, 2] - start[:, 2]
    share = np.divide(height - start[:, 2], rise, out=np.zeros_like(rise), where=rise > 0)
    return start + share[:, None] * (end - start)


def weighted_quantile(values: Floats, weights: Floats, share: float) -> float:
    """Return the smallest value that at least this share of the weight does not exceed."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order[min(int(np.searchsorted(total, share * total[-1])), len(values) - 1)]])


# A coarse plan grid on which floors and walls are compared while levels are looked for (never what is cut).


Cells = npt.NDArray[np.uint8]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class PlanGrid:
    """Cells of ``size_m``; row and column count from ``origin`` (x, y) along +y and +x; masks are uint8 0 or 1."""

    origin: tuple[float, float]
    shape: tuple[int, int]
    size_m: float = GRID_CELL_M

    @classmethod
    def over(cls, low: Floats, high: Floats, margin_m: float = AROUND_M, size_m: float = GRID_CELL_M) -> PlanGrid:
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

    def grow(self, mask: Cells, radius_m: float) -> Cells:
        """Cells within a radius of the mask."""
        return np.asarray(cv2.dilate(mask, self._disc(radius_m)), np.uint8)

    def drop_narrow(self, mask: Cells, radius_m: float) -> Cells:
        """Drop what is narrower than a disc of the radius."""
        return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, self._disc(radius_m)), np.uint8)

    def fill_gaps(self, mask: Cells, radius_m: float) -> Cells:
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


# The storeys of a split level: halves of a house whose floors lie at heights of their own, half a storey apart.


MAX_LAYERS = 60  # a house of scanned faces has level ones at every height


def find_storey_pairs(
    surfaces: Surfaces, flats: Bools, axis: int, layers: Floats, step: float
) -> list[tuple[float, float]]:
    """Pairs of heights of one place (a floor, and the ceiling over it) that only layers of other places lie between.

    ``layers`` are the heights of the level faces that cover the plan, rising, each ``step`` high.
    """
    if not 2 < len(layers) <= MAX_LAYERS:
        return []
    plan = [i for i in range(3) if i != axis]
    heights = (surfaces.low[:, axis] + surfaces.high[:, axis]) / 2
    near = [np.flatnonzero(flats & (np.abs(heights - layer) <= step * (1 + SAME))) for layer in layers]
    boxes = [_box(surfaces, faces, plan) for faces in near]
    found = []
    for low, box in enumerate(boxes):
        for high in range(low + 1, len(boxes)):
            if _shared_area(box, boxes[high]) > HARDLY:
                if high > low + 1 and _shared_area(box, boxes[high], together=True) > MOST:
                    found.append((float(layers[low]), float(layers[high])))
                break
    return found


def _box(surfaces: Surfaces, faces: np.ndarray, plan: list[int]) -> Floats:
    """Plan bounds (2, 2), low and high, of all but the edges of a layer: a stair or a sill beside it."""
    area = surfaces.area[faces]
    low = [weighted_quantile(surfaces.low[faces, i], area, SPECK) for i in plan]
    return np.array([low, [weighted_quantile(surfaces.high[faces, i], area, 1 - SPECK) for i in plan]])


def _shared_area(one: Floats, other: Floats, *, together: bool = False) -> float:
    """Return which share of the smaller of two boxes lies in both, or of all that they cover ``together``."""
    both = float(np.prod(np.maximum(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]), 0.0)))
    areas = [max(float(np.prod(box[1] - box[0])), TINY) for box in (one, other)]
    return both / (sum(areas) - both if together else min(areas))
