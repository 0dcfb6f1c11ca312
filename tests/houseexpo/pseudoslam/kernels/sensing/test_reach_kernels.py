"""What can be seen from where the robot can stand, against a look from everywhere."""

from __future__ import annotations

import os

import numpy as np
import pytest

from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.kernels.sensing.visibility import NOWHERE, find_nearest_standing_cells, mark_seen_from_nearest
from houseexpo.pseudoslam.worlds.world import find_observable_cells, make_world_from_raster, traversable_cells
from tests.builders.scans import slow_visible

UNCOMPILED = "NUMBA_DISABLE_JIT" in os.environ  # a look from everywhere takes its time then

UNKNOWN = np.empty((0, 2), np.int16)


def house(seed: int) -> np.ndarray:
    """Rooms of walls and clutter, 24 x 32 cells."""
    rng = np.random.default_rng(seed)
    occupied = (rng.random((24, 32)) < 0.03).astype(np.uint8)
    occupied[12, : rng.integers(8, 30)] = 1
    occupied[: rng.integers(8, 22), 18] = 1
    occupied[[0, -1]] = occupied[:, [0, -1]] = 1
    return occupied


@pytest.mark.parametrize(("radius_px", "range_px"), [(1.5, 6.0), (2.2, 40.0), (3.0, 2.0)])
def test_all_that_is_seen_from_somewhere_counts_and_nothing_else(radius_px: float, range_px: float) -> None:
    shares = []
    for seed in range(1 if UNCOMPILED else 4):
        occupied = house(seed)
        traversable = traversable_cells(occupied, radius_px)
        assert traversable.any()
        expected = slow_visible(occupied, traversable, range_px)
        assert np.array_equal(find_observable_cells(occupied, traversable, radius_px, range_px), expected)
        shares.append(expected.sum() / (occupied == 0).sum())
    assert 0.0 < min(shares) < 1.0


def test_no_sight_is_a_matter_of_rounding() -> None:
    """Lines from middle to middle graze corners; a cell that no scan sees would keep coverage below 1 for ever."""
    tried = 0
    for seed in range(2 if UNCOMPILED else 300):
        rng = np.random.default_rng(seed)
        occupied, radius_px, range_px = house(seed), rng.uniform(1.2, 3.2), rng.uniform(3.0, 40.0)
        traversable = traversable_cells(occupied, radius_px)
        tried += int(traversable.any())
        expected = slow_visible(occupied, traversable, range_px)
        assert np.array_equal(find_observable_cells(occupied, traversable, radius_px, range_px), expected), seed
    assert tried > 0


@pytest.mark.parametrize("radius_px", [1.3, 2.0, 2.9])
@pytest.mark.parametrize("range_px", [1.5, 15.0])
def test_of_what_was_seen_before_obstacles_came_the_rest_is_found(radius_px: float, range_px: float) -> None:
    shares = []
    for seed in range(1 if UNCOMPILED else 30):
        rng, walls = np.random.default_rng(1000 + seed), house(seed)
        if not traversable_cells(walls, radius_px).any():
            continue
        empty = make_world_from_raster(walls, GridFrame((0.0, 0.0), 1.0, walls.shape), radius_px, range_px, "house")
        occupied = walls | (rng.random(walls.shape) < 0.02).astype(np.uint8)
        traversable = (
            traversable_cells(occupied, radius_px) & empty.traversable
        )  # as after obstacles: what is lost stays lost
        expected = slow_visible(occupied, traversable, range_px)
        assert np.array_equal(
            find_observable_cells(occupied, traversable, radius_px, range_px, empty=empty), expected
        ), seed
        shares.append(expected.sum() / empty.observable.sum())
    assert min(shares) < 1.0
    assert max(shares) > 0.5


@pytest.mark.parametrize("walls", [False, True])
def test_where_it_stands_near_a_cell(walls: bool) -> None:
    """Between walls some standing cell or none, in an empty room the nearest."""
    occupied = house(0)
    if not walls:
        occupied[1:-1, 1:-1] = 0
    traversable, wanted = traversable_cells(occupied, 2.0), 1 - occupied
    asked, away, visible = (
        np.empty(occupied.size, np.int32),
        np.empty((occupied.size, 2), np.int16),
        np.zeros_like(occupied),
    )
    n_asked = find_nearest_standing_cells(traversable, wanted, UNKNOWN, 9.0, asked, away, visible)
    assert not visible.any()
    np.testing.assert_array_equal(asked[:n_asked], np.flatnonzero(wanted > traversable))
    at, cells = np.argwhere(traversable), np.argwhere(wanted)
    away = away.reshape(*occupied.shape, 2)
    found = away[tuple(cells.T)].astype(int)
    near = np.abs(found).max(axis=1) < NOWHERE // 2
    assert traversable[tuple((cells + found)[near].T)].all()
    assert near.mean() > 0.9
    if not walls:
        nearest = np.hypot(*(at[:, None] - cells).T).min(axis=1)
        np.testing.assert_array_equal(np.hypot(*found.T), nearest)
    assert (away[traversable != 0] == 0).all()
    assert (away[(wanted == 0) & (traversable == 0)] == NOWHERE).all()


def test_who_has_kept_a_standing_cell_close_by_is_not_asked_again() -> None:
    """Seven cells in a row between walls; the robot could stand in the last three, and now in the last one."""
    wanted = np.zeros((3, 9), np.uint8)
    wanted[1, 1:8] = 1
    traversable = np.zeros_like(wanted)
    traversable[1, 5:8] = 1
    asked, before, visible = np.empty(27, np.int32), np.empty((27, 2), np.int16), np.zeros_like(wanted)
    assert find_nearest_standing_cells(traversable, wanted, UNKNOWN, 9.0, asked, before, visible) == 4
    assert before[10:17].tolist() == [[0, 4], [0, 3], [0, 2], [0, 1], [0, 0], [0, 0], [0, 0]]
    traversable[1, 5] = 0
    before[13, 1] = 2  # as if another one had been found
    away = np.empty_like(before)
    n_asked = find_nearest_standing_cells(traversable, wanted, before, 2.0, asked, away, visible)
    assert np.flatnonzero(visible[1]).tolist() == [4]
    assert (asked[:n_asked] - 9).tolist() == [1, 2, 3, 5]
    assert away[10:17].tolist() == [[0, 5], [0, 4], [0, 3], [0, 2], [0, 1], [0, 0], [0, 0]]


def test_a_standing_cell_counts_where_nothing_lies_between() -> None:
    """Five cells in a row: a wall stands between the second and the standing one, but for a radius nobody looks."""
    occupied = np.ones((3, 9), np.uint8)
    occupied[1, 1:8] = 0
    occupied[1, 4] = 1
    cells, away = np.flatnonzero(occupied == 0).astype(np.int32), np.zeros((27, 2), np.int16)
    away[10:17, 1] = 7 - np.arange(1, 8)
    for sure_px, range_px, seen in ((1.0, 9.0, [5, 6, 7]), (1.0, 1.5, [6, 7]), (5.0, 9.0, [2, 3, 5, 6, 7])):
        visible, asked = np.zeros_like(occupied), cells.copy()
        n_left = mark_seen_from_nearest(occupied, asked, len(asked), away, sure_px, range_px, visible)
        assert np.flatnonzero(visible[1]).tolist() == seen
        assert sorted([*asked[:n_left] - 9, *seen]) == [1, 2, 3, 5, 6, 7]
