"""Steps in a ceiling: where it changes its height, as at the edge of a stair's void, at a soffit or a coffer.

R1  A step is the lower edge of an upright face that ends above head height, with a ceiling at the height of that edge
    on one side, and none on the other.
R2  The two faces of a lintel or of a beam are none: the ceiling between them is their own underside.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import EMPTY, union_of
from pipeline.geometry.meshes import Mesh
from pipeline.tolerances import IN_ONE_LINE, RUN_M, SHEET_M, SKEW, STAND_M, THICK_WALL_M

Floats = npt.NDArray[np.float64]


def ceiling_steps(mesh: Mesh, above_m: float) -> BaseGeometry:
    """Return narrow strips of the plan along the steps of the ceilings that lie higher than ``above_m``."""
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    steep = np.abs(normal[:, 2]) / np.where(length > 0, length, 1.0)
    high = (corners[:, :, 2].min(axis=1) > above_m) & (length > 0)
    level = corners[high & (steep > IN_ONE_LINE)]
    edges = _lower_edges(corners[high & (steep < SKEW)])
    if not (len(level) and len(edges)):
        return EMPTY
    along = edges[:, 1, :2] - edges[:, 0, :2]
    aside = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    middle, height = edges.mean(axis=1)[:, :2], edges[:, :, 2].mean(axis=1)
    left, right = (_under(middle + way * RUN_M * aside, height, level) for way in (1.0, -1.0))
    step = left != right  # R1
    edges, height, middle = edges[step], height[step], middle[step]
    under = np.where(left[step], 1.0, -1.0)[:, None] * aside[step]
    lines = shapely.linestrings(edges[:, :, :2])
    across = shapely.linestrings(np.stack([middle + SHEET_M / 2 * under, middle + THICK_WALL_M * under], axis=1))
    ray, other = shapely.STRtree(lines).query(across, predicate="intersects")
    facing = (under[ray] * under[other]).sum(axis=1) < -1 + STAND_M
    beams = ray[facing & (np.abs(height[ray] - height[other]) < STAND_M)]  # R2
    kept = np.delete(lines, np.unique(beams))
    return union_of(shapely.buffer(kept, SHEET_M, cap_style="flat"))


def _lower_edges(upright: Floats) -> Floats:
    """Return the level lower edges (k, 2, 3) of upright triangles (n, 3, 3)."""
    order = np.argsort(upright[:, :, 2], axis=1)
    low = np.take_along_axis(upright, order[:, :2, None], axis=1)
    top = np.take_along_axis(upright[:, :, 2], order[:, 2:], axis=1)[:, 0]
    is_level = np.abs(low[:, 1, 2] - low[:, 0, 2]) < STAND_M / 3
    is_long = np.hypot(*(low[:, 1, :2] - low[:, 0, :2]).T) > RUN_M
    edges: Floats = low[is_level & is_long & (top - low[:, 0, 2] > STAND_M)]
    return edges


def _under(points: Floats, heights: Floats, level: Floats) -> npt.NDArray[np.bool_]:
    """Tell which plan points (k, 2) lie under a level face (m, 3, 3) at their height."""
    at, face = shapely.STRtree(shapely.polygons(level[:, :, :2])).query(shapely.points(points), predicate="intersects")
    near = np.abs(level[face, 0, 2] - heights[at]) < STAND_M
    found = np.zeros(len(points), np.bool_)
    found[at[near]] = True
    return found
