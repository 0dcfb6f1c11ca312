"""Cells behind gaps, through windows, against a look all round from everywhere."""

from __future__ import annotations

import os

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import free_mask
from houseexpo.pseudoslam.kernels.sensing.sector import box_scan
from houseexpo.pseudoslam.kernels.sensing.visibility import NOWHERE, mark_visible_cells
from houseexpo.pseudoslam.worlds.world import find_observable_cells, new_scan_buffers, traversable_cells
from tests.builders.scans import slow_visible
from tests.builders.tries import tries

UNCOMPILED = "NUMBA_DISABLE_JIT" in os.environ  # a look from everywhere takes its time then
ROWS, COLS = 30, 44


def rooms_behind_gaps(rng: np.random.Generator) -> np.ndarray:
    """A room, and others behind walls at any angle with gaps that a robot passes or does not, some of no width."""
    space = shapely.box(1, 1, COLS - 1, ROWS - 1)
    for _ in range(rng.integers(1, 4)):
        middle, angle = rng.uniform((8, 6), (COLS - 8, ROWS - 6)), rng.uniform(0, np.pi)
        along = np.array([np.cos(angle), np.sin(angle)])
        gap, half = rng.uniform(0.0, 5.0), rng.uniform(0.3, 2.0)
        for side in (-1, 1):
            wall = shapely.LineString([middle + side * gap / 2 * along, middle + side * 60 * along])
            space = space.difference(shapely.buffer(wall, half, cap_style="flat"))
    free, _ = free_mask(space, frame=GridFrame((0.0, 0.0), 1.0, (ROWS, COLS)))
    specks = rng.random(free.shape) < rng.choice([0.0, 0.01])
    return (~free | specks).view(np.uint8)


@tries(3 if UNCOMPILED else 60)
@given(st.integers(0, 10**9), st.floats(1.2, 3.2), st.floats(2.0, 60.0))
def test_behind_gaps_it_is_what_a_look_from_everywhere_finds(seed: int, radius_px: float, range_px: float) -> None:
    occupied = rooms_behind_gaps(np.random.default_rng(seed))
    traversable = traversable_cells(occupied, radius_px)
    expected = slow_visible(occupied, traversable, range_px)
    np.testing.assert_array_equal(find_observable_cells(occupied, traversable, radius_px, range_px), expected)


def test_the_houses_of_these_tests_have_pockets() -> None:
    """Some cells behind gaps are seen, some are not: a search that finds all or none would fail."""
    shares = []
    for seed in range(3 if UNCOMPILED else 20):
        occupied = rooms_behind_gaps(np.random.default_rng(seed))
        traversable = traversable_cells(occupied, 2.5)
        seen = slow_visible(occupied, traversable, 40.0)
        beyond = find_observable_cells(occupied, traversable, 2.5, 3.0)  # what needs no window
        shares.append((int((seen > beyond).sum()), int(((occupied == 0) & (seen == 0)).sum())))
    assert all(np.median(shares, axis=0) > 20)


@pytest.mark.parametrize("sure_px", [0.5, 3.0, 9.0])
def test_how_far_a_standing_cell_is_taken_to_be_changes_nothing(sure_px: float) -> None:
    """Cells that are said to lie further off than they do only make pockets bigger."""
    rng = np.random.default_rng(3)
    for _ in range(1 if UNCOMPILED else 6):
        occupied = rooms_behind_gaps(rng)
        traversable = traversable_cells(occupied, 2.0)
        away = np.where(rng.random((occupied.size, 1)) < 0.5, NOWHERE, nearest(traversable)).astype(np.int16)
        far = np.hypot(*away.T.astype(float)).reshape(occupied.shape) > sure_px
        visible, asked = np.zeros_like(occupied), np.flatnonzero((occupied == 0) & far).astype(np.int32)
        mark_visible_cells(
            occupied, traversable, asked, len(asked), away, sure_px, 25.0, visible, *new_scan_buffers(25.0)
        )
        expected = slow_visible(occupied, traversable, 25.0)
        np.testing.assert_array_equal(visible.ravel()[asked], expected.ravel()[asked])


def nearest(traversable: np.ndarray) -> np.ndarray:
    """(cells, 2) rows down and columns to the right to the nearest standing cell."""
    at, cells = np.argwhere(traversable), np.argwhere(traversable >= 0)
    if not len(at):
        return np.full((len(cells), 2), NOWHERE)
    return at[((cells[:, None] - at) ** 2).sum(axis=2).argmin(axis=1)] - cells


def test_only_what_is_asked_is_looked_for() -> None:
    occupied = rooms_behind_gaps(np.random.default_rng(1))
    traversable, visible = traversable_cells(occupied, 2.0), np.zeros_like(occupied)
    asked, away = np.zeros(1, np.int32), np.full((occupied.size, 2), NOWHERE, np.int16)
    mark_visible_cells(occupied, traversable, asked, 0, away, 2.5, 15.0, visible, *new_scan_buffers(15.0))
    assert not visible.any()


def test_through_a_box_is_seen_what_is_seen_all_round_on_lines_through_it() -> None:
    rng = np.random.default_rng(0)
    tried = 0
    for _ in range(8 if UNCOMPILED else 12):
        occupied = rooms_behind_gaps(rng)
        cell = int(rng.choice(np.flatnonzero(occupied == 0)))
        top, left = rng.integers((1, 1), (ROWS - 4, COLS - 4)).tolist()
        box = np.array([top, top + rng.integers(3), left, left + rng.integers(3)], np.int32)
        range_px = float(rng.uniform(3.0, 50.0))
        runs, hit, slopes = new_scan_buffers(range_px)
        n_runs = box_scan(occupied, cell, box, range_px, runs, hit, slopes)
        found = {one for first, last in runs[:n_runs].tolist() for one in range(first, last + 1)}
        alone = np.zeros_like(occupied)
        alone.flat[cell] = 1
        everything = set(np.flatnonzero(slow_visible(occupied, alone, range_px)).tolist())
        on_lines = {other for other in everything if meets(cell, other, box)}
        assert on_lines <= found <= everything
        tried += len(on_lines) > 1 and len(found) < len(everything)
    assert tried > 0


def meets(cell: int, other: int, box: np.ndarray) -> bool:
    """Whether the line from one cell's middle to another's meets a box."""
    (y1, x1), (y2, x2) = divmod(cell, COLS), divmod(other, COLS)
    line = shapely.LineString([(x1 + 0.5, y1 + 0.5), (x2 + 0.5, y2 + 0.5)])
    top, bottom, left, right = box.tolist()
    return bool(line.intersects(shapely.box(left, top, right + 1, bottom + 1)))


def test_a_gap_of_one_cell_shows_a_beam() -> None:
    """A room of 9 x 9 cells, a wall with one hole, and another room; the robot stays in the left one."""
    occupied = np.ones((11, 21), np.uint8)
    occupied[1:10, 1:10] = occupied[1:10, 11:20] = 0
    occupied[5, 10] = 0
    traversable = np.zeros_like(occupied)
    traversable[5, 5] = 1
    seen = find_observable_cells(occupied, traversable, 2.0, 30.0)
    assert np.flatnonzero(seen[:, 12:20].any(axis=1)).tolist() == [4, 5, 6]
    assert seen[5, 11:20].all()
    traversable[:] = 0
    traversable[2, 2] = 1
    assert not find_observable_cells(occupied, traversable, 1.0, 8.0)[:, 11:].any()
