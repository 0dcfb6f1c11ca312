"""Areas on the 1 cm grid that share their vertices: lines are noded together, the faces between them given back.

Snap rounding keeps neighbours together: where one boundary is moved to the grid, the other moves with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

GRID_M: Final = 0.01
"""Every coordinate of a plan is a multiple of this."""

Points = npt.NDArray[np.float64]


def faces_between(lines: Sequence[BaseGeometry]) -> npt.NDArray[np.object_]:
    """All faces (n,) that lines (metres) enclose on the grid, holes and spaces alike; loose ends are left out."""
    import shapely

    noded = shapely.union_all(lines, grid_size=GRID_M)
    return np.asarray(shapely.get_parts(shapely.polygonize(shapely.get_parts(noded))))


def grid_ring(ring: BaseGeometry, shift: Points | None = None, *, clockwise: bool) -> Points:
    """Vertices (n, 2) of a ring moved by ``shift`` (2,), on the grid: unclosed, none repeated, none in line."""
    import shapely

    points = shapely.get_coordinates(ring)[:-1] + (0.0 if shift is None else shift)
    cells = np.round(points / GRID_M).astype(np.int64)
    cells = cells[np.any(cells != np.roll(cells, 1, axis=0), axis=1)]
    while len(cells) > 3:
        before, after = cells - np.roll(cells, 1, axis=0), np.roll(cells, -1, axis=0) - cells
        bends = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] != 0
        if bends.all():
            break
        cells = cells[bends]
    x, y = cells.T
    twice_area = int((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    if (twice_area < 0) != clockwise:
        cells = cells[::-1]
    return np.asarray(np.round(cells * GRID_M, 2))


def rings_of(shape: Polygon, shift: Points | None = None) -> tuple[Points, tuple[Points, ...]]:
    """The outline (clockwise) and the holes (counter-clockwise) of a polygon as ``grid_ring`` gives them.

    A hole that has no area on the grid is left out.
    """
    holes = (grid_ring(hole, shift, clockwise=False) for hole in shape.interiors)
    return grid_ring(shape.exterior, shift, clockwise=True), tuple(hole for hole in holes if len(hole) > 2)
