"""The closed mesh of a slab over a polygon, with holes where the polygon has them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.geometry.triangles import triangulate
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
    plan, top = triangulate(polygon)
    sizes = [len(ring.coords) - 1 for ring in (polygon.exterior, *polygon.interiors)]
    a = np.arange(len(plan))
    starts = np.cumsum([0, *sizes[:-1]])
    b = np.concatenate([start + np.roll(np.arange(size), -1) for start, size in zip(starts, sizes, strict=True)])
    n = len(plan)
    return plan, top, np.concatenate([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
