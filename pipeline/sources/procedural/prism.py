"""The closed mesh of a slab over a polygon, with holes where the polygon has them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.sources.procedural.slab_mesh import Meshed


def prism(polygon: shapely.Polygon, low: float, high: float) -> Meshed:
    """Return the closed mesh of a slab over a polygon, from one height to another."""
    plan, top, sides = _triangulated(polygon)
    n = len(plan)
    faces = np.concatenate([top + n, top[:, ::-1], sides])
    twice = np.tile(plan, (2, 1))
    return np.column_stack([twice, np.repeat([low, high], n)]), twice, faces


@lru_cache(maxsize=2)  # a room's ceiling is its floor again
def _triangulated(
    polygon: shapely.Polygon,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return a polygon's corners, its triangles, and those of a band round it whose upper corners come n later."""
    outline = shapely.orient_polygons(polygon)
    rings = [shapely.get_coordinates(ring)[:-1] for ring in (outline.exterior, *outline.interiors)]
    plan = np.concatenate(rings)
    number = {point: k for k, point in enumerate(map(tuple, plan.tolist()))}
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(outline))
    corners = shapely.get_coordinates(shapely.orient_polygons(triangles)).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    top = np.array([number[point] for point in map(tuple, corners.tolist())]).reshape(-1, 3)
    starts = np.cumsum([0] + [len(ring) for ring in rings[:-1]])
    a = np.arange(len(plan))
    b = np.concatenate([start + np.roll(np.arange(len(ring)), -1) for start, ring in zip(starts, rings, strict=True)])
    n = len(plan)
    return plan, top, np.concatenate([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
