"""What lies over and under a point of a section: the tops and bottoms by which a body is closed.

Seen in plan alone, a room of sheets whose faces look outwards is the same as a massive block. A block has a top and a
bottom, and nothing else between them: a line straight up leaves it by a face that looks up, one straight down by a face
that looks down.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

OVER_FLOOR_M = 0.3
SLOPE = (0.3, 0.985)
"""|z| of a roof's unit normal: from 70 to 10 degrees."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Caps:
    """Triangles (n, 3, 3) that are not upright, wound as in the mesh; metres."""

    triangles: Floats

    @cached_property
    def _bounds(self) -> tuple[Floats, Floats]:
        plan = self.triangles[:, :, :2]
        return plan.min(axis=1), plan.max(axis=1)

    def close(self, points: Floats, height: float) -> npt.NDArray[np.bool_]:
        """For each plan point (n, 2) whether it lies, at this height, between a bottom and a top of a body."""
        return np.array([self._closes(point, height) for point in points], np.bool_).reshape(len(points))

    def slopes_over(self, points: Floats, reach_m: float, over_m: float = OVER_FLOOR_M) -> npt.NDArray[np.bool_]:
        """For each plan point (n, 2) whether a slope lies over it, and no level face but a wall's own top below that.

        A wall's top lies at most ``reach_m`` under the slope; up to the height ``over_m`` it is known to stand.
        """
        return np.array([self._slope_over(point, reach_m, over_m) for point in points], np.bool_).reshape(len(points))

    def _slope_over(self, point: Floats, reach_m: float, over_m: float) -> bool:
        low, high = self._bounds
        near = self.triangles[((low <= point) & (high >= point)).all(axis=1)]
        near = near[_turns(near[:, :, :2] - point) != 0]
        heights = _height_at(near, point)
        above = heights > over_m
        if not above.any():
            return False
        near, heights = near[above], heights[above]
        normal = np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0])
        rise = np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1)
        sloped = (rise > SLOPE[0]) & (rise < SLOPE[1])
        return bool(sloped.any() and heights[sloped].min() - heights.min() <= reach_m)

    def _closes(self, point: Floats, height: float) -> bool:
        low, high = self._bounds
        near = self.triangles[((low <= point) & (high >= point)).all(axis=1)]
        turns = _turns(near[:, :, :2] - point)
        hit = near[turns != 0]
        over = _height_at(hit, point) > height
        turns = turns[turns != 0]
        return bool(turns[over].sum() > 0 and turns[~over].sum() < 0)


def _turns(triangles: Floats) -> npt.NDArray[np.int64]:
    """How each plan triangle (n, 3, 2) winds around the origin: 1 (it looks up), -1, or 0 where it does not hold it.

    Half-open at its edges, so that of two triangles that share an edge one holds a point on it.
    """
    (x1, y1), (x2, y2) = (np.moveaxis(p, 2, 0) for p in (triangles, np.roll(triangles, -1, axis=1)))
    left = x1 * y2 - x2 * y1
    up = (y1 <= 0) & (y2 > 0) & (left > 0)
    down = (y2 <= 0) & (y1 > 0) & (left < 0)
    return np.asarray(up.sum(axis=1) - down.sum(axis=1), np.int64)


def _height_at(triangles: Floats, point: Floats) -> Floats:
    """Heights of triangles (n, 3, 3) over a plan point."""
    a = triangles[:, 0]
    normal = np.cross(triangles[:, 1] - a, triangles[:, 2] - a)
    return np.asarray(a[:, 2] - ((point - a[:, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2])
