"""Compute how far a disc can go among cells and people; draw polygons on trajectories, and check their tracks.

The robot and people are discs. Cells are squares, which a disc may touch (``free_distance``). A body on a track is a
polygon around its position, enlarged by a radius; a circle is a single enlarged corner. Cells have one bit for static
and one for moving obstacles, so that static ones remain when a body passes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.tolerances import REST_PX, SWEEP_PX, TOUCH_PX
from houseexpo.pseudoslam.kernels.types import Floats, Grid, Rows, make_row_dtype


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
``Flow.goals``, and the number of earlier goals."""
SHAPE = make_row_dtype(poses=int, corners=int, loops=int, grown=float, core=float, reach=float, fastest=float)
"""Numbers of poses and corners; 1 if it starts again after the last pose; the radius by which the shape is enlarged,
the radii of discs inside and around it, the speed of its fastest point."""


class Bodies(NamedTuple):
    """The state of T tracks and P people, pixels and seconds. In a pool, each array has an additional first axis."""

    clocks: Floats
    """(T,), seconds since the start minus waiting times."""
    people: Rows
    """(P,) ``PERSON``; in arrays of an episode and in pools, people without a place are last (``placed_people``)."""
    robots: Floats
    """(R, 2), the places of a team's robots, the episode's own first; (0, 2) for a robot without a team."""


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
def placed_people(people: Rows) -> Rows:
    """Return a view of the people who found a place at the start; the others come after them and have no speed."""
    count = len(people)
    while count > 0 and people[count - 1].speed == 0.0:
        count -= 1
    return people[:count]


@njit(cache=True, nogil=True)
def track_pose_at(tracks: Tracks, k: int, clock: float) -> tuple[float, float, float]:
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
def to_body_frame(tracks: Tracks, k: int, clock: float, x: float, y: float) -> tuple[float, float, float, float]:
    """Return a point as (ahead, left) of the body's position, and (cos, sin) of its heading."""
    at_x, at_y, heading = track_pose_at(tracks, k, clock)
    cos, sin = math.cos(heading), math.sin(heading)
    right, down = x - at_x, y - at_y
    return right * cos - down * sin, -right * sin - down * cos, cos, sin


@njit(cache=True, nogil=True)
def nearest_body_point(tracks: Tracks, k: int, ahead: float, left: float) -> tuple[float, float, float]:
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
def distance_to_body(tracks: Tracks, k: int, clock: float, x: float, y: float) -> float:
    """Return the distance from a point to body ``k``, at most 0 inside."""
    ahead, left, _, _ = to_body_frame(tracks, k, clock, x, y)
    return nearest_body_point(tracks, k, ahead, left)[0]


@njit(cache=True, nogil=True)
def body_covers(tracks: Tracks, k: int, ahead: float, left: float) -> bool:
    """Return whether a point lies in body ``k``."""
    off, core, reach = ahead * ahead + left * left, tracks.shapes[k].core, tracks.shapes[k].reach
    if off < core * core:
        return True
    return off <= reach * reach and nearest_body_point(tracks, k, ahead, left)[0] <= 0.0


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
def body_may_move(tracks: Tracks, k: int, before: float, after: float, disc: Disc, by_cells: bool) -> bool:
    """Return whether body ``k`` may move from clock ``before`` to ``after`` with a disc nearby.

    It may if they do not overlap, or if it moves away from a disc that it overlaps. With ``by_cells``, the disc must
    also not touch any cell that the body would cover.
    """
    x, y, radius = disc
    gap = distance_to_body(tracks, k, after, x, y) - radius
    if gap >= HALF_DIAGONAL:
        return True
    if gap < 0.0 and gap < distance_to_body(tracks, k, before, x, y) - radius:
        return False
    if by_cells:
        at_x, at_y, heading = track_pose_at(tracks, k, after)
        cos, sin = math.cos(heading), math.sin(heading)
        for row in range(math.floor(y - radius), math.floor(y + radius) + 1):
            for col in range(math.floor(x - radius), math.floor(x + radius) + 1):
                if cell_meets_disc(row, col, x, y, radius):
                    right, down = col + 0.5 - at_x, row + 0.5 - at_y
                    if body_covers(tracks, k, right * cos - down * sin, -right * sin - down * cos):
                        return False
    return True


