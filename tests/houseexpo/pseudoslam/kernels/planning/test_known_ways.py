"""Where a robot may stand by its map, and how far that is, against slow twins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.pseudoslam.kernels.planning.paths import find_distances, trace_path
from houseexpo.pseudoslam.kernels.types import NO_STAND, NO_WAY, PathScratch, new_path_scratch
from tests.builders.robot_maps import FREE, random_map, random_place, slow_standing, slow_ways
from tests.builders.tries import tries

SEEDS = st.integers(0, 10**6)


def ways_of(
    known: np.ndarray, x: float, y: float, radius: float, until: int = -1, memory: PathScratch | None = None
) -> np.ndarray:
    memory = memory or new_path_scratch(known.size)
    find_distances(known, x, y, radius, until, memory)
    ways = memory.ways[: known.size].reshape(known.shape).astype(float)
    return np.where(ways == NO_WAY, np.inf, ways)


@tries(60)
@given(SEEDS, st.sampled_from([0.3, 0.5, 1.0, 1.5, 2.2, 3.0, 5.0]))
def test_it_is_what_its_twins_say(seed: int, radius: float) -> None:
    known = random_map(seed)
    x, y = random_place(known, seed)
    standing = slow_standing(known, x, y, radius)
    found = ways_of(known, x, y, radius)
    assert np.array_equal(found >= 0, standing)
    assert np.array_equal(found, slow_ways(standing, x, y, radius))


def test_memory_serves_one_map_after_the_other() -> None:
    """Bigger and smaller ones, of other widths: nothing of one is left in the next."""
    memory = new_path_scratch(40 * 40)
    for seed in range(30):
        rng = np.random.default_rng(seed)
        known = random_map(seed, *rng.integers(12, 40, 2).tolist())
        x, y = random_place(known, seed)
        found = ways_of(known, x, y, 1.6, memory=memory)
        assert np.array_equal(found, ways_of(known, x, y, 1.6))
        beyond = memory.ways[known.size :]
        assert (beyond == NO_STAND).all()
        assert not memory.marks.any()


def test_beside_no_standing_cell_ways_begin_in_the_nearest() -> None:
    """In a corridor as wide as the robot, which fits between the cells' middles only."""
    known = np.full((15, 15), FREE, np.uint8)
    known[:7, :2] = known[:7, 6:] = 255
    found = ways_of(known, 4.0, 4.5, 2.0)
    assert (found[:8] < 0).all()
    assert found[8, 3:5].tolist() == [round(70 * np.hypot(0.5, 4.0)), round(70 * np.hypot(0.5, 4.0)) + 70]


def test_ways_up_to_a_cell_are_what_all_ways_are() -> None:
    for seed in range(20):
        known = random_map(seed)
        x, y = random_place(known, seed)
        whole = ways_of(known, x, y, 1.2)
        reached = np.argwhere((whole >= 0) & np.isfinite(whole))
        for row, col in reached[:: max(len(reached) // 5, 1)].tolist():
            some = ways_of(known, x, y, 1.2, row * known.shape[1] + col)
            near = (whole >= 0) & (whole <= whole[row, col])
            assert np.array_equal(some[near], whole[near])


@tries(40)
@given(SEEDS)
def test_a_path_is_as_long_as_its_way(seed: int) -> None:
    known = random_map(seed)
    x, y = random_place(known, seed)
    memory = new_path_scratch(known.size)
    ways = ways_of(known, x, y, 1.2, memory=memory)
    cols = known.shape[1]
    path = np.empty(known.size, np.int32)
    for row, col in np.argwhere(ways > -2)[::7].tolist():
        n = trace_path(memory, row * cols + col, path)
        assert (n > 0) == (0 <= ways[row, col] < np.inf)
        if n:
            cells = np.stack([path[:n] // cols, path[:n] % cols], axis=1)
            assert cells[-1].tolist() == [row, col]
            moves = np.abs(np.diff(cells, axis=0))
            assert (moves.max(axis=1, initial=0) == 1).all()
            length = ways[tuple(cells[0])] + np.where(moves.sum(axis=1) == 2, 99, 70).sum()
            assert length == ways[row, col]
            assert (ways[tuple(cells.T)] >= 0).all()
    assert trace_path(memory, -1, path) == 0
    assert trace_path(memory, int(np.nanargmax(np.where(np.isfinite(ways), ways, -1))), path[:0]) == 0


@pytest.mark.parametrize(("x", "y"), [(-50.0, 5.0), (5.0, -50.0), (500.0, 5.0), (5.0, 500.0), (-9.0, 900.0)])
def test_a_robot_that_believes_to_be_off_the_grid_has_no_way(x: float, y: float) -> None:
    for known in (random_map(1), np.zeros((9, 9), np.uint8)):
        found = ways_of(known, x, y, 1.5)
        assert not np.isfinite(found[found >= 0]).any()
