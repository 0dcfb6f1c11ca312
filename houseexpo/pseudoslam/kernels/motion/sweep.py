"""The cells that a body on a track covers from its first pose to its last, and its first collision."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.motion.bodies import STATIC, Tracks, covers, pose_at, stamp_track
from houseexpo.pseudoslam.kernels.types import Grid

_STEP_PX = 0.5  # largest distance of a body's fastest point between two samples


@njit(cache=True, nogil=True)
def looks(tracks: Tracks, k: int, i: int) -> int:
    """Return the number of samples of track ``k`` between its poses ``i`` and ``i + 1``, including the latter."""
    one, other, reach = tracks.poses[k, i], tracks.poses[k, i + 1], tracks.shapes[k].reach
    way = math.hypot(other[0] - one[0], other[1] - one[1]) + reach * abs(other[2] - one[2])
    return int(max(math.ceil(way / _STEP_PX), 1))


@njit(cache=True, nogil=True)
def sweep(swept: Grid, tracks: Tracks, k: int) -> None:
    """Set the moving bit of all cells that body ``k`` passes."""
    stamp_track(swept, tracks, k, tracks.times_s[k, 0])
    for i in range(tracks.shapes[k].poses - 1):
        start, end, n = tracks.times_s[k, i], tracks.times_s[k, i + 1], looks(tracks, k, i)
        for j in range(1, n + 1):
            stamp_track(swept, tracks, k, start + (end - start) * j / n)


@njit(cache=True, nogil=True)
def first_hit(occupied: Grid, tracks: Tracks, k: int) -> tuple[float, int, int]:
    """Return when body ``k`` first covers an obstacle or a cell off the grid, and that cell; -1.0 if it never does."""
    row, col = hit_at(occupied, tracks, k, tracks.times_s[k, 0])
    if row >= -1:
        return tracks.times_s[k, 0], row, col
    for i in range(tracks.shapes[k].poses - 1):
        start, end, n = tracks.times_s[k, i], tracks.times_s[k, i + 1], looks(tracks, k, i)
        for j in range(1, n + 1):
            row, col = hit_at(occupied, tracks, k, start + (end - start) * j / n)
            if row >= -1:
                return start + (end - start) * j / n, row, col
    return -1.0, 0, 0


@njit(cache=True, nogil=True)
def hit_at(occupied: Grid, tracks: Tracks, k: int, clock: float) -> tuple[int, int]:
    """Return an obstacle's cell, or one next to the grid, that body ``k`` covers; (-2, -2) if there is none."""
    rows, cols = occupied.shape
    x, y, heading = pose_at(tracks, k, clock)
    cos, sin, reach = math.cos(heading), math.sin(heading), tracks.shapes[k].reach
    for row in range(math.floor(y - reach), math.floor(y + reach) + 1):
        for col in range(math.floor(x - reach), math.floor(x + reach) + 1):
            on_grid = 0 <= row < rows and 0 <= col < cols
            if on_grid and occupied[row, col] & STATIC == 0:
                continue
            dx, dy = col + 0.5 - x, row + 0.5 - y
            if covers(tracks, k, dx * cos - dy * sin, -dx * sin - dy * cos):
                return min(max(row, -1), rows), min(max(col, -1), cols)
    return -2, -2
