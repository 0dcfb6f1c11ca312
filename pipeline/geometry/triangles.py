"""Triangles of a polygon, without new corners."""

from __future__ import annotations

import manifold3d
import numpy as np
import numpy.typing as npt
import shapely


def triangulate(polygon: shapely.Polygon) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Return a polygon's corners (n, 2), ring by ring, the outer one counterclockwise, and its triangles (m, 3).

    GEOS makes the better triangles, but fails on some valid polygons, such as those with a hole that touches the outer
    ring in a corner; these Manifold does.
    """
    outline = shapely.orient_polygons(polygon)
    rings = [shapely.get_coordinates(ring)[:-1] for ring in (outline.exterior, *outline.interiors)]
    corners = np.concatenate(rings)
    try:
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(outline))
    except shapely.GEOSException:
        return corners, np.asarray(manifold3d.triangulate(rings), np.int64)
    number = {point: k for k, point in enumerate(map(tuple, corners.tolist()))}
    used = shapely.get_coordinates(shapely.orient_polygons(triangles)).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    return corners, np.array([number[point] for point in map(tuple, used.tolist())], np.int64).reshape(-1, 3)
