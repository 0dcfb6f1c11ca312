"""Ways to a goal, against what they are, and where they can be read."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.planning.fields import (
    FIELD_SIZES,
    GoalField,
    fast_march,
    find_open_blocks,
    goal_distance_at,
)


def marched(is_open: np.ndarray, row: int, col: int, side: int = 1) -> np.ndarray:
    distances = np.empty(is_open.shape, np.float32)
    fast_march(is_open, row, col, side, distances)
    return distances


def slow_march(is_open: np.ndarray, row: int, col: int, side: float) -> np.ndarray:
    """The same equation, cell by cell until nothing changes: |grad d| = 1 by the nearer neighbour of each axis."""
    found = np.full(np.array(is_open.shape) + 2, np.inf)
    found[row + 1, col + 1] = 0.0
    for _ in range(is_open.size):
        before = found.copy()
        for i, j in np.argwhere(is_open).tolist():
            a, b = sorted((min(found[i + 1, j], found[i + 1, j + 2]), min(found[i, j + 1], found[i + 2, j + 1])))
            if a < np.inf:
                best = a + side if b - a >= side else (a + b + math.sqrt(2 * side**2 - (a - b) ** 2)) / 2
                found[i + 1, j + 1] = min(found[i + 1, j + 1], best)
        if np.array_equal(before, found):
            break
    return found[1:-1, 1:-1]


def test_it_is_what_its_twin_says() -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        is_open = (rng.random((12, 15)) < 0.75).astype(np.uint8)
        row, col = rng.choice(np.argwhere(is_open)).tolist()
        assert np.allclose(marched(is_open, row, col, 3), slow_march(is_open, row, col, 3.0), rtol=1e-5, equal_nan=True)


def test_on_an_open_floor_it_is_the_straight_line() -> None:
    """Never shorter, longer by at most 1.3 blocks, and by 10% and 0.3 blocks; along rows and columns it is exact."""
    found = marched(np.ones((61, 81), np.uint8), 20, 30, 2)
    rows, cols = np.mgrid[:61, :81]
    straight = 2.0 * np.hypot(rows - 20, cols - 30)
    assert (found >= straight - 1e-3).all()
    assert (found - straight).max() <= 1.3 * 2
    assert (found <= 1.1 * straight + 2 * 0.3).all()
    assert np.array_equal(found[20], straight[20].astype(np.float32))
    assert np.array_equal(found[:, 30], straight[:, 30].astype(np.float32))


def test_round_a_corner_it_is_the_way_by_the_corner() -> None:
    """Straight in sight, else by the last open block before the corner; by at most 1.8 blocks or 8% too long."""
    is_open = np.ones((50, 60), np.uint8)
    is_open[:30, 20:] = 0  # an L: down the left, then right
    found = marched(is_open, 3, 5)
    rows, cols = np.mgrid[:50, :60]
    corner_row, corner_col = 30, 19
    by_corner = math.hypot(corner_row - 3, corner_col - 5) + np.hypot(rows - corner_row, cols - corner_col)
    straight = np.hypot(rows - 3, cols - 5)
    hidden = (cols > corner_col) & ((cols - 5) * (corner_row - 3) > (rows - 3) * (corner_col - 5))
    way = np.where(hidden, by_corner, straight)
    is_way = is_open != 0
    assert np.isinf(found[~is_way]).all()
    assert (found >= way - 0.5)[is_way].all()
    assert (found - way)[is_way].max() <= 1.8
    assert ((found - way)[is_way & (way > 10)] / way[is_way & (way > 10)]).max() <= 0.08


def test_behind_walls_there_is_no_way() -> None:
    is_open = np.ones((5, 9), np.uint8)
    is_open[:, 4] = 0
    found = marched(is_open, 2, 1)
    assert np.isinf(found[:, 4:]).all()
    assert np.isfinite(found[:, :4]).all()


def test_diagonal_neighbours_are_no_way() -> None:
    found = marched(np.eye(4, dtype=np.uint8), 0, 0)
    assert np.isfinite(found).sum() == 1


def test_a_block_is_open_where_the_robot_can_stand_in_some_cell() -> None:
    traversable = np.zeros((7, 8), np.uint8)
    traversable[2, 5] = traversable[6, 7] = traversable[0, 0] = 1
    is_open = np.zeros((3, 3), np.uint8)
    find_open_blocks(traversable, 3, is_open)
    assert is_open.tolist() == [[1, 1, 0], [0, 0, 0], [0, 0, 1]]


def field(distances: list[list[float]], side: int) -> GoalField:
    found = np.array(distances, np.float32)
    return GoalField(np.array([(*found.shape, side)], FIELD_SIZES), found.ravel())


def test_between_blocks_it_is_read_linearly() -> None:
    plane = field([[0.0, 4.0, 8.0], [2.0, 6.0, 10.0]], 4)
    for x, y in ((2.0, 2.0), (4.0, 2.0), (3.0, 5.0), (9.5, 3.25)):
        assert goal_distance_at(plane, x, y) == pytest.approx((x - 2.0) + (y - 2.0) / 2, abs=1e-6)


def test_beyond_the_outer_middles_it_is_the_outer_blocks() -> None:
    plane = field([[1.0, 5.0]], 4)
    assert goal_distance_at(plane, 0.0, 0.0) == pytest.approx(1.0)
    assert goal_distance_at(plane, 7.9, 3.0) == pytest.approx(5.0)


def test_blocks_without_a_way_have_no_say() -> None:
    some = field([[3.0, math.inf], [math.inf, math.inf]], 2)
    assert goal_distance_at(some, 2.4, 1.9) == pytest.approx(3.0)
    assert goal_distance_at(some, 2.9, 2.9) == pytest.approx(3.0)
    assert goal_distance_at(some, 3.0, 3.0) == math.inf
    assert goal_distance_at(field([[math.inf]], 2), 1.0, 1.0) == math.inf
