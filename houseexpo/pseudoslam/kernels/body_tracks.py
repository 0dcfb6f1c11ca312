"""Compute where polygons on trajectories (bodies on tracks) are, draw their cells, find the first obstacle they hit.

A body on a track is a polygon around its position, enlarged by a radius; a circle is a single enlarged corner.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.collision import HALF_DIAGONAL, MOVING, STATIC, Disc, cell_meets_disc, disc_bounds
from houseexpo.pseudoslam.kernels.tolerances import SWEEP_PX
from houseexpo.pseudoslam.kernels.types import Floats, Grid, Rows, make_row_dtype

SHAPE = make_row_dtype(poses=int, corners=int, loops=int, grown=float, core=float, reach=float, fastest=float)
"""Numbers of poses and corners; 1 if it starts again after the last pose; the radius by which the shape is enlarged,
the radii of discs inside and around it, the speed of its fastest point."""


class BodyTracks(NamedTuple):
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


def no_tracks() -> Tracks:
    """Return empty tracks."""
    return Tracks(np.zeros((0, 1)), np.zeros((0, 1, 3)), np.zeros((0, 1, 2)), np.zeros(0, SHAPE))


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
