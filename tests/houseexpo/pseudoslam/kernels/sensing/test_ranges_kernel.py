"""Distances along beams against their slow twin: every solid square is asked where the line enters it."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams

UNCOMPILED = "NUMBA_DISABLE_JIT" in os.environ
FAN = np.arange(-math.pi, math.pi, math.radians(3.0))


def ranges(
    occupied: np.ndarray, x: float, y: float, heading: float, range_px: float, fan: np.ndarray = FAN
) -> np.ndarray:
    out = np.full(len(fan), np.nan)
    cast_beams(occupied, x, y, heading, np.cos(fan), np.sin(fan), range_px, out)
    return out


def slow_range(occupied: np.ndarray, x: float, y: float, angle: float, range_px: float) -> float:
    right, down = math.cos(angle), -math.sin(angle)
    nearest = range_px
    for row, col in np.argwhere(occupied).tolist():
        across = sorted([(col - x) / right, (col + 1 - x) / right])
        along = sorted([(row - y) / down, (row + 1 - y) / down])
        enters, flatten = max(across[0], along[0], 0.0), min(across[1], along[1])
        if enters < flatten:
            nearest = min(nearest, enters)
    return nearest


def grid(*lines: str) -> np.ndarray:
    return np.array([[cell == "#" for cell in line] for line in lines]).astype(np.uint8)


@pytest.mark.parametrize("share", [0.0, 0.03, 0.2])
def test_ranges_are_what_their_twin_says(share: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(4 if UNCOMPILED else 12):
        occupied = (rng.random((17, 23)) < share).astype(np.uint8)
        occupied[[0, -1]] = occupied[:, [0, -1]] = 1
        x, y, heading, range_px = rng.uniform((1, 1, -4, 2), (22, 16, 4, 25))
        wanted = [slow_range(occupied, x, y, heading + angle, range_px) for angle in FAN]
        np.testing.assert_allclose(ranges(occupied, x, y, heading, range_px), wanted, atol=1e-9)


def test_a_beam_that_leaves_the_grid_meets_nothing() -> None:
    assert (ranges(np.zeros((5, 7), np.uint8), 3.3, 2.1, 0.1, 50.0) == 50.0).all()
    assert (ranges(np.ones((5, 7), np.uint8), -1.5, 2.1, 0.1, 50.0) == 50.0).all()


def test_a_beam_is_stopped_between_corners_that_touch_and_passes_one_alone() -> None:
    up_right = np.array([math.pi / 4])
    between = grid("....", "....", "#...", ".#..")
    assert ranges(between, 0.5, 3.5, 0.0, 9.0, up_right)[0] == pytest.approx(0.5 * math.sqrt(2))
    beside = grid("....", "....", "....", ".#..")
    assert ranges(beside, 0.5, 3.5, 0.0, 9.0, up_right)[0] == 9.0
    ahead = grid("....", "....", ".#..", "....")
    assert ranges(ahead, 0.5, 3.5, 0.0, 9.0, up_right)[0] == pytest.approx(0.5 * math.sqrt(2))


def test_a_wall_of_corners_lets_nothing_through() -> None:
    occupied = np.eye(21, dtype=np.uint8)
    on_it = np.linspace(0.25, 20.75, 83)  # each fourth of them is a corner
    for x, y in ((12.5, 3.25), (15.0, 9.0), (11.7, 10.1)):
        found = ranges(occupied, x, y, 0.0, 99.0, np.arctan2(y - on_it, on_it - x))
        assert (found <= np.hypot(on_it - x, on_it - y) + 1e-9).all()


@pytest.mark.slow
@pytest.mark.skipif(UNCOMPILED, reason="this is the run without the compiler")
def test_the_kernel_is_the_same_uncompiled() -> None:
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__],
        check=True,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=Path(__file__).parents[5],
        capture_output=True,
    )
