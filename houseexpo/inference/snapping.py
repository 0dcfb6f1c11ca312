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


def snap_ring(ring: BaseGeometry, *, clockwise: bool) -> Points:
    """Return the vertices (n, 2) of a ring on the grid: none repeated, none collinear."""
    import shapely

    return _in_metres(_turning_cells(_cells(shapely.get_coordinates(ring)), clockwise=clockwise))


def snap_polygon(shape: Polygon) -> tuple[Points, tuple[Points, ...]]:
    """Return the outline and the holes of a polygon, as ``snap_polygons`` does."""
    return snap_polygons([shape])[0]


def snap_polygons(shapes: Sequence[Polygon], shift: Points | None = None) -> list[tuple[Points, tuple[Points, ...]]]:
    """Return the outline (clockwise) and the holes (counter-clockwise) of polygons, as ``snap_ring`` makes them.

    All are shifted by ``shift`` (2,), metres. Holes without area on the grid are left out.
    """
    import shapely

    rings, shape = shapely.get_rings(shapes, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    cells = _cells(points if shift is None else points + shift)
    ends = np.cumsum(np.bincount(ring, minlength=len(rings))).tolist()
    is_outer = (np.diff(shape, prepend=-1) > 0).tolist()
    snapped = [
        _turning_cells(cells[start:end], clockwise=outer)
        for start, end, outer in zip([0, *ends], ends, is_outer, strict=False)
    ]
    found: list[list[Points]] = [[] for _ in shapes]
    for k, outer, cells_of_ring in zip(shape.tolist(), is_outer, snapped, strict=True):
        if outer or len(cells_of_ring) > 2:
            found[k].append(_in_metres(cells_of_ring))
    return [(outline, tuple(holes)) for outline, *holes in found]


def _cells(points: Points) -> list[tuple[int, int]]:
    """Return the cells of the grid that are nearest to points (n, 2), metres."""
    return [(x, y) for x, y in np.round(points / GRID_M).astype(np.int64).tolist()]


def _in_metres(cells: list[tuple[int, int]]) -> Points:
    return np.asarray(np.round(np.array(cells, dtype=np.int64).reshape(-1, 2) * GRID_M, 2))


def _turning_cells(cells: list[tuple[int, int]], *, clockwise: bool) -> list[tuple[int, int]]:
    """Return the cells of a closed ring at which it turns, unclosed, each once."""
    cells = cells[:-1]
    cells = [cell for last, cell in zip(cells[-1:] + cells, cells, strict=False) if cell != last]
    bends = _bends(cells)
    while len(cells) > 3 and len(bends) < len(cells):
        cells, bends = bends, _bends(bends)
    twice_area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(cells, cells[1:] + cells[:1], strict=True))
    if (twice_area < 0) != clockwise:
        cells.reverse()
    return cells


def _bends(ring: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the points of a ring at which it turns; plain Python, since a ring has only about ten of them."""
    around = zip(ring[-1:] + ring[:-1], ring, ring[1:] + ring[:1], strict=True)
    return [c for a, c, b in around if (c[0] - a[0]) * (b[1] - c[1]) != (c[1] - a[1]) * (b[0] - c[0])]
