"""Compute how far a disc can go among cells and people, which steps a map allows, and draw and erase moving discs.

The robot and people are discs. Cells are squares, which a disc may touch (``free_distance``). They have one bit for
static and one for moving obstacles, so that static ones remain when a body passes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import OBSTACLE
from houseexpo.pseudoslam.kernels.tolerances import REST_PX, TOUCH_PX
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Rows, make_row_dtype


@njit(inline="always")
def wrap_angle(heading: float) -> float:
    """Return the same direction in [-pi, pi]; one that is already in it is unchanged."""
    while heading > math.pi:
        heading -= 2.0 * math.pi
    while heading < -math.pi:
        heading += 2.0 * math.pi
    return heading


@njit(cache=True, nogil=True)
def disc_is_free(occupied: Grid, x: float, y: float, radius: float) -> bool:
    """Return whether a disc (pixels) overlaps no occupied cell and lies on the grid."""
    rows, cols = occupied.shape
    if x < radius or y < radius or x > cols - radius or y > rows - radius:
        return False
    least = (radius - TOUCH_PX) ** 2
    for row in range(max(int(y - radius), 0), min(int(y + radius) + 1, rows)):
        for col in range(max(int(x - radius), 0), min(int(x + radius) + 1, cols)):
            if occupied[row, col] != 0:
                across = max(col - x, x - col - 1.0, 0.0)
                down = max(row - y, y - row - 1.0, 0.0)
                if across * across + down * down < least:
                    return False
    return True


@njit(cache=True, nogil=True)
def free_distance(
    occupied: Grid, x: float, y: float, right: float, down: float, distance: float, radius: float
) -> float:
    """Return how far, up to ``distance``, a disc can go in the direction (``right``, ``down``, a unit vector).

    The result is less than ``distance`` only if an obstacle blocks the disc, and 0.0 if the disc already touches it.
    The grid's border must be occupied.
    """
    rows, cols = occupied.shape
    end_x, end_y = x + distance * right, y + distance * down
    top, bottom = max(int(min(y, end_y) - radius), 0), min(int(max(y, end_y) + radius) + 1, rows)
    left, last = max(int(min(x, end_x) - radius), 0), min(int(max(x, end_x) + radius) + 1, cols)
    r = radius - TOUCH_PX
    way = distance
    for row in range(top, bottom):
        for col in range(left, last):
            if occupied[row, col] != 0:
                way = min(way, distance_to_square(x - col - 0.5, y - row - 0.5, right, down, r, way))
    return way if way == distance else max(way - REST_PX, 0.0)


@njit(cache=True, nogil=True)
def distance_to_square(x: float, y: float, right: float, down: float, r: float, way: float) -> float:
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


STATIC, MOVING = 1, 2
"""Bits of a cell."""
HALF_DIAGONAL = math.sqrt(0.5)
"""Distance from a cell's centre to its corner, pixels; a disc of this radius always covers some cell."""
THINNER_PX = 2.0
"""By how much the discs of a team's robots, and of people for all but the first, are drawn smaller than they are, so
that rounding to cells does not hold a robot fast: what they may not touch is the disc itself (``distance_to_disc``)."""
PERSON = make_row_dtype(
    x=float, y=float, vx=float, vy=float, speed=float, anchor_x=float, anchor_y=float, waited=float, goal=int, visit=int
)
"""Position and velocity; the desired speed; where and for how long the person waits; the number of the goal in
``FlowField.goals``, and the number of earlier goals."""


class Disc(NamedTuple):
    """The robot as a disc, pixels."""

    x: float
    y: float
    radius: float


@njit(cache=True, nogil=True)
def placed_people(people: Rows) -> Rows:
    """Return a view of the people who found a place at the start; the others come after them and have no speed."""
    count = len(people)
    while count > 0 and people[count - 1].speed == 0.0:
        count -= 1
    return people[:count]


@njit(cache=True, nogil=True)
def disc_bounds(size: tuple[int, int], x: float, y: float, radius: float) -> tuple[int, int, int, int]:
    """Return (top, bottom, left, right), ends excluded, of the cells on the grid that a disc may touch."""
    rows, cols = size
    top, bottom = max(math.floor(y - radius), 0), min(math.floor(y + radius) + 1, rows)
    return top, bottom, max(math.floor(x - radius), 0), min(math.floor(x + radius) + 1, cols)


@njit(cache=True, nogil=True)
def cell_meets_disc(row: int, col: int, x: float, y: float, radius: float) -> bool:
    """Return whether the square of a cell overlaps a disc, as in ``disc_is_free``."""
    across, down = max(col - x, x - col - 1.0, 0.0), max(row - y, y - row - 1.0, 0.0)
    return across * across + down * down < (radius - TOUCH_PX) ** 2


