"""Moving bodies: their shapes, the cells that they cover, and their distance from a disc.

A body on a track is a polygon around its position, enlarged by a radius; a circle is a single enlarged corner. People
are discs. Cells have one bit for static and one for moving obstacles, so that static ones remain when a body passes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.motion.disc import TOUCH
from houseexpo.pseudoslam.kernels.types import Floats, Grid, Rows, row_type

STATIC, MOVING = 1, 2
"""Bits of a cell."""
HALF_DIAGONAL = math.sqrt(0.5)
"""Distance from a cell's centre to its corner, pixels; a disc of this radius always covers some cell."""
PERSON = row_type(
    x=float, y=float, vx=float, vy=float, speed=float, anchor_x=float, anchor_y=float, waited=float, goal=int, visit=int
)
"""Position and velocity; the desired speed; where and for how long the person waits; the number of the goal in
``Flow.goals``, and the number of earlier goals."""
SHAPE = row_type(poses=int, corners=int, loops=int, grown=float, core=float, reach=float, fastest=float)
"""Numbers of poses and corners; 1 if it starts again after the last pose; the radius by which the shape is enlarged,
the radii of discs inside and around it, the speed of its fastest point."""


class Bodies(NamedTuple):
    """The state of T tracks and P people, pixels and seconds. In a pool, each array has an additional first axis."""

    clocks: Floats
    """(T,), seconds since the start minus waiting times."""
    people: Rows
    """(P,) ``PERSON``; in arrays of an episode and in pools, people without a place are the last, see ``there``."""


class Tracks(NamedTuple):
    """Trajectories of at most K poses and shapes of at most V corners; pixels, seconds, radians."""

    times_s: Floats
    """(T, K), ascending."""
    poses: Floats
    """(T, K, 3), x across, y down, heading; headings continue beyond pi instead of jumping."""
    corners: Floats
    """(T, V, 2), ahead and to the left of the position."""
    shapes: Rows
    """(T,) ``SHAPE``."""


class Disc(NamedTuple):
    """The robot as a disc, pixels."""

    x: float
    y: float
    radius: float


def no_tracks() -> Tracks:
    """Return empty tracks."""
    return Tracks(np.zeros((0, 1)), np.zeros((0, 1, 3)), np.zeros((0, 1, 2)), np.zeros(0, SHAPE))


@njit(cache=True, nogil=True)
def bodies_of(pool: Bodies, i: int) -> Bodies:
    """Return environment ``i``'s part of a pool as a view, with only the people who have a place."""
    return Bodies(pool.clocks[i], there(pool.people[i]))


@njit(cache=True, nogil=True)
def there(people: Rows) -> Rows:
    """Return a view of the people who found a place at the start; the others come after them and have no speed."""
    count = len(people)
    while count > 0 and people[count - 1].speed == 0.0:
        count -= 1
    return people[:count]


@njit(cache=True, nogil=True)
def tracks_of(pool: Tracks, i: int) -> Tracks:
    """Return environment ``i``'s part of a pool, a view."""
    return Tracks(pool.times_s[i], pool.poses[i], pool.corners[i], pool.shapes[i])


@njit(cache=True, nogil=True)
def pose_at(tracks: Tracks, k: int, clock: float) -> tuple[float, float, float]:
    """Return the pose on track ``k``: straight from pose to pose, at rest before the first and after the last one."""
    times, poses, last = tracks.times_s[k], tracks.poses[k], tracks.shapes[k].poses - 1
    if clock <= times[0]:
        return poses[0, 0], poses[0, 1], poses[0, 2]
    if clock >= times[last]:
        return poses[last, 0], poses[last, 1], poses[last, 2]
    low, high = 0, last
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle] <= clock:
            low = middle
        else:
            high = middle
    part = (clock - times[low]) / (times[high] - times[low])
    x = poses[low, 0] + part * (poses[high, 0] - poses[low, 0])
    y = poses[low, 1] + part * (poses[high, 1] - poses[low, 1])
    return x, y, poses[low, 2] + part * (poses[high, 2] - poses[low, 2])


@njit(cache=True, nogil=True)
def to_body(tracks: Tracks, k: int, clock: float, x: float, y: float) -> tuple[float, float, float, float]:
    """Return a point as (ahead, left) of the body's position, and (cos, sin) of its heading."""
    at_x, at_y, heading = pose_at(tracks, k, clock)
    cos, sin = math.cos(heading), math.sin(heading)
    right, down = x - at_x, y - at_y
    return right * cos - down * sin, -right * sin - down * cos, cos, sin


@njit(cache=True, nogil=True)
def nearest(tracks: Tracks, k: int, ahead: float, left: float) -> tuple[float, float, float]:
    """Return the distance to body ``k`` (at most 0 inside), and the vector (ahead, left) from its nearest point."""
    corners, n = tracks.corners[k], tracks.shapes[k].corners
    inside = False
    best, best_a, best_b = math.inf, 0.0, 0.0
    before_a, before_b = corners[n - 1, 0], corners[n - 1, 1]
    for i in range(n):
        a, b = corners[i, 0], corners[i, 1]
        if (b > left) != (before_b > left) and ahead < a + (left - b) * (before_a - a) / (before_b - b):
            inside = not inside
        along_a, along_b = before_a - a, before_b - b
        length = along_a * along_a + along_b * along_b
        part = 0.0
        if length > 0.0:
            part = min(max(((ahead - a) * along_a + (left - b) * along_b) / length, 0.0), 1.0)
        off_a, off_b = ahead - a - part * along_a, left - b - part * along_b
        off = off_a * off_a + off_b * off_b
        if off < best:
            best, best_a, best_b = off, off_a, off_b
        before_a, before_b = a, b
    if inside:
        return -tracks.shapes[k].grown, 0.0, 0.0
    return math.sqrt(best) - tracks.shapes[k].grown, best_a, best_b


