"""The plan area of a floor's faces as polygons: exact where they are few, from the grid where a scan has many."""

from __future__ import annotations

import cv2
import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from pipeline.sources.plan_grid import Cells, Floats, PlanGrid

EXACT_TRIANGLES = 20_000
TERRAIN = 2.0  # times what the walls enclose
AROUND_M = 0.5


def floor_area(triangles: Floats, region: Cells, grid: PlanGrid) -> Polygon | MultiPolygon | None:
    """Unite plan triangles (k, 3, 2); beyond EXACT_TRIANGLES outline the grid's ``region`` instead."""
    if len(triangles) > EXACT_TRIANGLES:
        parts = _outlines(region, grid)
    else:
        parts = shapely.polygons(triangles)
        parts = parts[shapely.area(parts) > 1e-8]
    area = shapely.union_all(parts, grid_size=0.001)
    if area.area > TERRAIN * grid.area(region):  # ground that goes on outside, at the floor's own height
        hull = shapely.union_all(_outlines(region, grid)).convex_hull
        area = area.intersection(hull.buffer(AROUND_M, join_style="mitre"))
    pieces = [piece for piece in shapely.get_parts(area) if isinstance(piece, Polygon) and piece.area > 0]
    if not pieces:
        return None
    return pieces[0] if len(pieces) == 1 else MultiPolygon(pieces)


def _outlines(region: Cells, grid: PlanGrid) -> np.ndarray:
    contours = cv2.findContours(region, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[-2]
    rings = [contour[:, 0] * grid.size_m + np.asarray(grid.origin) + grid.size_m / 2 for contour in contours]
    half = grid.size_m / 2  # contours run through the centres of the outermost cells
    return np.asarray([Polygon(ring).buffer(half, join_style="mitre") for ring in rings if len(ring) > 2])