@njit(cache=True, nogil=True)
def mark_disc(occupied: Grid, x: float, y: float, radius: float) -> None:
    """Set the moving bit of cells whose centres lie in a disc."""
    top, bottom, left, right = disc_bounds(occupied.shape, x, y, radius)
    for row in range(top, bottom):
        first, end = disc_columns(row, x, y, radius)
        for col in range(np.uint64(max(first, left)), np.uint64(max(min(end, right), 0))):  # unsigned, as below
            occupied[row, col] |= MOVING


@njit(cache=True, nogil=True)
def unmark_disc(occupied: Grid, x: float, y: float, radius: float) -> None:
    """Clear the moving bit of the cells that ``mark_disc`` sets."""
    top, bottom, left, right = disc_bounds(occupied.shape, x, y, radius)
    for row in range(top, bottom):
        first, end = disc_columns(row, x, y, radius)
        for col in range(np.uint64(max(first, left)), np.uint64(max(min(end, right), 0))):  # unsigned, as below
            occupied[row, col] &= STATIC


@njit(cache=True, nogil=True)
def disc_columns(row: int, x: float, y: float, radius: float) -> tuple[int, int]:
    """Return the first column and the end, excluded, of the cells of a row whose centres lie in a disc."""
    down = row + 0.5 - y
    square = radius * radius - down * down
    if square < 0.0:
        return 0, 0
    half = math.sqrt(square)
    return math.ceil(x - half - 0.5), math.floor(x + half - 0.5) + 1


@njit(cache=True, nogil=True)
def erase_disc(occupied: Grid, x: float, y: float, radius: float) -> None:
    """Clear the moving bit in the square around a disc."""
    top, bottom, left, right = disc_bounds(occupied.shape, x, y, radius)
    for row in range(np.uint64(top), np.uint64(bottom)):  # unsigned: without checks for negative indices
        for col in range(np.uint64(left), np.uint64(right)):
            occupied[row, col] &= STATIC


@njit(cache=True, nogil=True)
def distance_to_people(people: Rows, radius: float, disc: Disc, right: float, down: float, distance: float) -> float:
    """Return how far, up to ``distance``, a disc can go in direction (``right``, ``down``) until it touches a person.

    With cells alone, it could come closer by a fraction of one. It may move away from a person that it overlaps.
    """
    way, reach = distance, radius + disc.radius
    for p in range(len(people)):
        way = min(way, distance_to_disc(people[p].x - disc.x, people[p].y - disc.y, right, down, reach, TOUCH_PX))
    return way


@njit(cache=True, nogil=True)
def distance_to_disc(off_x: float, off_y: float, right: float, down: float, reach: float, apart: float) -> float:
    """Return how far a disc goes in direction (``right``, ``down``) until it touches another, infinite if it does not.

    Parameters
    ----------
    off_x, off_y, reach, apart
        The offset of the other's centre, the sum of the two radii, and the distance that the discs keep, pixels.
    """
    along = off_x * right + off_y * down
    inside = along * along - (off_x * off_x + off_y * off_y - reach * reach)
    if along > 0.0 and inside > 0.0:
        return max(along - math.sqrt(inside) - apart, 0.0)
    return math.inf


@njit(cache=True, nogil=True)
def step_is_free(known: Grid, x: float, y: float, heading: float, distance: float, radius: float) -> bool:
    """Return whether a disc (pixels) meets no obstacle of a map on its way ahead.

    Cells that are unknown do not count as obstacles. Contacts are those of ``collision.free_distance``.
    """
    rows, cols = known.shape
    right, down, r = math.cos(heading), -math.sin(heading), radius - TOUCH_PX
    end_x, end_y = x + distance * right, y + distance * down
    for row in range(max(int(min(y, end_y) - radius), 0), min(int(max(y, end_y) + radius) + 1, rows)):
        for col in range(max(int(min(x, end_x) - radius), 0), min(int(max(x, end_x) + radius) + 1, cols)):
            if known[row, col] == OBSTACLE:  # noqa: SIM102  # one comparison for most cells
                if distance_to_square(x - col - 0.5, y - row - 0.5, right, down, r, distance) < distance:
                    return False
    return True


@njit(cache=True, nogil=True)
def find_free_steps(
    known: Grid, sizes: Counts, poses: Floats, distance: float, radius: float, fit: npt.NDArray[np.bool_]
) -> None:
    """Write ``step_is_free`` for N robots.

    Parameters
    ----------
    known
        (N, cells), the maps, flat and padded.
    sizes
        (N, 2), rows and columns.
    poses
        (N, 3), the believed poses: pixels and radians.
    fit
        (N,), the result.
    """
    for i in range(len(poses)):
        rows, cols = sizes[i]
        grid = known[i, : rows * cols].reshape((rows, cols))
        fit[i] = step_is_free(grid, poses[i, 0], poses[i, 1], poses[i, 2], distance, radius)
