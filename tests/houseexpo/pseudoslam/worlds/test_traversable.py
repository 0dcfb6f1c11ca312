"""Where the robot can stand, against every cell's disc looked at by itself, and pieces against a plain flood."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.worlds.world import free_pieces_with_standing_cells, traversable_cells


def walls(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    occupied = (rng.random((26, 34)) < 0.02).astype(np.uint8)
    occupied[[0, -1]] = occupied[:, [0, -1]] = 1
    occupied[rng.integers(6, 20)] = 1
    occupied[:, rng.integers(6, 28)] = 1
    return occupied


def pieces(cells: np.ndarray) -> list[set[tuple[int, int]]]:
    """4-connected pieces, by their first cells."""
    left, found = set(map(tuple, np.argwhere(cells).tolist())), []
    while left:
        piece, waiting = set(), [min(left)]
        while waiting:
            row, col = waiting.pop()
            if (row, col) in left:
                left.remove((row, col))
                piece.add((row, col))
                waiting += [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
        found.append(piece)
    return found


def slow_traversable(occupied: np.ndarray, radius_px: float) -> set[tuple[int, int]]:
    """The biggest piece of cells whose disc touches no cell that is occupied, nor one beyond the grid."""
    reach = math.ceil(radius_px)
    padded = np.pad(occupied, reach, constant_values=1)
    near = np.maximum(np.abs(np.arange(-reach, reach + 1)) - 0.5, 0.0)
    disc = np.hypot(near[:, None], near) < radius_px - 1e-9
    free = np.zeros(occupied.shape, bool)
    for row, col in np.ndindex(*occupied.shape):
        free[row, col] = not (padded[row : row + 2 * reach + 1, col : col + 2 * reach + 1] * disc).any()
    return max(pieces(free), key=len, default=set())


@pytest.mark.parametrize("radius_px", [0.4, 1.0, 1.5, 2.2, 3.0, 4.7])
def test_it_is_the_biggest_piece_of_where_the_disc_is_free(radius_px: float) -> None:
    sizes = []
    for seed in range(6):
        occupied = walls(seed)
        expected = slow_traversable(occupied, radius_px)
        found = traversable_cells(occupied, radius_px)
        assert set(map(tuple, np.argwhere(found).tolist())) == expected
        assert found.dtype == np.uint8
        sizes.append(len(expected))
    assert max(sizes) > 0


def test_of_two_pieces_of_one_size_the_first_counts() -> None:
    occupied = np.ones((5, 9), np.uint8)
    occupied[1:4, 1:4] = occupied[1:4, 5:8] = 0
    assert np.argwhere(traversable_cells(occupied, 0.5)).max(axis=0).tolist() == [3, 3]


def test_free_pieces_count_where_the_robot_stands_in_them() -> None:
    for seed in range(6):
        occupied, rng = walls(seed), np.random.default_rng(seed)
        standing = ((rng.random(occupied.shape) < 0.003) & (occupied == 0)).astype(np.uint8)
        here = set(map(tuple, np.argwhere(standing).tolist()))
        expected = set().union(*(piece for piece in pieces(occupied == 0) if piece & here))
        assert set(map(tuple, np.argwhere(free_pieces_with_standing_cells(standing, occupied)).tolist())) == expected
