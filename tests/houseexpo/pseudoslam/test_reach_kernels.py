"""What can be seen from where the robot can stand, against a look from everywhere."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.reach import mark_visible
from houseexpo.pseudoslam.kernels.sector import sector_scan
from houseexpo.pseudoslam.world import scan_buffers, standing_cells, visible_cells

UNCOMPILED = "NUMBA_DISABLE_JIT" in os.environ  # a look from everywhere takes its time then


def slow_visible(solid: np.ndarray, stand: np.ndarray, range_px: float) -> np.ndarray:
    """A look all round from the middle of every standing cell."""
    seen = np.zeros(solid.size, np.uint8)
    runs, hit, slopes = scan_buffers(range_px)
    for row, col in np.argwhere(stand).tolist():
        n_runs, _ = sector_scan(solid, col + 0.5, row + 0.5, 0.0, math.pi, range_px, runs, hit, slopes)
        for first, last in runs[:n_runs].tolist():
            seen[first : last + 1] = 1
    return seen.reshape(solid.shape)


def house(seed: int) -> np.ndarray:
    """Rooms of walls and clutter, 24 x 32 cells."""
    rng = np.random.default_rng(seed)
    solid = (rng.random((24, 32)) < 0.03).astype(np.uint8)
    solid[12, : rng.integers(8, 30)] = 1
    solid[: rng.integers(8, 22), 18] = 1
    solid[[0, -1]] = solid[:, [0, -1]] = 1
    return solid


@pytest.mark.parametrize(("radius_px", "range_px"), [(1.5, 6.0), (2.2, 40.0), (3.0, 2.0)])
def test_all_that_is_seen_from_somewhere_counts_and_nothing_else(radius_px: float, range_px: float) -> None:
    shares = []
    for seed in range(1 if UNCOMPILED else 4):
        solid = house(seed)
        stand = standing_cells(solid, radius_px)
        assert stand.any()
        expected = slow_visible(solid, stand, range_px)
        assert np.array_equal(visible_cells(solid, stand, radius_px, range_px), expected)
        shares.append(expected.sum() / (solid == 0).sum())
    assert 0.0 < min(shares) < 1.0


@pytest.mark.parametrize("near_px", [0.5, 4.0, 50.0])
def test_how_far_it_looks_first_changes_nothing(near_px: float) -> None:
    solid = house(9)
    stand = standing_cells(solid, 2.0)
    visible = np.zeros_like(solid)
    mark_visible(solid, stand, 1 - solid, near_px, 15.0, visible, *scan_buffers(15.0))
    assert np.array_equal(visible, slow_visible(solid, stand, 15.0))


def test_only_what_is_wanted_is_looked_for() -> None:
    solid = house(1)
    stand, wanted = standing_cells(solid, 2.0), np.zeros_like(solid)
    visible = np.zeros_like(solid)
    mark_visible(solid, stand, wanted, 4.0, 15.0, visible, *scan_buffers(15.0))
    assert not visible.any()
