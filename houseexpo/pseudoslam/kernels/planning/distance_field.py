"""The robot's distances to a goal: fast marching (Sethian, 1996) over blocks of cells where it can stand."""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.types import Grid, Rows, row_type

FIELD_SIZES = row_type(rows=int, cols=int, side_px=int)
"""Rows and columns of blocks, and cells per side of a block."""


class Field(NamedTuple):
    """Distances to a goal. In a pool, the arrays have an additional first axis and the length of the longest."""

    sizes: Rows
    """(1,) ``FIELD_SIZES``."""
    distances: npt.NDArray[np.float32]
    """(rows * cols,), distance from each block's centre in pixels; infinite if there is no path."""


def no_field() -> Field:
    """Return an empty field, for no goal."""
    return Field(np.zeros(1, FIELD_SIZES), np.zeros(0, np.float32))


@njit(cache=True, nogil=True)
def field_of(pool: Field, i: int) -> Field:
    """Return environment ``i``'s part of a pool, as a view."""
    return Field(pool.sizes[i], pool.distances[i])


@njit(cache=True, nogil=True)
def field_at(field: Field, x: float, y: float) -> float:
    """Return the distance to the goal from a place in pixels, interpolated between blocks that have a path."""
    size = field.sizes[0]
    rows, cols, side = size.rows, size.cols, size.side_px
    across, down = x / side - 0.5, y / side - 0.5
    col, row = math.floor(across), math.floor(down)
    total, weights = 0.0, 0.0
    for i in range(2):
        for j in range(2):
            r, c = min(max(row + i, 0), rows - 1), min(max(col + j, 0), cols - 1)
            distance = field.distances[r * cols + c]
            weight = (1.0 - abs(down - row - i)) * (1.0 - abs(across - col - j)) + 1e-9
            if distance < math.inf:
                total += weight * distance
                weights += weight
    return total / weights if weights > 0.0 else math.inf


@njit(cache=True, nogil=True)
def find_open(traversable: Grid, side: int, is_open: Grid) -> None:
    """Set ``is_open`` (rows, cols of blocks) to 1 for blocks with a cell where the robot can stand."""
    rows, cols = traversable.shape
    for row in range(rows):
        for col in range(cols):
            if traversable[row, col] != 0:
                is_open[row // side, col // side] = 1


@njit(cache=True, nogil=True)
def march(is_open: Grid, row: int, col: int, side: int, distances: npt.NDArray[np.float32]) -> None:
    """Write the distance from each open block to the block (row, col), pixels, into ``distances`` (rows, cols)."""
    rows, cols = is_open.shape
    distances[:] = math.inf
    done = np.zeros((rows, cols), np.uint8)
    distances[row, col] = 0.0
    heap = [(0.0, row * cols + col)]
    while len(heap) > 0:
        cell = heapq.heappop(heap)[1]
        r, c = cell // cols, cell % cols
        if done[r, c] != 0:
            continue
        done[r, c] = 1
        for down, across in ((0, 1), (0, -1), (1, 0), (-1, 0)):
            i, j = r + down, c + across
            if 0 <= i < rows and 0 <= j < cols and is_open[i, j] != 0 and done[i, j] == 0:
                found = _arrival(distances, i, j, float(side))
                if found < distances[i, j]:
                    distances[i, j] = found
                    heapq.heappush(heap, (found, i * cols + j))


@njit(cache=True, nogil=True)
def _arrival(distances: npt.NDArray[np.float32], row: int, col: int, side: float) -> float:
    """Return the arrival of the front at a block: a plane wave through the closer neighbour on each axis."""
    rows, cols = distances.shape
    one = min(
        float(distances[row, col - 1]) if col > 0 else math.inf,
        float(distances[row, col + 1]) if col < cols - 1 else math.inf,
    )
    other = min(
        float(distances[row - 1, col]) if row > 0 else math.inf,
        float(distances[row + 1, col]) if row < rows - 1 else math.inf,
    )
    if abs(one - other) >= side:  # also if one is infinite
        return min(one, other) + side
    return (one + other + math.sqrt(2.0 * side * side - (one - other) ** 2)) / 2.0
