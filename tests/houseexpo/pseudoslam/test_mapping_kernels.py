"""Merging, cutting out, and the noise of a scan."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN, crop, merge
from houseexpo.pseudoslam.kernels.noise import draw_noisy, merge_patch
from tests.builders.scans import slow_crop


def test_merging_counts_what_was_unknown() -> None:
    known, countable = np.zeros((3, 4), np.uint8), np.zeros((3, 4), np.uint8)
    countable[0] = 1
    assert merge(known, countable, np.array([0, 1, 1, 5, 9], np.int32), 4, FREE) == (3, 2)
    assert merge(known, countable, np.array([1, 2], np.int32), 2, OBSTACLE) == (1, 1)
    assert known.tolist() == [[FREE, OBSTACLE, OBSTACLE, 0], [0, FREE, 0, 0], [0, 0, 0, 0]]


def test_more_than_a_byte_can_count_counts() -> None:
    known, ones = np.zeros((30, 30), np.uint8), np.ones((30, 30), np.uint8)
    assert merge(known, ones, np.arange(900, dtype=np.int32), 900, FREE) == (900, 900)
    known[:] = UNKNOWN
    assert merge_patch(known, ones, np.full((31, 31), FREE, np.uint8), 15.0, 15.0, 0.0, 0.0, 0.0) == (900, 900)


def test_the_crop_is_what_its_twin_says() -> None:
    rng = np.random.default_rng(0)
    known = rng.choice(np.array([UNKNOWN, FREE, OBSTACLE], np.uint8), (23, 31))
    for side in (1, 8, 25, 64):
        for heading in (0.0, math.pi / 2, math.pi, 0.3, -2.2, 1e-17):
            x, y = rng.uniform((-5, -5), (36, 28))
            out = np.full((side, side), 9, np.uint8)
            crop(known, x, y, heading, out)
            assert np.array_equal(out, slow_crop(known, x, y, heading, side))


def test_heading_is_up_in_the_crop() -> None:
    known = np.zeros((9, 9), np.uint8)
    known[4, 6], known[2, 4] = FREE, OBSTACLE  # right of the middle, above it
    out = np.empty((5, 5), np.uint8)
    crop(known, 4.5, 4.5, 0.0, out)
    assert np.argwhere(out == FREE).tolist() == [[0, 2]]
    assert np.argwhere(out == OBSTACLE).tolist() == [[2, 0]]
    crop(known, 4.5, 4.5, math.pi / 2, out)
    assert np.array_equal(out, known[2:7, 2:7])


def noisy(hit: tuple[int, int], x: float, y: float, shift: float, free: list[tuple[int, int]] | None = None) -> set:
    """The cells of the patch, in the grid's rows and columns, that one moved obstacle leaves."""
    patch = np.zeros((43, 43), np.uint8)
    cells = np.array([row * 50 + col for row, col in free or []], np.int32)
    flat = np.array([hit[0] * 50 + hit[1]], np.int32)
    shifts = np.full(180, shift)
    draw_noisy(patch, 50, x, y, 0.0, math.pi, cells, len(cells), flat, 1, shifts)
    top, left = int(y) - 21, int(x) - 21
    return {(row + top, col + left, int(patch[row, col])) for row, col in np.argwhere(patch).tolist()}


def test_an_obstacle_moves_along_its_ray_and_not_across() -> None:
    """The published noise shifts a whole ray down and right, by whole pixels."""
    assert noisy((20, 30), 20.5, 20.5, 0.0) == {(20, 30, OBSTACLE)}
    farther = noisy((20, 30), 20.5, 20.5, 3.0)
    assert farther == {(20, 30, FREE), (20, 31, FREE), (20, 32, FREE), (20, 33, OBSTACLE)}
    diagonal = noisy((10, 30), 20.5, 20.5, 2 * math.sqrt(2))
    assert (8, 32, OBSTACLE) in diagonal
    assert all(row - 10 == 30 - col for row, col, _ in diagonal)


def test_behind_an_obstacle_that_came_nearer_nothing_was_seen() -> None:
    free = [(20, col) for col in range(20, 30)]
    found = noisy((20, 30), 20.5, 20.5, -3.0, free)
    assert found == {*((20, col, FREE) for col in range(20, 27)), (20, 27, OBSTACLE)}


def test_a_patch_is_turned_about_the_robot_then_shifted_and_empties() -> None:
    patch = np.zeros((21, 21), np.uint8)
    patch[10, 10:16] = FREE
    patch[10, 16] = OBSTACLE
    known, countable = np.zeros((40, 40), np.uint8), np.ones((40, 40), np.uint8)
    new, covered = merge_patch(known, countable, patch, 20.5, 20.5, 0.0, -2.0, math.pi / 2)
    assert (new, covered) == (7, 7)
    assert known[12, 20] == OBSTACLE  # six ahead, turned left to look up, shifted two up
    assert (known[13:19, 20] == FREE).all()
    assert not patch.any()


@pytest.mark.parametrize("turn", [0.02, -0.1])
def test_turning_leaves_no_holes(turn: float) -> None:
    patch = np.full((61, 61), FREE, np.uint8)
    known, countable = np.zeros((101, 101), np.uint8), np.zeros((101, 101), np.uint8)
    new, covered = merge_patch(known, countable, patch, 50.3, 50.6, 0.4, 0.2, turn)
    assert (known[26:76, 26:76] == FREE).all()
    assert new == pytest.approx(61 * 61, rel=0.01)
    assert covered == 0


def test_what_a_shift_takes_off_the_map_is_lost() -> None:
    """The published simulator fails where a cell leaves the map."""
    known, countable = np.zeros((30, 30), np.uint8), np.zeros((30, 30), np.uint8)
    new, _ = merge_patch(known, countable, np.full((21, 21), FREE, np.uint8), 5.5, 25.5, -3.0, 4.0, 0.0)
    assert new == int((known == FREE).sum()) == 13 * 11