@njit(cache=True, nogil=True)
def mark_body(occupied: Grid, tracks: Tracks, k: int, clock: float) -> None:
    """Set the moving bit of cells whose centres lie in body ``k``."""
    x, y, heading = track_pose_at(tracks, k, clock)
    cos, sin = math.cos(heading), math.sin(heading)
    top, bottom, left, right = disc_bounds(occupied.shape, x, y, tracks.shapes[k].reach)
    for row in range(top, bottom):
        for col in range(left, right):
            dx, dy = col + 0.5 - x, row + 0.5 - y
            if body_covers(tracks, k, dx * cos - dy * sin, -dx * sin - dy * cos):
                occupied[row, col] |= MOVING


@njit(cache=True, nogil=True)
def mark_disc(occupied: Grid, x: float, y: float, radius: float) -> None:
    """Set the moving bit of cells whose centres lie in a disc."""
    top, bottom, left, right = disc_bounds(occupied.shape, x, y, radius)
    for row in range(top, bottom):
        first, end = disc_columns(row, x, y, radius)
        for col in range(np.uint64(max(first, left)), np.uint64(max(min(end, right), 0))):  # unsigned, as below
            occupied[row, col] |= MOVING


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
def count_track_samples(tracks: Tracks, k: int, i: int) -> int:
    """Return the number of samples of track ``k`` between its poses ``i`` and ``i + 1``, including the latter."""
    one, other, reach = tracks.poses[k, i], tracks.poses[k, i + 1], tracks.shapes[k].reach
    way = math.hypot(other[0] - one[0], other[1] - one[1]) + reach * abs(other[2] - one[2])
    return int(max(math.ceil(way / SWEEP_PX), 1))


@njit(cache=True, nogil=True)
def mark_track_cells(swept: Grid, tracks: Tracks, k: int) -> None:
    """Set the moving bit of all cells that body ``k`` passes."""
    mark_body(swept, tracks, k, tracks.times_s[k, 0])
    for i in range(tracks.shapes[k].poses - 1):
        start, end, n = tracks.times_s[k, i], tracks.times_s[k, i + 1], count_track_samples(tracks, k, i)
        for j in range(1, n + 1):
            mark_body(swept, tracks, k, start + (end - start) * j / n)


@njit(cache=True, nogil=True)
def find_track_collision(occupied: Grid, tracks: Tracks, k: int) -> tuple[float, int, int]:
    """Return when body ``k`` first covers an obstacle or a cell off the grid, and that cell; -1.0 if it never does."""
    row, col = find_collision_at(occupied, tracks, k, tracks.times_s[k, 0])
    if row >= -1:
        return tracks.times_s[k, 0], row, col
    for i in range(tracks.shapes[k].poses - 1):
        start, end, n = tracks.times_s[k, i], tracks.times_s[k, i + 1], count_track_samples(tracks, k, i)
        for j in range(1, n + 1):
            row, col = find_collision_at(occupied, tracks, k, start + (end - start) * j / n)
            if row >= -1:
                return start + (end - start) * j / n, row, col
    return -1.0, 0, 0


@njit(cache=True, nogil=True)
def find_collision_at(occupied: Grid, tracks: Tracks, k: int, clock: float) -> tuple[int, int]:
    """Return an obstacle's cell, or one next to the grid, that body ``k`` covers; (-2, -2) if there is none."""
    rows, cols = occupied.shape
    x, y, heading = track_pose_at(tracks, k, clock)
    cos, sin, reach = math.cos(heading), math.sin(heading), tracks.shapes[k].reach
    for row in range(math.floor(y - reach), math.floor(y + reach) + 1):
        for col in range(math.floor(x - reach), math.floor(x + reach) + 1):
            on_grid = 0 <= row < rows and 0 <= col < cols
            if on_grid and occupied[row, col] & STATIC == 0:
                continue
            dx, dy = col + 0.5 - x, row + 0.5 - y
            if body_covers(tracks, k, dx * cos - dy * sin, -dx * sin - dy * cos):
                return min(max(row, -1), rows), min(max(col, -1), cols)
    return -2, -2
