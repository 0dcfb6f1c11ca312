"""The scan of the published simulator: unit steps along each ray of a fan, to the first obstacle.

Sample k of a ray is the cell whose centre is nearest to the point k pixels along it, k = 0 to the range rounded; the
first that is solid ends the ray and is seen, too.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Runs

_EVEN = 6755399441055744.0  # 1.5 * 2**52: adding and taking it away rounds, halves to even, as np.rint does
_BLOCK = 32  # samples whose cells are found together, for the processor does four or eight at a time


@njit(cache=True, nogil=True)
def ray_scan(
    solid: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats, range_px: float,
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
    flat = solid.ravel()
    cos, sin = math.cos(heading), math.sin(heading)
    places, offsets = np.empty(_BLOCK), np.arange(_BLOCK).astype(np.float64)
    cells = places.view(np.uint32)
    n_runs, n_hit = 0, 0
    for i in range(len(fan_cos)):
        right, up = fan_cos[i] * cos - fan_sin[i] * sin, fan_sin[i] * cos + fan_cos[i] * sin
        samples = _on_grid(solid, x, y, right, up, range_px)
        k = 0
        while k < samples:
            stop = min(samples - k, _BLOCK)
            _find(places, offsets, x, y, right, up, k, stop, solid.shape[1])
            for t in range(stop):
                cell = np.uint64(cells[np.uint64(2 * t)])
                if flat[cell] == 0:
                    runs[n_runs, 0], runs[n_runs, 1] = cell, cell
                    n_runs += 1
                    continue
                if k + t > 0:  # inside an obstacle nothing is seen
                    hit[n_hit] = cell
                    n_hit += 1
                k = samples
                break
            k += _BLOCK
    return n_runs, n_hit


@njit(cache=True, nogil=True)
def ray_merge(
    solid: Grid, countable: Grid, known: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats,
    range_px: float, hit: Cells, settled: bool,
) -> tuple[int, int, int]:  # fmt: skip
    """Scan as ``ray_scan`` does and set the free cells of the map at once: noting them first takes twice as long.

    Where ``settled``, what the map says is free is taken for free unseen: nothing moves, and the map has no errors.

    Returns
    -------
    How many cells were unknown before, how many of those count, and how many entries there are in ``hit``.
    """
    flat, counts, drawn = solid.ravel(), countable.ravel(), known.ravel()
    cos, sin = math.cos(heading), math.sin(heading)
    places, offsets = np.empty(_BLOCK), np.arange(_BLOCK).astype(np.float64)
    cells = places.view(np.uint32)
    new, covered, n_hit = 0, 0, 0
    for i in range(len(fan_cos)):
        right, up = fan_cos[i] * cos - fan_sin[i] * sin, fan_sin[i] * cos + fan_cos[i] * sin
        samples = _on_grid(solid, x, y, right, up, range_px)
        k = 0
        while k < samples:
            stop = min(samples - k, _BLOCK)
            _find(places, offsets, x, y, right, up, k, stop, solid.shape[1])
            for t in range(stop):
                cell = np.uint64(cells[np.uint64(2 * t)])
                state = drawn[cell]
                if state == FREE and settled:
                    continue
                if flat[cell] == 0:
                    if state == UNKNOWN:
                        new += 1
                        covered += int(counts[cell])
                    drawn[cell] = FREE
                    continue
                if k + t > 0:
                    hit[n_hit] = cell
                    n_hit += 1
                k = samples
                break
            k += _BLOCK
    return new, covered, n_hit


@njit(inline="always")
def _on_grid(solid: Grid, x: float, y: float, right: float, up: float, range_px: float) -> int:
    """Return how many samples of a ray lie within range and on the grid, up to the first that does not."""
    rows, cols = solid.shape
    samples = int(range_px + _EVEN - _EVEN) + 1
    x0, y0 = x - 0.5, y - 0.5
    safe = samples  # those before it lie between the outer cells' centres
    for start, by, last in ((x0, right, cols - 1.0), (y0, -up, rows - 1.0)):
        if not 0.0 <= start <= last:
            safe = 0
        elif by != 0.0:
            to_border = ((last if by > 0.0 else 0.0) - start) / by
            if to_border < safe:
                safe = int(to_border)
    for k in range(safe, samples):
        if not (0.0 <= x0 + k * right + _EVEN - _EVEN < cols and 0.0 <= y0 - k * up + _EVEN - _EVEN < rows):
            return k
    return samples


@njit(inline="always")
def _find(
    places: Floats, offsets: Floats, x: float, y: float, right: float, up: float, k: int, stop: int, cols: int
) -> None:
    """Write the flat indices of ``stop`` samples, k and on, into the lower halves of ``places``, (32,)."""
    x0, y0 = x - 0.5, y - 0.5  # cells' centres at whole numbers
    first, width = float(k), float(cols)
    for t in range(stop):
        at = first + offsets[np.uint64(t)]
        col, row = x0 + at * right + _EVEN - _EVEN, y0 - at * up + _EVEN - _EVEN
        places[np.uint64(t)] = row * width + col + _EVEN
