"""A scan as a noisy SLAM takes it up: obstacles moved along their rays, and the whole turned and shifted."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid


@njit(cache=True, nogil=True)
def draw_noisy(
    patch: Grid,
    cols: int,
    x: float,
    y: float,
    heading: float,
    half_fov: float,
    free: Cells,
    n_free: int,
    hit: Cells,
    n_hit: int,
    shift_px: Floats,
) -> None:
    """Draw a scan into an empty patch, each obstacle moved along its ray by the shift of the beam nearest to it.

    Parameters
    ----------
    patch
        (side, side), side odd; its middle cell is the robot's. What leaves it is lost, as beyond a sensor's range.
    cols
        Columns of the grid that the flat indices ``free`` and ``hit`` mean.
    shift_px
        (beams,) from the right edge of the fan to the left.
    """
    side = patch.shape[0]
    left, top = math.floor(x) - side // 2, math.floor(y) - side // 2
    for i in range(n_free):
        patch[free[i] // cols - top, free[i] % cols - left] = FREE
    for last in range(2):  # what lies between first, then the obstacles themselves: none hides another
        for i in range(n_hit):
            dx, dy = hit[i] % cols + 0.5 - x, hit[i] // cols + 0.5 - y
            distance = math.hypot(dx, dy)
            shift = shift_px[_beam(math.atan2(-dy, dx) - heading, half_fov, len(shift_px))]
            moved = max(distance + shift, 0.0)
            if last == 1:
                _put(patch, x + dx / distance * moved - left, y + dy / distance * moved - top, OBSTACLE)
                continue
            # R1: moved away, the ray is free up to it; moved nearer, what lies behind it was not seen
            value = FREE if moved > distance else UNKNOWN
            for k in range(int(abs(moved - distance)) + 1):
                at = min(moved, distance) + k
                _put(patch, x + dx / distance * at - left, y + dy / distance * at - top, value)


@njit(cache=True, nogil=True)
def merge_patch(
    known: Grid, countable: Grid, patch: Grid, x: float, y: float, right: float, down: float, turn: float
) -> tuple[int, int]:
    """Merge a patch into the map turned by ``turn`` about (x, y), then shifted; the patch is empty afterwards.

    Every cell of the map takes the patch's cell that falls on it, so that turning leaves no holes. Returns how many
    cells were unknown before, and how many of those count.
    """
    rows, cols = known.shape
    side = patch.shape[0]
    left, top = math.floor(x) - side // 2, math.floor(y) - side // 2
    cos, sin = math.cos(turn), math.sin(turn)
    spread = math.ceil(abs(right) + abs(down) + side * abs(sin)) + 1
    new, covered = 0, 0
    for row in range(max(top - spread, 0), min(top + side + spread, rows)):
        for col in range(max(left - spread, 0), min(left + side + spread, cols)):
            dx, dy = col + 0.5 - x - right, row + 0.5 - y - down
            from_col = math.floor(x + cos * dx - sin * dy) - left
            from_row = math.floor(y + sin * dx + cos * dy) - top
            if not (0 <= from_row < side and 0 <= from_col < side) or patch[from_row, from_col] == UNKNOWN:
                continue
            if known[row, col] == UNKNOWN:
                new += 1
                covered += int(countable[row, col])
            known[row, col] = patch[from_row, from_col]
    patch[:] = UNKNOWN
    return new, covered


@njit(cache=True, nogil=True)
def _beam(angle: float, half_fov: float, beams: int) -> int:
    """Return the beam nearest to an angle from the heading."""
    from_middle = math.atan2(math.sin(angle), math.cos(angle))
    return min(max(int((from_middle + half_fov) / (2.0 * half_fov) * beams + 0.5), 0), beams - 1)


@njit(cache=True, nogil=True)
def _put(patch: Grid, x: float, y: float, value: int) -> None:
    """Set the patch's cell at a position in its own pixels, if there is one."""
    col, row = math.floor(x), math.floor(y)
    if 0 <= row < patch.shape[0] and 0 <= col < patch.shape[1]:
        patch[row, col] = value
