"""Compute people's next steps to their goals over blocks of cells of the true house.

``find_next_blocks`` computes the next block on people's paths, for a disc that must not touch walls. A block's spot is
the cell closest to its centre in which the disc can stand, so that even a door slightly wider than the disc has spots.
Two neighbouring blocks are linked if the disc can go straight from one spot to the other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Grid, Rows, make_row_dtype

FLOW_SIZES = make_row_dtype(rows=int, cols=int, block_px=int, goals=int)
"""Rows and columns of blocks, cells per side of a block, number of goals."""
THERE, NOWHERE = 8, 255
"""Values of ``FlowField.toward`` other than the eight neighbours: the goal itself, and no path."""
FAR = np.iinfo(np.int32).max
"""The value of ``distances`` for no path."""
STEPS = np.array([(0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1)], np.int64)
"""The neighbours (row, col), counter-clockwise from the right."""
_STRAIGHT, _ACROSS = 5, 7  # costs: 7 / 5 is the square root of 2 to 1%


class FlowField(NamedTuple):
    """The paths to G goals on (rows, cols) blocks. In a pool, arrays have an additional first axis and are padded."""

    sizes: Rows
    """(1,) ``FLOW_SIZES``."""
    toward: npt.NDArray[np.uint8]
    """(G * rows * cols,), the neighbour to go to, ``THERE``, or ``NOWHERE``, for one goal after the other."""
    spots: Cells
    """(rows * cols, 2), the block's spot as row and column of a cell; -1 for none."""
    goals: Cells
    """(G,), flat indices of blocks."""


def no_flow_field() -> FlowField:
    """Return an empty flow, for no people."""
    return FlowField(np.zeros(1, FLOW_SIZES), np.zeros(0, np.uint8), np.zeros((0, 2), np.int32), np.zeros(0, np.int32))


@njit(cache=True, nogil=True)
def find_block_spots(traversable: Grid, block_px: int, spots: npt.NDArray[np.int32]) -> None:
    """Write each block's spot (rows, cols, 2); ``traversable`` is 1 for cells with space for a disc at the centre."""
    rows, cols = traversable.shape
    middle = (block_px - 1) / 2
    for i in range(spots.shape[0]):
        for j in range(spots.shape[1]):
            spots[i, j, 0], spots[i, j, 1] = -1, -1
            best = math.inf
            for row in range(i * block_px, min((i + 1) * block_px, rows)):
                for col in range(j * block_px, min((j + 1) * block_px, cols)):
                    off = (row - i * block_px - middle) ** 2 + (col - j * block_px - middle) ** 2
                    if traversable[row, col] != 0 and off < best:
                        best = off
                        spots[i, j, 0], spots[i, j, 1] = row, col


@njit(cache=True, nogil=True)
def find_block_links(traversable: Grid, spots: npt.NDArray[np.int32], links: Grid) -> None:
    """Set bit ``1 << k`` of ``links`` (rows, cols) for blocks that are linked to their neighbour ``STEPS[k]``."""
    rows, cols, _ = spots.shape
    links[:] = 0
    for i in range(rows):
        for j in range(cols):
            for k in range(4):  # the other four are the same links from the other end
                row, col = i + STEPS[k, 0], j + STEPS[k, 1]
                if not (0 <= row < rows and 0 <= col < cols) or spots[i, j, 0] < 0 or spots[row, col, 0] < 0:
                    continue
                if _straight(traversable, spots[i, j, 0], spots[i, j, 1], spots[row, col, 0], spots[row, col, 1]):
                    links[i, j] |= 1 << k
                    links[row, col] |= 1 << (k + 4)


@njit(cache=True, nogil=True)
def _straight(traversable: Grid, row: int, col: int, end_row: int, end_col: int) -> bool:
    """Return whether all cells on a line are standing cells or beside one, since rounding may miss a narrow passage."""
    rows, cols = traversable.shape
    down, right = end_row - row, end_col - col
    samples = 2 * max(abs(down), abs(right), 1)
    for i in range(1, samples):
        r, c = round(row + down * i / samples), round(col + right * i / samples)
        near = traversable[r, c] | traversable[max(r - 1, 0), c] | traversable[min(r + 1, rows - 1), c]
        if (near | traversable[r, max(c - 1, 0)] | traversable[r, min(c + 1, cols - 1)]) == 0:
            return False
    return True


@njit(cache=True, nogil=True)
def find_block_distances(links: Grid, goal: int, distances: npt.NDArray[np.int32], queue: Cells, queued: Grid) -> None:
    """Write the shortest distance from each block to a goal in fifths of a block, ``FAR`` if there is no path.

    Blocks with a reduced distance wait in a ring buffer until their neighbours are updated; the distances do not depend
    on the order.

    Parameters
    ----------
    goal
        Flat index of a block.
    queue, queued
        (rows * cols,) scratch.
    """
    cols = links.shape[1]
    flat, joined = distances.ravel(), links.ravel()
    flat[:], queued[:] = FAR, 0
    flat[goal], queue[0], queued[goal] = 0, goal, 1
    first, waiting = 0, 1
    while waiting > 0:
        block = queue[first]
        first, waiting = (first + 1) % len(queue), waiting - 1
        queued[block] = 0
        for k in range(8):
            if joined[block] >> k & 1:
                other = block + STEPS[k, 0] * cols + STEPS[k, 1]
                length = flat[block] + (_ACROSS if k & 1 else _STRAIGHT)
                if length < flat[other]:
                    flat[other] = length
                    if queued[other] == 0:
                        queue[(first + waiting) % len(queue)] = other
                        queued[other] = 1
                        waiting += 1


@njit(cache=True, nogil=True)
def find_next_blocks(links: Grid, distances: npt.NDArray[np.int32], toward: Grid) -> None:
    """Write the next step from each block (rows, cols); of equally short ones, the first in ``STEPS``.

    Blocks without a path, at whose rim a disc may still be, lead to the neighbour that is closest to the goal.
    """
    rows, cols = links.shape
    for i in range(rows):
        for j in range(cols):
            toward[i, j] = NOWHERE
            if distances[i, j] == 0:
                toward[i, j] = THERE
                continue
            lost = distances[i, j] == FAR
            best = FAR
            for k in range(8):
                row, col = i + STEPS[k, 0], j + STEPS[k, 1]
                if not (0 <= row < rows and 0 <= col < cols) or distances[row, col] == FAR:
                    continue
                length = distances[row, col] + (_ACROSS if k & 1 else _STRAIGHT)
                if (lost or links[i, j] >> k & 1) and length < best:
                    best = length
                    toward[i, j] = k
