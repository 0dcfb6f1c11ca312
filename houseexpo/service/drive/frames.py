"""Encode a frame for the browser: changed cells of the map, pose and scores, the laser's beams, bodies in sight.

A frame is little endian: ``HEAD``; six float32 for each body in sight (its number, x, y, radius, and velocity across
and down, cells a second); a uint16 for each beam (its length in 1/32 of a cell); then the cells of the changed
rectangle, row by row, as runs: a uint16 each, the two highest bits are the state (0 unknown, 1 free, 2 obstacle), the
others the number of cells.
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.render.sight import Sight

Grid = npt.NDArray[np.uint8]

HEAD: Final = struct.Struct("<BBHIIffffffHHHHHH")
"""Kind (1), flags, bumps, number, steps so far, pose (x across, y down, heading), explored m2, coverage, path m, the
rectangle's first row and column, rows and columns, bodies, beams."""
KIND: Final = 1
SAVED: Final = 2
"""The first byte of a saved run; a zip archive follows."""
COLLIDED: Final = 1
ENDED: Final = 2
SUCCESS: Final = 4
LONGEST_RUN: Final = (1 << 14) - 1
STEPS_PER_CELL: Final = 32

_CODES: Final = np.zeros(256, np.uint16)
_CODES[[FREE, OBSTACLE]] = 1 << 14, 2 << 14


class RobotReport(NamedTuple):
    """The state of the robot; ``pose_px`` is the pose by odometry, ``bumps`` are counted by ``robots.BumpCounter``."""

    number: int
    flags: int
    bumps: int
    steps: int
    pose_px: tuple[float, float, float]
    explored_m2: float
    coverage: float
    path_m: float


class MapDelta(NamedTuple):
    """The rectangle of the map that contains all changes, as runs."""

    row: int
    col: int
    rows: int
    cols: int
    runs: npt.NDArray[np.uint16]


class SentMap:
    """The map that the browser has; at first all of it is unknown."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._sent = np.zeros(shape, np.uint8)

    def update(self, known: Grid) -> MapDelta:
        """Return the changes since the last call: a rectangle of cells, empty without changes."""
        changed = known != self._sent
        rows = np.flatnonzero(changed.any(axis=1))
        if not len(rows):
            return MapDelta(0, 0, 0, 0, np.empty(0, np.uint16))
        top, bottom = int(rows[0]), int(rows[-1]) + 1
        cols = np.flatnonzero(changed[top:bottom].any(axis=0))
        left, right = int(cols[0]), int(cols[-1]) + 1
        part = known[top:bottom, left:right]
        self._sent[top:bottom, left:right] = part
        return MapDelta(top, left, bottom - top, right - left, encode_runs(part))


def encode_runs(cells: Grid) -> npt.NDArray[np.uint16]:
    """Return cells of a map (rows, cols) as runs, row by row."""
    codes = _CODES[cells.ravel()]
    starts = np.concatenate([[0], np.flatnonzero(codes[1:] != codes[:-1]) + 1])
    lengths = np.diff(starts, append=len(codes))
    pieces = -(-lengths // LONGEST_RUN)
    values = codes[starts].repeat(pieces)
    full = np.full(len(values), LONGEST_RUN)
    ends = np.cumsum(pieces) - 1
    full[ends] = lengths - (pieces - 1) * LONGEST_RUN
    runs: npt.NDArray[np.uint16] = values | full.astype(np.uint16)
    return runs


def encode_frame(report: RobotReport, delta: MapDelta, sight: Sight) -> bytes:
    """Return a frame."""
    head = HEAD.pack(
        KIND, report.flags, min(report.bumps, 65535), report.number, report.steps, *report.pose_px, report.explored_m2,
        report.coverage, report.path_m, *delta[:4], len(sight.bodies), len(sight.ranges),
    )  # fmt: skip
    beams = np.minimum(sight.ranges * STEPS_PER_CELL, 65535).astype("<u2")
    return b"".join([head, sight.bodies.astype("<f4").tobytes(), beams.tobytes(), delta.runs.astype("<u2").tobytes()])
