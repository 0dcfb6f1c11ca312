"""Shapes that bear a name out, or belie it: lengths in metres, z up."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.sources.pieces import Indices, box
from pipeline.sources.surfaces import Surfaces, cut
from pipeline.values import Mesh

WIDEST_DOOR_M = 3.2
HIGHEST_DOOR_M = 3.1
DEEPEST_DOOR_M = 0.5  # a frame as deep as its wall
AJAR_M = 1.5  # a leaf that stands open in its frame is as deep as it is wide
LEAF_HEIGHT_M = (1.7, 2.7)
FLAT_SHARE = 0.5
HOLE_M = 0.5
BESIDE_HOLE_M = 0.5  # of wall, on both sides together; a door frame has less
SPACE_HEIGHT_M = (1.8, 12.0)


def is_door(mesh: Mesh, faces: Indices, sure: bool) -> bool:
    """Tell whether a piece may be a door, or a part of one.

    ``sure`` is False where its name means other things too: then it must have a door's height and width itself.
    """
    low, high = box(mesh, faces)
    width, depth = plan_sides(mesh, faces)
    height = float(high[2] - low[2])
    if width > WIDEST_DOOR_M or height > HIGHEST_DOOR_M or (depth > DEEPEST_DOOR_M and width > AJAR_M):
        return False
    if not sure and not (LEAF_HEIGHT_M[0] <= height <= LEAF_HEIGHT_M[1] and width >= HOLE_M):
        return False
    return depth > DEEPEST_DOOR_M or not _is_wall_with_hole(mesh, faces, low, height)


def is_floor(surfaces: Surfaces, faces: Indices) -> bool:
    """Tell whether most of a part lies level: what is called floor may be a storey."""
    flat = float(surfaces.area[faces][np.abs(surfaces.normal[faces, 2]) > 0.98].sum())
    return flat >= FLAT_SHARE * float(surfaces.area[faces].sum())


def is_space(mesh: Mesh, faces: Indices) -> bool:
    """Tell whether a body is as high as a room."""
    low, high = box(mesh, faces)
    return bool(SPACE_HEIGHT_M[0] <= high[2] - low[2] <= SPACE_HEIGHT_M[1])


def fills(mesh: Mesh, faces: Indices, low: npt.NDArray[np.float64], high: npt.NDArray[np.float64]) -> bool:
    """Tell whether a piece is as high as a storey and covers half of the plan box: that is a house, no piece of it."""
    lowest, highest = box(mesh, faces)
    area = float(np.prod((highest - lowest)[:2]))
    return bool(highest[2] - lowest[2] > 2.0 and area > 0.5 * float(np.prod((high - low)[:2])))


def plan_sides(mesh: Mesh, faces: Indices) -> tuple[float, float]:
    """Longer and shorter side of the tightest rectangle around the piece in plan."""
    points = np.unique(mesh.vertices[np.unique(mesh.faces[faces]), :2], axis=0)
    hull = shapely.convex_hull(shapely.multipoints(points))
    tight = shapely.minimum_rotated_rectangle(hull)
    if tight.geom_type != "Polygon":
        return float(tight.length), 0.0
    ring = shapely.get_coordinates(tight)
    sides = np.linalg.norm(np.diff(ring[:3], axis=0), axis=1)
    return float(sides.max()), float(sides.min())


def _is_wall_with_hole(mesh: Mesh, faces: Indices, low: npt.NDArray[np.float64], height: float) -> bool:
    """Tell whether a piece is a wall around a hole, looking at it at 0.45 of its height."""
    surfaces = Surfaces.of(Mesh(mesh.vertices, mesh.faces[faces]))
    segments = cut(surfaces, np.ones(len(faces), np.bool_), float(low[2]) + 0.45 * height + 1e-4)
    if not len(segments):
        return False
    points = segments.reshape(-1, 2)
    spread = points - points.mean(axis=0)
    along = np.linalg.svd(spread, full_matrices=False)[2][0]
    spans = np.sort((segments - points.mean(axis=0)) @ along, axis=1)
    spans = spans[np.argsort(spans[:, 0])]
    reached = np.maximum.accumulate(spans[:, 1])
    gaps = np.maximum(spans[1:, 0] - reached[:-1], 0.0)
    solid = float(reached[-1] - spans[0, 0] - gaps.sum())
    return bool(len(gaps) and gaps.max() >= HOLE_M and solid >= BESIDE_HOLE_M)
