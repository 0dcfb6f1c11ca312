"""The scan of the published simulator: unit steps along each ray of a fan, to the first obstacle.

Sample k of a ray is the cell whose centre is nearest to the point k pixels along it, k = 0 to the range rounded; the
first that is solid ends the ray and is seen, too.

Where nothing moves and the map has no errors, samples in what the map knows to be free need no look: in each quadrant
round the robot a rectangle of free cells is found first, and its rays begin where they leave it. Houses have
rectangular rooms: three samples of four are never taken.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping.merge import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Runs


@njit(cache=True, nogil=True)
def ray_scan(
    occupied: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats, range_px: float,
    runs: Runs, hit: Cells,
) -> tuple[int, int]:  # fmt: skip
    """List the cells on the rays, those near the robot many times.

    Parameters
    ----------
    fan_cos, fan_sin
        (n,) the rays' directions from the heading.
    runs, hit
        Filled with flat indices; room for all samples of all rays, and for one a ray. A run is one cell.

    Returns
    -------
    How many entries there are in ``runs`` and in ``hit``.
    """
    flat, (rows, cols) = occupied.ravel(), occupied.shape
    cos, sin = math.cos(heading), math.sin(heading)
    samples = int(np.rint(range_px)) + 1
    n_runs, n_hit = 0, 0
    for i in range(len(fan_cos)):
        right, up = fan_cos[i] * cos - fan_sin[i] * sin, fan_sin[i] * cos + fan_cos[i] * sin
        for k in range(samples):
            cell = _sample(x, y, right, up, k, rows, cols)
            if cell < 0:
                break
            if flat[cell] == 0:
                runs[n_runs, 0], runs[n_runs, 1] = cell, cell
                n_runs += 1
                continue
            if k > 0:  # inside an obstacle nothing is seen
                hit[n_hit] = cell
                n_hit += 1
            break
    return n_runs, n_hit


@njit(cache=True, nogil=True)
def ray_merge(
    occupied: Grid, observable: Grid, known: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats,
    range_px: float, hit: Cells, settled: bool,
) -> tuple[int, int, int]:  # fmt: skip
    """Scan as ``ray_scan`` does and set the free cells of the map at once: noting them first takes twice as long.

    Where ``settled``, what the map says is taken for true unseen: nothing moves, and the map has no errors. Obstacles
    that it has are not listed in ``hit``.

    Returns
    -------
    How many cells were unknown before, how many of those count, and how many entries there are in ``hit``.
    """
    flat, counts, drawn, (rows, cols) = occupied.ravel(), observable.ravel(), known.ravel(), occupied.shape
    cos, sin = math.cos(heading), math.sin(heading)
    samples = int(np.rint(range_px)) + 1
    room = _free_room(known, x, y, range_px) if settled else np.full((2, 2, 2), -1.0)
    new, covered, n_hit = 0, 0, 0
    for i in range(len(fan_cos)):
        right, up = fan_cos[i] * cos - fan_sin[i] * sin, fan_sin[i] * cos + fan_cos[i] * sin
        above, left = int(up > 0.0), int(right < 0.0)
        k = _samples_within(room[above, left, 0], room[above, left, 1], right, up, samples)
        while k < samples:
            cell = _sample(x, y, right, up, k, rows, cols)
            k += 1
            if cell < 0:
                break
            state = drawn[np.uint64(cell)]
            if settled and state == FREE:
                continue
            if settled and state != UNKNOWN:
                break
            if flat[np.uint64(cell)] != 0:
                if k > 1:  # inside an obstacle nothing is seen
                    hit[n_hit] = cell
                    n_hit += 1
                break
            if state == UNKNOWN:
                new += 1
                covered += int(counts[np.uint64(cell)])
            drawn[np.uint64(cell)] = FREE
    return new, covered, n_hit


@njit(inline="always")
def _sample(x: float, y: float, right: float, up: float, k: int, rows: int, cols: int) -> int:
    """Return the cell of sample k, flat; -1 off the grid."""
    col, row = np.rint(x - 0.5 + k * right), np.rint(y - 0.5 - k * up)  # cells' centres at whole numbers
    return int(row * cols + col) if 0.0 <= col < cols and 0.0 <= row < rows else -1


@njit(inline="always")
def _samples_within(wide: float, high: float, right: float, up: float, samples: int) -> int:
    """Return how many samples of a ray lie in a rectangle of so many cells across and along."""
    steps = min(wide / max(abs(right), 1e-9), high / max(abs(up), 1e-9))
    return int(min(max(steps, 0.0), float(samples)))


@njit(cache=True, nogil=True)
def _free_room(known: Grid, x: float, y: float, range_px: float) -> Floats:
    """Return (2, 2, 2): below and above, right and left of a place, how far known free cells go across and along."""
    rows, cols = known.shape
    x0, y0 = x - 0.5, y - 0.5
    col, row = int(np.rint(x0)), int(np.rint(y0))
    room = np.full((2, 2, 2), -1.0)
    if 0 <= col < cols and 0 <= row < rows:
        for above in range(2):
            for left in range(2):
                across, along = 1 - 2 * left, 1 - 2 * above
                free_cols, free_rows = free_corner(known, col, row, across, along, int(range_px))
                room[above, left, 0] = free_cols + (col - x0) * across
                room[above, left, 1] = free_rows + (row - y0) * along
    return room


@njit(cache=True, nogil=True)
def free_corner(known: Grid, col: int, row: int, across: int, along: int, far: int) -> tuple[int, int]:
    """Return how many columns and rows beyond a cell a rectangle of free cells goes, the biggest; -1 where none does.

    ``across`` and ``along`` are 1 or -1: right or left, down or up; at most ``far`` cells.
    """
    rows, cols = known.shape
    flat = known.ravel()
    wide = min(far, cols - 1 - col if across > 0 else col)
    last = min(far, rows - 1 - row if along > 0 else row)
    best_wide, best_high, best = -1, -1, 0
    for high in range(last + 1):
        line = (row + high * along) * cols + col
        first = line if across > 0 else line - wide
        free = True
        for cell in range(first, first + wide + 1):
            free &= flat[np.uint64(cell)] == FREE
        if not free:
            wide = -1
            while flat[np.uint64(line + (wide + 1) * across)] == FREE:  # something is not
                wide += 1
        if (wide + 1) * (high + 1) > best:
            best_wide, best_high, best = wide, high, (wide + 1) * (high + 1)
        elif (wide + 1) * (last + 1) <= best:  # nor can be
            break
    return best_wide, best_high
