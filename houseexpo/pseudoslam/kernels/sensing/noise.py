"""Draw a scan with the noise of SLAM (moved obstacles, lost beams, registration errors), and merge it into the map."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.hashing import normal, uniform
from houseexpo.pseudoslam.kernels.mapping import CHUNK_BITS, FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Cells, Errors, Floats, Grid, Runs, Sensor

HIT, LOST, FURTHEST = 0, 1, 2
"""The outcome of a beam: it measures, it returns nothing, or it returns the largest range."""


@njit(cache=True, nogil=True)
def draw_beam_errors(errors: Errors, beams: int, key: int, scan: int, shift_px: Floats, fate: Cells) -> None:
    """Draw the error and the outcome of each beam of a scan, as a pure function of key and scan."""
    for beam in range(beams):
        number = scan * beams + beam
        shift_px[beam] = normal(key, 2 * number) * errors.laser_px if errors.laser_px > 0.0 else 0.0
        fate[beam] = HIT
        if errors.beams:
            draw = uniform(key, 4 * number + 2)  # the even counters are for the normal distribution
            if draw < errors.drop_out + errors.max_range:
                fate[beam] = LOST if draw < errors.drop_out else FURTHEST


@njit(cache=True, nogil=True)
def draw_noisy_scan(
    patch: Grid,
    cols: int,
    x: float,
    y: float,
    heading: float,
    sensor: Sensor,
    runs: Runs,
    n_runs: int,
    hit: Cells,
    n_hit: int,
    shift_px: Floats,
    fate: Cells,
) -> None:
    """Draw a scan into an empty patch, with each obstacle as measured by the nearest beam.

    Parameters
    ----------
    patch
        (side, side) with an odd side; the robot is in the middle cell. Cells outside it are lost, as if out of range.
    cols
        Columns of the grid to which the flat indices ``runs`` and ``hit`` refer.
    shift_px, fate
        (beams,), from the right edge of the fan to the left.
    """
    side, beams = patch.shape[0], len(shift_px)
    left, top = math.floor(x) - side // 2, math.floor(y) - side // 2
    for i in range(n_runs):
        row = runs[i, 0] // cols
        for cell in range(runs[i, 0], runs[i, 1] + 1):
            col = cell - row * cols
            # R1: a beam that returns nothing decides no cells
            if fate[_beam(col + 0.5 - x, row + 0.5 - y, heading, sensor.half_fov, beams)] != LOST:
                patch[row - top, col - left] = FREE
    for last in range(2):  # first the free cells, then the obstacles, so that none hides another
        for i in range(n_hit):
            dx, dy = hit[i] % cols + 0.5 - x, hit[i] // cols + 0.5 - y
            distance = math.hypot(dx, dy)
            beam = _beam(dx, dy, heading, sensor.half_fov, beams)
            if fate[beam] == LOST:
                continue
            moved = max(distance + shift_px[beam], 0.0) if fate[beam] == HIT else sensor.range_px
            if last == 1:
                if fate[beam] == HIT:
                    _put(patch, x + dx / distance * moved - left, y + dy / distance * moved - top, OBSTACLE)
                continue
            # R2: if moved away, the ray is free up to it; if moved closer, cells behind it were not seen
            value = FREE if moved > distance else UNKNOWN
            for k in range(int(abs(moved - distance)) + 1):
                at = min(moved, distance) + k
                _put(patch, x + dx / distance * at - left, y + dy / distance * at - top, value)


@njit(cache=True, nogil=True)
def merge_patch(
    known: Grid, observable: Grid, patch: Grid, x: float, y: float, right: float, down: float, turn: float, fresh: Grid
) -> tuple[int, int, int]:
    """Merge a patch into the map, rotated by ``turn`` about (x, y) and then shifted; the patch is empty afterwards.

    Every cell of the map gets the patch's cell at its position, so that rotation leaves no holes. Return how many cells
    were unknown before, how many of those count, and how many cells of the patch lie beyond the map. ``fresh`` is that
    of ``mapping.merge_cells``.
    """
    rows, cols = known.shape
    side = patch.shape[0]
    left, top = math.floor(x) - side // 2, math.floor(y) - side // 2
    cos, sin = math.cos(turn), math.sin(turn)
    middle_x, middle_y = left + side / 2 + right, top + side / 2 + down  # the centre of the patch on the map
    spread = math.ceil((abs(cos) + abs(sin)) * side / 2) + 2
    new, covered = 0, 0
    leaves = not (0.0 <= x + right < cols and 0.0 <= y + down < rows)  # or a scan passes the border's cells
    for row in range(max(math.floor(middle_y) - spread, 0), min(math.floor(middle_y) + spread, rows)):
        for col in range(max(math.floor(middle_x) - spread, 0), min(math.floor(middle_x) + spread, cols)):
            dx, dy = col + 0.5 - x - right, row + 0.5 - y - down
            from_col = math.floor(x + cos * dx - sin * dy) - left
            from_row = math.floor(y + sin * dx + cos * dy) - top
            if not (0 <= from_row < side and 0 <= from_col < side) or patch[from_row, from_col] == UNKNOWN:
                continue
            if known[row, col] == UNKNOWN:
                new += 1
                covered += int(observable[row, col])
                if len(fresh) > 0:
                    fresh[np.uint64((row * cols + col) >> CHUNK_BITS)] = 1
            known[row, col] = patch[from_row, from_col]
            leaves |= row == 0 or col == 0 or row == rows - 1 or col == cols - 1
    lost = 0
    if leaves:
        for row in range(side):
            for col in range(side):
                if patch[row, col] != UNKNOWN:
                    dx, dy = left + col + 0.5 - x, top + row + 0.5 - y
                    to_x, to_y = x + right + cos * dx + sin * dy, y + down - sin * dx + cos * dy
                    lost += not (0.0 <= to_x < cols and 0.0 <= to_y < rows)
    patch[:] = UNKNOWN
    return new, covered, lost


@njit(cache=True, nogil=True)
def registration_error(errors: Errors, key: int, step: int) -> tuple[float, float, float]:
    """Return the registration error of a step's scans: the shift right and down in pixels, and the rotation."""
    return (
        errors.shift_px * normal(key, 3 * step),
        errors.shift_px * normal(key, 3 * step + 1),
        errors.turn_rad * normal(key, 3 * step + 2),
    )


@njit(inline="always")
def _beam(dx: float, dy: float, heading: float, half_fov: float, beams: int) -> int:
    """Return the beam nearest to a direction, right and down."""
    angle = math.atan2(-dy, dx) - heading
    from_middle = math.atan2(math.sin(angle), math.cos(angle))
    return min(max(int((from_middle + half_fov) / (2.0 * half_fov) * beams + 0.5), 0), beams - 1)


@njit(inline="always")
def _put(patch: Grid, x: float, y: float, value: int) -> None:
    """Set the patch's cell at a position in its own pixels, if there is one."""
    col, row = math.floor(x), math.floor(y)
    if 0 <= row < patch.shape[0] and 0 <= col < patch.shape[1]:
        patch[row, col] = value
