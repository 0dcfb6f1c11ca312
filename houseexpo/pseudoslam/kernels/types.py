"""What kernels take: names of arrays, and arrays that go together."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Grid: TypeAlias = npt.NDArray[np.uint8]
"""(rows, cols), C order."""
Kinds: TypeAlias = npt.NDArray[np.uint16]
"""What blocks of a map hold, see ``crop``."""
Cells: TypeAlias = npt.NDArray[np.int32]
"""Flat indices, row * cols + col."""
Offsets: TypeAlias = npt.NDArray[np.int16]
"""(n, 2) rows down and columns to the right."""
Runs: TypeAlias = npt.NDArray[np.int32]
"""(n, 2) flat indices: the first and the last of cells side by side in a row."""
Floats: TypeAlias = npt.NDArray[np.float64]
Counts: TypeAlias = npt.NDArray[np.int64]
Rows: TypeAlias = Any
"""(n,) rows whose parts have names, see ``row_type``: an array, though its types know no names of parts."""


def row_type(**parts: type) -> np.dtype[Any]:
    """Return the type of rows of numbers with names: ``rows[i].x``, in kernels too, or ``rows["x"]`` of all of them."""
    return np.dtype((np.record, list(parts.items())))


NO_STAND, NO_WAY = -1, np.iinfo(np.int32).max
"""In ``KnownWays.ways``: where the robot may not stand, and where it may, but cannot get to."""


class Robot(NamedTuple):
    """A disc, and how far it goes or turns at most between two scans."""

    radius_px: float
    between_px: float
    between_rad: float


class Sensor(NamedTuple):
    """A laser: whether its rays are followed one by one or its sector is filled; its fan from the right to the left."""

    by_rays: bool
    half_fov: float
    range_px: float
    fan_cos: Floats
    fan_sin: Floats


class Errors(NamedTuple):
    """Noise: ``any`` says whether there is some, ``odometry`` and ``beams`` whether there is of that kind.

    Of a beam: the standard deviation along it and the chances that it returns nothing, or its greatest range; of a
    step's registration: standard deviations of shift and turn; of odometry: of the way as a share of it, of the turn as
    a share of it, of the turn for each pixel of way.
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


class KnownWays(NamedTuple):
    """Memory for a thread's plans (``planning.known_ways``), for grids of so many cells; they lie flat.

    ``find_ways`` fills it anew at each call; nothing has to be reset between houses.
    """

    box: Counts
    """(5,) the rows and columns, ends excluded, that hold something, and the grid's columns."""
    closed: Grid
    """(cells,) within the box, 1 where a cell is not open."""
    ways: Cells
    """(cells,) the way to each standing cell, ``NO_STAND`` or ``NO_WAY``; ``NO_STAND`` outside the box."""
    queue: Cells
    """(3, cells) scratch."""
    marks: Grid
    """(cells,) scratch: what is left in it is 0."""


class Scratch(NamedTuple):
    """Memory that a thread uses: ``sector_scan``'s and ``ray_scan``'s, an empty patch for noisy ones, and for plans."""

    runs: Runs
    hit: Cells
    slopes: Floats
    patch: Grid
    ways: KnownWays


def known_ways_of(cells: int) -> KnownWays:
    """Return memory for grids of so many cells."""
    return KnownWays(
        np.zeros(5, np.int64),
        np.zeros(cells, np.uint8),
        np.full(cells, NO_STAND, np.int32),
        np.empty((3, cells), np.int32),
        np.zeros(cells, np.uint8),
    )
