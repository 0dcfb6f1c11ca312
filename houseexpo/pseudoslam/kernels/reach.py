"""Which free cells can be seen from where the robot can stand."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.ranges import distance
from houseexpo.pseudoslam.kernels.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Runs

NOWHERE = 1 << 14
"""Cells down and to the right where no standing cell was found, or nearly so many."""


@njit(cache=True, nogil=True)
def find_standing(stand: Grid, wanted: Grid, away: Cells) -> None:
    """Write how many rows down and columns to the right of each wanted cell the nearest standing cell lies, or nearly.

    Neighbours tell each other which one is near them, once from the upper left on and once back: what lies behind
    corners finds none, or not the nearest.

    Parameters
    ----------
    stand, wanted
        (rows, cols), not 0 where the robot can stand, and in the cells that are asked for: none of them on the border.
    away
        (rows, cols, 2) is filled: 0 in standing cells, ``NOWHERE`` in others that are not wanted.
    """
    rows, cols = stand.shape
    for row in range(rows):
        for col in range(cols):
            far = 0 if stand[row, col] != 0 else NOWHERE
            away[row, col, 0], away[row, col, 1] = far, far
            if far > 0 and wanted[row, col] != 0:
                _ask(away, row, col, -1, 0)
                _ask(away, row, col, 0, -1)
    for row in range(rows - 1, -1, -1):
        for col in range(cols - 1, -1, -1):
            if stand[row, col] == 0 and wanted[row, col] != 0:
                _ask(away, row, col, 1, 0)
                _ask(away, row, col, 0, 1)


@njit(inline="always")
def _ask(away: Cells, row: int, col: int, down: int, right: int) -> None:
    """Take over a neighbour's standing cell where it is nearer than the own."""
    far_down, far_right = away[row + down, col + right, 0] + down, away[row + down, col + right, 1] + right
    if far_down**2 + far_right**2 < away[row, col, 0] ** 2 + away[row, col, 1] ** 2:
        away[row, col, 0], away[row, col, 1] = far_down, far_right


@njit(cache=True, nogil=True)
def mark_in_sight(solid: Grid, wanted: Grid, away: Cells, sure_px: float, range_px: float, visible: Grid) -> None:
    """Set ``visible`` to 1 where what is ``wanted`` sees the middle of the standing cell that lies ``away``.

    Within ``sure_px``, at most the robot's radius, nothing can be between them, for the robot itself has room there.
    """
    rows, cols = solid.shape
    for row in range(rows):
        for col in range(cols):
            if wanted[row, col] == 0 or visible[row, col] != 0:
                continue
            down, right = away[row, col, 0], away[row, col, 1]
            way = math.sqrt(down * down + right * right)
            if way <= sure_px or (
                way <= range_px and distance(solid, col + 0.5, row + 0.5, right / way, down / way, way) >= way
            ):
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
                    for cell in range(runs[i, 0], runs[i, 1] + 1):
                        flat[cell] = 1


@njit(inline="always")
def _first_of(standing: Grid, runs: Runs, n_runs: int) -> int:
    """Return the first standing cell in runs, flat; -1 where there is none."""
    for i in range(n_runs):
        for cell in range(runs[i, 0], runs[i, 1] + 1):
            if standing[cell] != 0:
                return cell
    return -1
