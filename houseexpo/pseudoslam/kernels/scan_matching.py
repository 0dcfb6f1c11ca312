"""Draw scans on a grid as evidence, and find a scan's pose on it by correlative scan matching (Olson, ICRA 2009).

The evidence of a cell is a whole number: a beam that ends in it adds ``HIT``, one that passes through it adds ``MISS``,
within ``LEAST`` and ``MOST``. Above 0 the cell is an obstacle, below 0 it is free, at 0 it is unknown.

A pose's score is the mean, over the ends of the beams, of a field around the obstacles: 1 in their cells and
exp(-d^2 / 2) at a distance of d cells, interpolated between the centres of cells, 0 beyond ``REACH``.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Floats, Grid

Evidence: TypeAlias = npt.NDArray[np.int16]
"""The evidence (rows, cols) of each cell."""

HIT, MISS, LEAST, MOST = 3, -1, -12, 24
REACH = 2
"""Cells; the field is 0 farther than that from obstacles, along rows or columns."""
INSIDE_PX = 0.5
"""A beam ends on the near side of a cell: its end is taken so much farther, inside the cell."""
COARSE, FINE_LEVELS = 2, 4
"""Steps to each side in the coarse search; and the levels of the fine one, each with half the step of the last."""


@njit(cache=True, nogil=True)
def add_scan(
    evidence: Evidence, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats, ranges: Floats,
    range_px: float,
) -> None:  # fmt: skip
    """Add a scan to the evidence.

    Parameters
    ----------
    x, y, heading
        The pose, pixels (y down) and radians (counter-clockwise).
    fan_cos, fan_sin, ranges
        (n,), the beams' directions relative to the heading, and their ranges in pixels: 0 for a lost beam, which adds
        nothing; ``range_px`` or more for a beam that meets nothing.
    """
    rows, cols = evidence.shape
    cos, sin = math.cos(heading), math.sin(heading)
    for i in range(len(ranges)):
        reach = ranges[i]
        if reach <= 0.0:
            continue
        right = fan_cos[i] * cos - fan_sin[i] * sin
        down = -(fan_sin[i] * cos + fan_cos[i] * sin)
        hits = reach < range_px
        end_col, end_row = -1, -1
        if hits:
            end_col, end_row = math.floor(x + (reach + INSIDE_PX) * right), math.floor(y + (reach + INSIDE_PX) * down)
        last_col, last_row = -1, -1
        for k in range(math.floor(min(reach, range_px)) + 1):
            col, row = math.floor(x + k * right), math.floor(y + k * down)
            if (col == last_col and row == last_row) or (col == end_col and row == end_row):
                continue
            last_col, last_row = col, row
            if 0 <= row < rows and 0 <= col < cols:
                evidence[row, col] = max(evidence[row, col] + MISS, LEAST)
        if hits and 0 <= end_row < rows and 0 <= end_col < cols:
            evidence[end_row, end_col] = min(evidence[end_row, end_col] + HIT, MOST)


@njit(cache=True, nogil=True)
def evidence_to_map(evidence: Evidence, known: Grid) -> None:
    """Write the map (rows, cols) that the evidence shows."""
    for row in range(evidence.shape[0]):
        for col in range(evidence.shape[1]):
            value = evidence[row, col]
            known[row, col] = OBSTACLE if value > 0 else FREE if value < 0 else UNKNOWN


@njit(cache=True, nogil=True)
def draw_score_field(evidence: Evidence, top: int, left: int, field: Floats) -> None:
    """Draw the field (side, side) around the obstacles of a square of the evidence, whose corner is (top, left)."""
    side = len(field)
    field[:] = 0.0
    for row in range(max(top - REACH, 0), min(top + side + REACH, evidence.shape[0])):
        for col in range(max(left - REACH, 0), min(left + side + REACH, evidence.shape[1])):
            if evidence[row, col] <= 0:
                continue
            for i in range(max(row - REACH, top), min(row + REACH + 1, top + side)):
                for j in range(max(col - REACH, left), min(col + REACH + 1, left + side)):
                    value = math.exp(-0.5 * ((i - row) ** 2 + (j - col) ** 2))
                    field[i - top, j - left] = max(field[i - top, j - left], value)


@njit(cache=True, nogil=True)
def score_pose(field: Floats, top: int, left: int, x: float, y: float, heading: float, ends: Floats) -> float:
    """Return the mean of the field at the ends (n, 2) of a scan: pixels ahead and to the left of the robot."""
    side = len(field)
    cos, sin = math.cos(heading), math.sin(heading)
    total = 0.0
    for i in range(len(ends)):
        across = x + ends[i, 0] * cos - ends[i, 1] * sin - left - 0.5
        along = y - ends[i, 0] * sin - ends[i, 1] * cos - top - 0.5
        col, row = math.floor(across), math.floor(along)
        if not (0 <= row < side - 1 and 0 <= col < side - 1):
            continue
        u, v = across - col, along - row
        total += (1.0 - v) * ((1.0 - u) * field[row, col] + u * field[row, col + 1])
        total += v * ((1.0 - u) * field[row + 1, col] + u * field[row + 1, col + 1])
    return total / len(ends)


@njit(cache=True, nogil=True)
def find_best_pose(
    field: Floats, top: int, left: int, pose: Floats, ends: Floats, step_px: float, step_rad: float, doubt: float,
    found: Floats,
) -> float:  # fmt: skip
    """Write the pose (3,) with the best value near a predicted one, and return its score.

    The value is the score less ``doubt`` times the squared distance from the prediction, in steps of shift and turn.
    The poses within ``COARSE`` steps are tried, then those beside the best one with half the step, and so on.
    """
    best_x, best_y, best_turn = 0.0, 0.0, 0.0
    for level in range(FINE_LEVELS + 1):
        reach, share = COARSE if level == 0 else 1, 0.5**level
        from_x, from_y, from_turn, best = best_x, best_y, best_turn, -math.inf
        for a in range(-reach, reach + 1):
            for b in range(-reach, reach + 1):
                for c in range(-reach, reach + 1):
                    right, down, turn = from_x + b * share, from_y + c * share, from_turn + a * share
                    value = score_pose(
                        field, top, left, pose[0] + right * step_px, pose[1] + down * step_px,
                        pose[2] + turn * step_rad, ends,
                    ) - doubt * (right * right + down * down + turn * turn)  # fmt: skip
                    if value > best:
                        best, best_x, best_y, best_turn = value, right, down, turn
    found[0], found[1] = pose[0] + best_x * step_px, pose[1] + best_y * step_px
    found[2] = pose[2] + best_turn * step_rad
    return best + doubt * (best_x * best_x + best_y * best_y + best_turn * best_turn)
