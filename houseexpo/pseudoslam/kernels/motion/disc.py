"""Compute exactly how far a disc can go among cells, which are squares that it may touch."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.types import Grid

TOUCH = 1e-9
"""Pixels by which a disc may overlap a square because of rounding."""
REST = 1e-6
"""Pixels before contact at which the disc stops."""


@njit(cache=True, nogil=True)
def disc_is_free(occupied: Grid, x: float, y: float, radius: float) -> bool:
    """Return whether a disc (pixels) overlaps no occupied cell and lies on the grid."""
    rows, cols = occupied.shape
    if x < radius or y < radius or x > cols - radius or y > rows - radius:
        return False
    least = (radius - TOUCH) ** 2
    for row in range(max(int(y - radius), 0), min(int(y + radius) + 1, rows)):
        for col in range(max(int(x - radius), 0), min(int(x + radius) + 1, cols)):
            if occupied[row, col] != 0:
                across = max(col - x, x - col - 1.0, 0.0)
                down = max(row - y, y - row - 1.0, 0.0)
                if across * across + down * down < least:
                    return False
    return True


@njit(cache=True, nogil=True)
def free_way(occupied: Grid, x: float, y: float, right: float, down: float, distance: float, radius: float) -> float:
    """Return how far, up to ``distance``, a disc can go in the direction (``right``, ``down``, a unit vector).

    The result is less than ``distance`` only if an obstacle blocks the disc, and 0.0 if the disc already touches it.
    The grid's border must be occupied.
    """
    rows, cols = occupied.shape
    end_x, end_y = x + distance * right, y + distance * down
    top, bottom = max(int(min(y, end_y) - radius), 0), min(int(max(y, end_y) + radius) + 1, rows)
    left, last = max(int(min(x, end_x) - radius), 0), min(int(max(x, end_x) + radius) + 1, cols)
    r = radius - TOUCH
    way = distance
    for row in range(top, bottom):
        for col in range(left, last):
            if occupied[row, col] != 0:
                way = min(way, contact(x - col - 0.5, y - row - 0.5, right, down, r, way))
    return way if way == distance else max(way - REST, 0.0)


@njit(cache=True, nogil=True)
def contact(x: float, y: float, right: float, down: float, r: float, way: float) -> float:
    """Return the distance at which a disc's centre enters the unit square at the origin grown by ``r``, else ``way``.

    The grown square consists of two rectangles and four discs around the corners.
    """
    found = min(_into_box(x, y, right, down, 0.5 + r, 0.5, way), _into_box(x, y, right, down, 0.5, 0.5 + r, way))
    for corner_x in (-0.5, 0.5):
        for corner_y in (-0.5, 0.5):
            dx, dy = x - corner_x, y - corner_y
            along = dx * right + dy * down
            inside = along * along - (dx * dx + dy * dy - r * r)
            if inside > 0.0:
                root = math.sqrt(inside)
                if root - along > 0.0:
                    found = min(found, max(-along - root, 0.0))
    return found


@njit(cache=True, nogil=True)
def _into_box(x: float, y: float, right: float, down: float, half_x: float, half_y: float, way: float) -> float:
    """Return the distance at which a moving point enters the open box around the origin, else ``way``."""
    start, stop = -math.inf, math.inf
    for at, by, half in ((x, right, half_x), (y, down, half_y)):
        if by == 0.0:
            if abs(at) >= half:
                return way
            continue
        one, other = (-half - at) / by, (half - at) / by
        start, stop = max(start, min(one, other)), min(stop, max(one, other))
    return max(start, 0.0) if start < stop and stop > 0.0 else way


@njit(cache=True, nogil=True)
def clearance(occupied: Grid, x: float, y: float, radius: float, limit: float) -> float:
    """Return the distance from a disc's rim to the nearest occupied cell, at most ``limit - radius``, pixels."""
    rows, cols = occupied.shape
    nearest = limit * limit
    for row in range(max(int(y - limit), 0), min(int(y + limit) + 1, rows)):
        down = max(row - y, y - row - 1.0, 0.0)
        for col in range(max(int(x - limit), 0), min(int(x + limit) + 1, cols)):
            if occupied[row, col] != 0:
                across = max(col - x, x - col - 1.0, 0.0)
                nearest = min(nearest, across * across + down * down)
    return max(math.sqrt(nearest) - radius, 0.0)
