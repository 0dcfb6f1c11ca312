"""Which free cells can be seen from where the robot can stand."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.ranges import distance
from houseexpo.pseudoslam.kernels.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Runs


@njit(cache=True, nogil=True)
def mark_in_sight(solid: Grid, wanted: Grid, nearest: Cells, range_px: float, visible: Grid) -> None:
    """Set ``visible`` to 1 where what is ``wanted`` sees the middle of its ``nearest`` (rows, cols) standing cell."""
    rows, cols = solid.shape
    for row in range(rows):
        for col in range(cols):
            if wanted[row, col] == 0 or visible[row, col] != 0:
                continue
            right, down = nearest[row, col] % cols - col, nearest[row, col] // cols - row
            way = math.hypot(right, down)
            if way <= range_px and distance(solid, col + 0.5, row + 0.5, right / way, down / way, way) >= way:
                visible[row, col] = 1


@njit(cache=True, nogil=True)
def mark_visible(
    solid: Grid,
    stand: Grid,
    wanted: Grid,
    near_px: float,
    range_px: float,
    visible: Grid,
    runs: Runs,
    hit: Cells,
    slopes: Floats,
) -> None:
    """Set ``visible`` to 1 where the middle of a free cell is seen from the middle of a standing cell.

    What is ``wanted`` and not visible yet looks round itself, for sight goes both ways: as far as ``near_px`` first,
    which is quick and mostly enough. A standing cell that was seen from afar looks back, for it sees the neighbours,
    too. ``runs``, ``hit`` and ``slopes`` are ``sector_scan``'s.
    """
    rows, cols = solid.shape
    flat, standing = visible.ravel(), stand.ravel()
    for row in range(rows):
        for col in range(cols):
            if wanted[row, col] == 0 or visible[row, col] != 0:
                continue
            x, y = col + 0.5, row + 0.5
            n_runs, _ = sector_scan(solid, x, y, 0.0, math.pi, min(near_px, range_px), runs, hit, slopes)
            if _first_of(standing, runs, n_runs) >= 0:
                visible[row, col] = 1
                continue
            n_runs, _ = sector_scan(solid, x, y, 0.0, math.pi, range_px, runs, hit, slopes)
            seen = _first_of(standing, runs, n_runs)
            if seen >= 0:
                visible[row, col] = 1
                x, y = seen % cols + 0.5, seen // cols + 0.5
                n_runs, _ = sector_scan(solid, x, y, 0.0, math.pi, range_px, runs, hit, slopes)
                for i in range(n_runs):
                    flat[runs[i, 0] : runs[i, 1] + 1] = 1


@njit(inline="always")
def _first_of(standing: Grid, runs: Runs, n_runs: int) -> int:
    """Return the first standing cell in runs, flat; -1 where there is none."""
    for i in range(n_runs):
        for cell in range(runs[i, 0], runs[i, 1] + 1):
            if standing[cell] != 0:
                return cell
    return -1
