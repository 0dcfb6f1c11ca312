"""Exact shortest paths inside polygons as they are, and the area in which a disc can be among cells."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.graph import path_among_corners

ARC_SEGMENTS = 16  # a quarter of a circle: chords are at most 0.04% shorter than their arcs


def disc_area(occupied: npt.NDArray[np.uint8], radius_px: float) -> BaseGeometry:
    """Where a disc's centre can be, pixels, without overlap with the squares of occupied cells (rows, cols)."""
    rows, cols = np.nonzero(occupied)
    walls = shapely.union_all(shapely.box(cols, rows, cols + 1, rows + 1))
    room = shapely.box(0, 0, *occupied.shape[::-1])
    return shapely.difference(room, shapely.buffer(walls, radius_px, quad_segs=ARC_SEGMENTS))


def exact_distance(space: BaseGeometry, start: tuple[float, float], goal: tuple[float, float]) -> float:
    """The length of the shortest path, infinite if there is none: A* over all reflex corners of the space."""
    parts = shapely.get_parts(shapely.orient_polygons(space))
    rings = [np.asarray(ring.coords)[:-1] for part in parts for ring in (part.exterior, *part.interiors)]
    nodes = np.concatenate([[start, goal], *map(_reflex, rings)])
    found = path_among_corners(shapely.buffer(space, 1e-6, join_style="mitre"), nodes)
    return math.inf if found is None else found.length


def _reflex(ring: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    return ring[before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < 0]
