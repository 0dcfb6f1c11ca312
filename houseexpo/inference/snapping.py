"""Snap lines and rings to the 1 cm grid, and find the faces between them, so that neighbours keep their common edges.

Snap rounding keeps neighbours adjacent: a boundary that is moved to the grid moves for both of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from houseexpo.tolerances import GRID_M

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry


Points = npt.NDArray[np.float64]


def enclosed_faces(lines: Sequence[BaseGeometry]) -> npt.NDArray[np.object_]:
    """Return all faces (n,) that lines (metres) enclose on the grid, including holes; loose ends are left out."""
    import shapely

    noded = shapely.union_all(lines, grid_size=GRID_M)
    return np.asarray(shapely.get_parts(shapely.polygonize(shapely.get_parts(noded))))


def snap_ring(ring: BaseGeometry, shift: Points | None = None, *, clockwise: bool) -> Points:
    """Return the vertices (n, 2) of a ring, shifted by ``shift`` (2,), on the grid: none repeated, none collinear."""
    import shapely

    points = shapely.get_coordinates(ring)[:-1] + (0.0 if shift is None else shift)
    cells = [(x, y) for x, y in np.round(points / GRID_M).astype(np.int64).tolist()]
    cells = [cell for last, cell in zip(cells[-1:] + cells, cells, strict=False) if cell != last]
    bends = _bends(cells)
    while len(cells) > 3 and len(bends) < len(cells):
        cells, bends = bends, _bends(bends)
    twice_area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(cells, cells[1:] + cells[:1], strict=True))
    if (twice_area < 0) != clockwise:
        cells.reverse()
    return np.asarray(np.round(np.array(cells, dtype=np.int64).reshape(-1, 2) * GRID_M, 2))


def _bends(ring: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the points of a ring at which it turns; plain Python, since a ring has only about ten of them."""
    around = zip(ring[-1:] + ring[:-1], ring, ring[1:] + ring[:1], strict=True)
    return [c for a, c, b in around if (c[0] - a[0]) * (b[1] - c[1]) != (c[1] - a[1]) * (b[0] - c[0])]


def snap_polygon(shape: Polygon, shift: Points | None = None) -> tuple[Points, tuple[Points, ...]]:
    """Return the outline (clockwise) and the holes (counter-clockwise) of a polygon, made by ``snap_ring``.

    Holes without area on the grid are left out.
    """
    holes = (snap_ring(hole, shift, clockwise=False) for hole in shape.interiors)
    return snap_ring(shape.exterior, shift, clockwise=True), tuple(hole for hole in holes if len(hole) > 2)
