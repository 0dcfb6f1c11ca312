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


def tile_on_grid(rooms: Sequence[Polygon], doors: Sequence[Polygon]) -> tuple[list[Polygon], list[Polygon]]:
    """Return rooms and doors on the grid, with shared vertices; a shape that vanishes on the grid is empty.

    A face belongs to the shape that contains its inner point. If no shape does, as in a spur that is one cell wide only
    on the grid, the face belongs to the shape that covers most of it.
    """
    import shapely

    shapes = [*doors, *rooms]
    faces = enclosed_faces(shapely.boundary(shapes))
    inside = shapely.point_on_surface(faces)
    tree = shapely.STRtree(shapes)
    face, shape = tree.query(inside, predicate="within")
    owner = np.full(len(faces), -1)
    owner[face[::-1]] = shape[::-1]  # a door before a room, the first room before the next
    free = np.flatnonzero(owner < 0)
    face, shape = tree.query(faces[free], predicate="intersects")
    covered = shapely.area(shapely.intersection(faces[free][face], np.array(shapes, np.object_)[shape]))
    most = covered > shapely.area(faces[free])[face] / 2
    owner[free[face[most]][::-1]] = shape[most][::-1]
    tiled = [_union_of_faces(faces[owner == k], shapes[k]) for k in range(len(shapes))]
    return tiled[len(doors) :], tiled[: len(doors)]


def _union_of_faces(faces: npt.NDArray[np.object_], shape: Polygon) -> Polygon:
    """Return the faces of one shape in one piece; a shape without faces is rounded, and empty if it vanishes so."""
    import shapely

    if len(faces) == 1:  # as most are
        return faces[0]
    whole = shapely.union_all(faces) if len(faces) else shapely.set_precision(shape, GRID_M)
    parts = [part for part in shapely.get_parts(whole) if isinstance(part, shapely.Polygon) and not part.is_empty]
    return max(parts, key=lambda part: (part.area, *(-side for side in part.bounds)), default=shapely.Polygon())


def snap_ring(ring: BaseGeometry, *, clockwise: bool) -> Points:
    """Return the vertices (n, 2) of a ring on the grid, without repeated and collinear vertices."""
    import shapely

    return _in_metres(_turning_cells(_cells(shapely.get_coordinates(ring)), clockwise=clockwise))


def snap_polygon(shape: Polygon) -> tuple[Points, tuple[Points, ...]]:
    """Return the outline and the holes of a polygon, as ``snap_polygons`` does."""
    return snap_polygons([shape])[0]


def snap_polygons(shapes: Sequence[Polygon], shift: Points | None = None) -> list[tuple[Points, tuple[Points, ...]]]:
    """Return the outline (clockwise) and the holes (counter-clockwise) of polygons, as ``snap_ring`` makes them.

    All are shifted by ``shift`` (2,), metres. Holes without area on the grid are left out. Of a polygon whose
    corners would cross or touch its sides there, the largest part on the grid counts.
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
    made = [(outline, tuple(holes)) for outline, *holes in found]
    sizes = [len(outline) if len(outline) > 2 else 0 for outline, _ in made]
    sized = np.flatnonzero(sizes)
    outlines = np.concatenate([made[k][0] for k in sized] or [np.zeros((0, 2))])
    drawn = shapely.linearrings(outlines, indices=np.repeat(np.arange(len(sized)), [sizes[k] for k in sized]))
    for k in sorted({*range(len(made))} - {*sized[shapely.is_valid(shapely.polygons(drawn))].tolist()}):
        moved = shapely.transform(shapes[k], lambda points: points if shift is None else points + shift)
        rounded = _union_of_faces(np.array([]), moved)
        made[k] = made[k] if rounded.is_empty else snap_polygon(rounded)
    return made


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
    """Return the points at which a ring turns; plain Python, since a ring has only about ten points."""
    around = zip(ring[-1:] + ring[:-1], ring, ring[1:] + ring[:1], strict=True)
    return [c for a, c, b in around if (c[0] - a[0]) * (b[1] - c[1]) != (c[1] - a[1]) * (b[0] - c[0])]
