"""Cast many rays at once against the walls of a plan, to find how far one sees from a point."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Floats = npt.NDArray[np.float64]

_CHUNK: Final = 500_000  # rays times walls at once: 4 MB per array
_NEAREST_M: Final = 1e-6


class Walls:
    """The edges of a shape (metres) as obstacles."""

    def __init__(self, shape: Polygon | MultiPolygon) -> None:
        import shapely

        points, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(shape)), return_index=True)
        same = ring[1:] == ring[:-1]
        self._start = points[:-1][same]
        self._edge = (points[1:] - points[:-1])[same]

    def distance(self, origins: Floats, directions: Floats) -> Floats:
        """Return the distance (k,) from each origin (k, 2) along its unit direction (k, 2) to the first wall, metres.

        It is infinite if there is no wall. A ray along a wall does not hit it.
        """
        step = max(1, _CHUNK // max(1, len(self._start)))
        parts = [self._nearest(origins[k : k + step], directions[k : k + step]) for k in range(0, len(origins), step)]
        return np.concatenate(parts) if parts else np.empty(0)

    def _nearest(self, origins: Floats, directions: Floats) -> Floats:
        ray_x, ray_y = directions[:, :1], directions[:, 1:]
        wall_x, wall_y = self._edge.T
        to_x, to_y = self._start[:, 0] - origins[:, :1], self._start[:, 1] - origins[:, 1:]
        turn = ray_x * wall_y - ray_y * wall_x
        with np.errstate(divide="ignore", invalid="ignore"):  # parallel lines do not meet
            along_ray = (to_x * wall_y - to_y * wall_x) / turn
            along_wall = (to_x * ray_y - to_y * ray_x) / turn
        meets = (along_wall >= 0.0) & (along_wall <= 1.0) & (along_ray > _NEAREST_M)
        return np.asarray(np.where(meets, along_ray, np.inf).min(axis=1, initial=np.inf))
