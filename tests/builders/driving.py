"""What a browser does with a robot: it reads frames, adds them up to a map, and says what it has drawn."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo import FloorPlan
from houseexpo.service.drive.frames import FINE, HEAD, KIND

VALUES = np.array([0, 127, 255], np.uint8)


class Frame(NamedTuple):
    flags: int
    bumps: int
    number: int
    steps: int
    pose: tuple[float, float, float]
    explored_m2: float
    coverage: float
    path_m: float
    rect: tuple[int, int, int, int]
    cells: npt.NDArray[np.uint8]
    bodies: npt.NDArray[np.float32]
    ranges: npt.NDArray[np.float64]


def frame_from(data: bytes) -> Frame:
    """Read a frame, run by run."""
    kind, flags, bumps, number, steps, *rest = HEAD.unpack_from(data)
    assert kind == KIND
    x, y, heading, explored, coverage, path, row, col, rows, cols, bodies, beams = rest
    at = HEAD.size
    places = np.frombuffer(data, "<f4", 6 * bodies, at).reshape(-1, 6)
    at += 24 * bodies
    ranges = np.frombuffer(data, "<u2", beams, at) / FINE
    cells: list[int] = []
    for run in np.frombuffer(data, "<u2", offset=at + 2 * beams).tolist():
        cells += [int(VALUES[run >> 14])] * (run & 0x3FFF)
    found = np.array(cells, np.uint8).reshape(rows, cols)
    rect = (row, col, rows, cols)
    return Frame(flags, bumps, number, steps, (x, y, heading), explored, coverage, path, rect, found, places, ranges)


def painted(known: npt.NDArray[np.uint8], frame: Frame) -> None:
    """Paint what changed on a map."""
    row, col, rows, cols = frame.rect
    known[row : row + rows, col : col + cols] = frame.cells


def two_rooms(name: str = "two_rooms") -> FloorPlan:
    """Return a house of two rooms of 4 x 4 m with a doorway between them."""
    ring = [
        (0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 2.6), (4.3, 2.6), (4.3, 4.1), (8.3, 4.1), (8.3, 0.1), (4.3, 0.1),
        (4.3, 1.6), (4.1, 1.6), (4.1, 0.1),
    ]  # fmt: skip
    return FloorPlan(name, ring, 2, {"Bedroom": [(0.1, 0.1, 4.1, 4.1)], "Kitchen": [(4.3, 0.1, 8.3, 4.1)]})


def start(**words: Any) -> dict[str, Any]:
    """Return the first message of a browser."""
    return {"do": "start", "plan": "two_rooms", **words}
