"""Where one looks down from a level onto the floor of a lower one: a stair's void, a gallery, the air over a terrace.

R1  Nothing that lies level or sloped is within reach under the floor's height: neither a step of the floor, nor the
    ceiling below it, where a source draws no floor above that. The upper steps of a stair are, so that its void is open
    in part.
R2  A floor of a lower level lies under it: in a storey that was exported by itself, what the floor lacks may be
    missing for any reason.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from pipeline.sources.floors import CLEAR_M, FloorSurface
from pipeline.sources.plan_grid import Cells, PlanGrid
from pipeline.sources.surfaces import VERTICAL, Surfaces

UNDER_M = 1.0
OVER_M = 0.3
HALF_WIDTH_M = 0.1  # what is narrower is a crack between floor and wall


def open_below(
    surfaces: Surfaces, height: float, floors: Sequence[FloorSurface | None], grid: PlanGrid
) -> Polygon | MultiPolygon | None:
    """Return that area of the plan for the level at ``height``, or None if it is empty."""
    lower = [floor.region for floor in floors if floor is not None and floor.layer.top <= height - CLEAR_M]
    if not lower:
        return None  # R2
    near = (surfaces.high[:, 2] > height - UNDER_M) & (surfaces.low[:, 2] < height + OVER_M)
    covering = near & (np.abs(surfaces.normal[:, 2]) > VERTICAL)
    covered = grid.cover(surfaces.triangles(covering)[:, :, :2])  # R1
    shape = _outline(grid.opened(np.bitwise_or.reduce(lower) & (1 - covered), HALF_WIDTH_M), grid)
    return shape if isinstance(shape, Polygon | MultiPolygon) and not shape.is_empty else None


def _outline(mask: Cells, grid: PlanGrid) -> shapely.Geometry:
    """The area of a mask's cells, from the runs of its rows."""
    edges = np.diff(np.pad(mask.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, start = np.nonzero(edges == 1)
    end = np.nonzero(edges == -1)[1]
    (x, y), size = grid.origin, grid.size_m
    return shapely.union_all(shapely.box(x + start * size, y + row * size, x + end * size, y + (row + 1) * size))
