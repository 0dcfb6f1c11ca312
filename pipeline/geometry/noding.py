"""Cut lines where they meet, on a grid, and tell whether lines are edges of the faces that they bound."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.geometry.areas import Floats, Indices, Shapes


def node_on_grid(lines: Shapes, grid_m: float) -> Shapes:
    """Return lines cut where they meet, with all ends on a grid of ``grid_m`` metres, as ``shapely.union_all`` does.

    With a grid, that takes GEOS seven times as long as without. Most walls meet only in corners that they already
    have. So the ends are put on the grid first. The grid changes nothing more if lines then cut each other only on the
    grid, and no end lies beside another line. Only where lines meet within half a cell of 0 may the sign of 0 differ.
    """
    ends = shapely.get_coordinates(lines)
    if len(ends) == 2 * len(lines):
        pieces = shapely.get_parts(
            shapely.union_all(shapely.linestrings(round_to_grid(ends, grid_m).reshape(-1, 2, 2)))
        )
        found = shapely.get_coordinates(pieces)
        whole = len(found) == 2 * len(pieces) and np.array_equal(round_to_grid(found, grid_m), found)
        if whole and _meet_at_ends(found.reshape(-1, 2, 2), grid_m):
            return np.asarray(pieces)
    pieces = shapely.get_parts(shapely.union_all(lines, grid_size=grid_m))
    return np.asarray(pieces[shapely.get_type_id(pieces) == shapely.GeometryType.LINESTRING])


def round_to_grid(points: Floats, grid_m: float) -> Floats:
    """Round as GEOS does, but for the sign of 0: points (..., 2) on a grid of ``grid_m`` metres."""
    per_m = 1 / grid_m
    return np.asarray(np.floor(points * per_m + 0.5) / per_m)


def _meet_at_ends(lines: Floats, grid_m: float) -> bool:
    """Return whether no end of any of the lines (n, 2, 2) lies on another line, or within ``grid_m`` beside it."""
    points = np.unique(_as_numbers(lines)).view(np.float64).reshape(-1, 2)
    low, high = lines.min(axis=1) - grid_m, lines.max(axis=1) + grid_m
    line, point = shapely.STRtree(shapely.points(points)).query(shapely.box(*low.T, *high.T))
    along, to = lines[line, 1] - lines[line, 0], points[point] - lines[line, 0]
    aside = np.abs(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0])
    return bool((aside < grid_m * np.hypot(*along.T)).sum() == 2 * len(lines))


def are_edges_of(faces: Shapes, lines: Shapes) -> bool:
    """Return whether each of some lines, which have two ends and cut the plane, is an edge of one of the faces."""
    corners, ring = shapely.get_coordinates(shapely.get_rings(faces), return_index=True)
    ends = shapely.get_coordinates(lines)
    if len(ends) != 2 * len(lines):
        return False
    place = np.unique(np.concatenate([_as_numbers(corners), _as_numbers(ends)]), return_inverse=True)[1]
    goes_on = np.flatnonzero(ring[1:] == ring[:-1])
    edges = _edge_numbers(place[goes_on], place[goes_on + 1], len(place))
    drawn = place[len(corners) :]
    return bool(np.isin(_edge_numbers(drawn[::2], drawn[1::2], len(place)), edges).all())


def _as_numbers(points: Floats) -> npt.NDArray[np.complex128]:
    """Return points (..., 2) as complex numbers, which sort much faster than rows."""
    return np.ascontiguousarray(points).view(np.complex128).reshape(-1)


def _edge_numbers(start: Indices, end: Indices, count: int) -> Indices:
    """Return a number for each edge between two of ``count`` points, whichever of them comes first."""
    return np.asarray(np.minimum(start, end) * count + np.maximum(start, end), np.int64)