@njit(cache=True, nogil=True)
def gap_to(tracks: Tracks, k: int, clock: float, x: float, y: float) -> float:
    """Return the distance from a point to body ``k``, at most 0 inside."""
    ahead, left, _, _ = to_body(tracks, k, clock, x, y)
    return nearest(tracks, k, ahead, left)[0]


@njit(cache=True, nogil=True)
def covers(tracks: Tracks, k: int, ahead: float, left: float) -> bool:
    """Return whether a point lies in body ``k``."""
    off, core, reach = ahead * ahead + left * left, tracks.shapes[k].core, tracks.shapes[k].reach
    if off < core * core:
        return True
    return off <= reach * reach and nearest(tracks, k, ahead, left)[0] <= 0.0


@njit(cache=True, nogil=True)
def box(size: tuple[int, int], x: float, y: float, radius: float) -> tuple[int, int, int, int]:
    """Return (top, bottom, left, right), ends excluded, of the cells on the grid that a disc may touch."""
    rows, cols = size
    top, bottom = max(math.floor(y - radius), 0), min(math.floor(y + radius) + 1, rows)
    return top, bottom, max(math.floor(x - radius), 0), min(math.floor(x + radius) + 1, cols)


@njit(cache=True, nogil=True)
def cell_meets_disc(row: int, col: int, x: float, y: float, radius: float) -> bool:
    """Return whether the square of a cell overlaps a disc, as in ``disc_is_free``."""
    across, down = max(col - x, x - col - 1.0, 0.0), max(row - y, y - row - 1.0, 0.0)
    return across * across + down * down < (radius - TOUCH) ** 2


@njit(cache=True, nogil=True)
def track_keeps_off(tracks: Tracks, k: int, before: float, after: float, disc: Disc, by_cells: bool) -> bool:
    """Return whether body ``k`` may move from clock ``before`` to ``after`` with a disc nearby.

    It may if they do not overlap, or if it moves away from a disc that it overlaps. With ``by_cells``, the disc must
    also not touch any cell that the body would cover.
    """
    x, y, radius = disc
    gap = gap_to(tracks, k, after, x, y) - radius
    if gap >= HALF_DIAGONAL:
        return True
    if gap < 0.0 and gap < gap_to(tracks, k, before, x, y) - radius:
        return False
    if by_cells:
        at_x, at_y, heading = pose_at(tracks, k, after)
        cos, sin = math.cos(heading), math.sin(heading)
        for row in range(math.floor(y - radius), math.floor(y + radius) + 1):
            for col in range(math.floor(x - radius), math.floor(x + radius) + 1):
                if cell_meets_disc(row, col, x, y, radius):
                    right, down = col + 0.5 - at_x, row + 0.5 - at_y
                    if covers(tracks, k, right * cos - down * sin, -right * sin - down * cos):
                        return False
    return True


@njit(cache=True, nogil=True)
def stamp_track(occupied: Grid, tracks: Tracks, k: int, clock: float) -> None:
    """Set the moving bit of cells whose centres lie in body ``k``."""
    x, y, heading = pose_at(tracks, k, clock)
    cos, sin = math.cos(heading), math.sin(heading)
    top, bottom, left, right = box(occupied.shape, x, y, tracks.shapes[k].reach)
    for row in range(top, bottom):
        for col in range(left, right):
            dx, dy = col + 0.5 - x, row + 0.5 - y
            if covers(tracks, k, dx * cos - dy * sin, -dx * sin - dy * cos):
                occupied[row, col] |= MOVING


@njit(cache=True, nogil=True)
def stamp_disc(occupied: Grid, x: float, y: float, radius: float) -> None:
    """Set the moving bit of cells whose centres lie in a disc."""
    top, bottom, left, right = box(occupied.shape, x, y, radius)
    for row in range(top, bottom):
        first, end = disc_span(row, x, y, radius)
        for col in range(np.uint64(max(first, left)), np.uint64(max(min(end, right), 0))):  # unsigned, as below
            occupied[row, col] |= MOVING


@njit(cache=True, nogil=True)
def disc_span(row: int, x: float, y: float, radius: float) -> tuple[int, int]:
    """Return the first column and the end, excluded, of the cells of a row whose centres lie in a disc."""
    down = row + 0.5 - y
    square = radius * radius - down * down
    if square < 0.0:
        return 0, 0
    half = math.sqrt(square)
    return math.ceil(x - half - 0.5), math.floor(x + half - 0.5) + 1


@njit(cache=True, nogil=True)
def erase(occupied: Grid, x: float, y: float, radius: float) -> None:
    """Clear the moving bit in the square around a disc."""
    top, bottom, left, right = box(occupied.shape, x, y, radius)
    for row in range(np.uint64(top), np.uint64(bottom)):  # unsigned: without checks for negative indices
        for col in range(np.uint64(left), np.uint64(right)):
            occupied[row, col] &= STATIC


@njit(cache=True, nogil=True)
def way_past_people(people: Rows, radius: float, disc: Disc, right: float, down: float, distance: float) -> float:
    """Return how far, up to ``distance``, a disc can go in direction (``right``, ``down``) until it touches a person.

    With cells alone, it could come closer by a fraction of one. It may move away from a person that it overlaps.
    """
    way, reach = distance, radius + disc.radius
    for p in range(len(people)):
        off_x, off_y = people[p].x - disc.x, people[p].y - disc.y
        along = off_x * right + off_y * down
        inside = along * along - (off_x * off_x + off_y * off_y - reach * reach)
        if along > 0.0 and inside > 0.0:
            way = min(way, max(along - math.sqrt(inside) - TOUCH, 0.0))
    return way
