"""The faces of a z-up mesh as walls and floors: slopes, extents, sections, and wall length over height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pipeline.values import Mesh

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

VERTICAL = 0.2  # |n . up| of a wall: within 11.5 degrees, as scans lean
HORIZONTAL = 0.985  # |n . up| of a floor: within 10 degrees
ENDED = 0.2  # of a storey's usual wall length; where less goes on, its walls have ended
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
        """Measure each face, in chunks so that millions of faces need little beside their own result."""
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
        return self.high[:, axis] - self.low[:, axis] > 1e-4

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
    def of(cls, surfaces: Surfaces, walls: Bools, axis: int = 2, step: float = 0.01) -> WallProfile:
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
        return float(np.median(self.length[self.length > 0.1 * self.length.max()]))

    def length_at(self, height: float) -> float:
        """Plan length of the walls at a height, 0 outside of the profile."""
        step = int(np.searchsorted(self.edges, height, side="right")) - 1
        return float(self.length[step]) if 0 <= step < len(self.length) else 0.0

    def end_above(self, height: float, foot: float) -> float:
        """Height over ``height`` at which the walls from ``foot`` up to it have ended, all but a chimney or a gable."""
        usual = float(np.median(self.length[(self.edges[:-1] >= foot) & (self.edges[1:] <= height)]))
        ended = (self.edges[:-1] >= height - 0.1) & (self.length < ENDED * usual)
        return float(min(self.edges[np.flatnonzero(ended)[0]], self.top)) if ended.any() else self.top


def _ramp_sum(at: Floats, start: Floats, weight: Floats) -> Floats:
    """Sum of weight * max(at - start, 0) over all starts, for sorted ``at``."""
    slot = np.searchsorted(at, start, side="left")
    slope = np.cumsum(np.bincount(slot, weight, minlength=len(at) + 1)[: len(at)])
    offset = np.cumsum(np.bincount(slot, weight * start, minlength=len(at) + 1)[: len(at)])
    return at * slope - offset


def cut(surfaces: Surfaces, walls: Bools, height: float) -> Floats:
    """Segments (k, 2, 2) in plan where the chosen faces cross a height; faces that only touch it give none."""
    return cut_faces(surfaces, walls, height)[0]


def cut_faces(surfaces: Surfaces, walls: Bools, height: float) -> tuple[Floats, npt.NDArray[np.int64]]:
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
