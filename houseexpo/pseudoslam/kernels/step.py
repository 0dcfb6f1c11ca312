"""One transition: turn, go, look on the way, and cut out the observation."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, crop, merge
from houseexpo.pseudoslam.kernels.motion import free_way
from houseexpo.pseudoslam.kernels.noise import draw_noisy, merge_patch
from houseexpo.pseudoslam.kernels.rays import ray_scan
from houseexpo.pseudoslam.kernels.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid

STEPS, COLLISIONS, KNOWN, COVERED = 0, 1, 2, 3
"""What ``counts`` holds: of the episode, the steps and those that met an obstacle; of the map, cells."""


@njit(cache=True, nogil=True)
def transition(
    solid: Grid,
    countable: Grid,
    known: Grid,
    pose: Floats,
    counts: npt.NDArray[np.int64],
    view: Grid,
    turn: float,
    forward: float,
    radius: float,
    between_px: float,
    between_rad: float,
    by_rays: bool,
    half_fov: float,
    range_px: float,
    fan_cos: Floats,
    fan_sin: Floats,
    noisy: bool,
    shift_px: Floats,
    error: Floats,
    free: Cells,
    hit: Cells,
    slopes: Floats,
    patch: Grid,
) -> bool:
    """Turn, then go forward (backward where negative) until something is in the way; ``pose``, maps and counts change.

    Scans lie at most ``between_px`` and ``between_rad`` apart, the last at the end; there is one at least.

    Parameters
    ----------
    pose
        (3,) x, y in pixels, heading.
    turn, forward
        Radians, pixels.
    shift_px
        (scans, beams) by which obstacles move along their rays, row by row for each scan, read where ``noisy``.
    error
        (3,) right, down (pixels) and turn (radians) by which what is seen is misplaced, read where ``noisy``.
    free, hit, slopes, patch
        Scratch; ``patch`` is empty.

    Returns
    -------
    Whether something was in the way.
    """
    distance = abs(forward)
    start_heading = pose[2]
    turns = math.ceil(abs(turn) / between_rad - 1e-9)
    heading = _wrapped(start_heading + turn)
    sign = 1.0 if forward >= 0.0 else -1.0
    right, down = sign * math.cos(heading), -sign * math.sin(heading)
    start_x, start_y = pose[0], pose[1]
    way = distance
    if distance > 0.0:
        way = free_way(solid, start_x, start_y, right, down, distance, radius)
    goes = math.ceil(way / between_px - 1e-9)
    for i in range(1, max(turns + goes, 1) + 1):
        pose[2] = heading if i >= turns else _wrapped(start_heading + turn * i / turns)
        if i > turns and goes > 0:
            gone = way if i == turns + goes else way * (i - turns) / goes
            pose[0], pose[1] = start_x + gone * right, start_y + gone * down
        x, y = pose[0], pose[1]
        if by_rays:
            n_free, n_hit = ray_scan(solid, x, y, pose[2], fan_cos, fan_sin, range_px, free, hit)
        else:
            n_free, n_hit = sector_scan(solid, x, y, pose[2], half_fov, range_px, free, hit, slopes)
        if noisy:
            draw_noisy(patch, solid.shape[1], x, y, pose[2], half_fov, free, n_free, hit, n_hit, shift_px[i - 1])
            new, covered = merge_patch(known, countable, patch, x, y, error[0], error[1], error[2])
        else:
            new, covered = merge(known, countable, free, n_free, FREE)
            new_hit, covered_hit = merge(known, countable, hit, n_hit, OBSTACLE)
            new, covered = new + new_hit, covered + covered_hit
        counts[KNOWN] += new
        counts[COVERED] += covered
    crop(known, pose[0], pose[1], pose[2], view)
    return way < distance


@njit(cache=True, nogil=True)
def _wrapped(heading: float) -> float:
    """Return the same direction in [-pi, pi]; one that lies there already keeps its bits."""
    while heading > math.pi:
        heading -= 2.0 * math.pi
    while heading < -math.pi:
        heading += 2.0 * math.pi
    return heading
