"""Define the types of kernels' arguments: array aliases, tuples of parameters, working memory, and record dtypes.

``make_row_dtype`` makes a NumPy record dtype. ``PathScratch`` is a thread's working memory for plans.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from numba import njit

Grid: TypeAlias = npt.NDArray[np.uint8]
"""A grid (rows, cols), in C order."""
Kinds: TypeAlias = npt.NDArray[np.uint16]
"""The contents of blocks of a map, see ``crop_view``."""
Bits: TypeAlias = npt.NDArray[np.uint16]
"""Sets of a team's robots: bit k stands for robot k."""
Cells: TypeAlias = npt.NDArray[np.int32]
"""Flat indices of cells, row * cols + col."""
Offsets: TypeAlias = npt.NDArray[np.int16]
"""Offsets (n, 2): rows down and columns to the right."""
Runs: TypeAlias = npt.NDArray[np.int32]
"""Runs (n, 2): flat indices of the first and the last of adjacent cells in a row."""
Floats: TypeAlias = npt.NDArray[np.float64]
Counts: TypeAlias = npt.NDArray[np.int64]
Rows: TypeAlias = Any
"""Records (n,) with named fields, see ``make_row_dtype``; an array, whose static type does not know the names."""


def make_row_dtype(**parts: type) -> np.dtype[Any]:
    """Return the type of records with named numbers: ``rows[i].x``, also in kernels, or ``rows["x"]`` for all rows.

    Each number is aligned.
    """
    return np.dtype((np.record, np.dtype(list(parts.items()), align=True)))


NO_STAND, NO_WAY = -1, np.iinfo(np.int32).max
"""Values of ``PathScratch.ways``: cells where the robot cannot stand, and standing cells that it cannot reach."""


class RobotBody(NamedTuple):
    """The robot: a disc, and its largest distance and turn between two scans."""

    radius_px: float
    between_px: float
    between_rad: float


NO_DRIVE, DIFFERENTIAL, ACKERMANN = range(3)
"""Values of ``Drive.kind``."""


class Drive(NamedTuple):
    """How the robot follows its commands: nothing to follow, or the limits of a drive.

    Largest changes of the speed, pixels per second squared, and of the second part of the velocity: of the speed of
    turning, radians per second squared, or of the steering angle, radians per second; and the distance of a car's
    axles, pixels.
    """

    kind: int
    acceleration: float
    turning_rate: float
    wheelbase_px: float


class Sensor(NamedTuple):
    """The laser: whether it follows single rays or fills its sector, and its fan from right to left."""

    by_rays: bool
    half_fov: float
    range_px: float
    fan_cos: Floats
    fan_sin: Floats


class Errors(NamedTuple):
    """Noise: ``any`` says whether there is any, ``odometry`` and ``beams`` whether there is noise of that kind.

    For a beam: the standard deviation along it, and the probabilities that it returns nothing or the largest range. For
    a step's registration: standard deviations of shift and rotation. For odometry: standard deviations of the distance
    and of the turn as shares of them, and of the turn per pixel of distance; and a model with its parameters
    (``odometry``), the mean share of a step that slips, and the random walk of the heading's bias, radians per
    second and root of a second.
    """

    any: bool
    odometry: bool
    beams: bool
    laser_px: float
    drop_out: float
    max_range: float
    shift_px: float
    turn_rad: float
    way_share: float
    turn_share: float
    turn_rad_px: float
    modelled: bool
    alphas: tuple[float, float, float, float]
    slip: float
    bias: float


class PathScratch(NamedTuple):
    """Working memory of a thread for paths (``planning.paths``) on grids up to a number of cells, which are flat.

    ``find_distances`` overwrites it in each call; nothing has to be reset between houses.
    """

    box: Counts
    """(5,), the rows and columns in use, ends excluded, and the grid's number of columns."""
    closed: Grid
    """(cells,), 1 for cells in the box that are not open."""
    ways: Cells
    """(cells,), the distance to each standing cell, ``NO_STAND`` or ``NO_WAY``; ``NO_STAND`` outside the box."""
    queue: Cells
    """(3, cells), working memory."""
    marks: Grid
    """(cells,), working memory, which is 0 between calls."""


class Scratch(NamedTuple):
    """Working memory of a thread: for ``sector_scan`` and ``ray_scan``, an empty patch for noisy scans, and plans."""

    runs: Runs
    hit: Cells
    slopes: Floats
    patch: Grid
    ways: PathScratch


def as_read_only(grid: Grid) -> Grid:
    """Return a view of a grid that kernels may not write to, like the rasters of worlds.

    numba compiles a kernel once for read-only arrays and once for others, which takes up to a second.
    """
    view = grid.view()
    view.flags.writeable = False
    return view


def new_path_scratch(cells: int) -> PathScratch:
    """Return working memory for grids of this number of cells."""
    return PathScratch(
        np.zeros(5, np.int64),
        np.zeros(cells, np.uint8),
        np.full(cells, NO_STAND, np.int32),
        np.empty((3, cells), np.int32),
        np.zeros(cells, np.uint8),
    )


@njit(inline="always")
def as_int64(value: int) -> int:
    """Return a number as a variable of 64 bits.

    numba would compile a function again for a constant or a number of 32 bits, which takes seconds at the first step.
    """
    return np.int64(value)  # type: ignore[return-value]  # an int to all who use it


@njit(inline="always")
def as_bool(value: bool) -> bool:
    """Return a truth value as a variable, for the same reason."""
    return np.bool_(value)  # type: ignore[return-value]  # a bool to all who use it
