"""Merging into the map, cutting out, and drawing coarsely."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.mapping import (
    FREE,
    OBSTACLE,
    UNKNOWN,
    crop_view,
    draw_overview,
    merge_cells,
    merge_runs,
)
from tests.builders.scans import UNASKED, crop_ties, slow_crop

VALUES = np.array([UNKNOWN, FREE, OBSTACLE], np.uint8)
ALL = np.array([0, 1 << 40, 0, 1 << 40])


def test_merging_counts_what_was_unknown() -> None:
    known, observable = np.zeros((3, 4), np.uint8), np.zeros((3, 4), np.uint8)
    observable[0] = 1
    assert merge_cells(known, observable, np.array([0, 1, 1, 5, 9], np.int32), 4, FREE, UNASKED) == (3, 2)
    assert merge_cells(known, observable, np.array([1, 2], np.int32), 2, OBSTACLE, UNASKED) == (1, 1)
    assert known.tolist() == [[FREE, OBSTACLE, OBSTACLE, 0], [0, FREE, 0, 0], [0, 0, 0, 0]]


def test_more_than_a_byte_can_count_counts() -> None:
    ones = np.ones((30, 30), np.uint8)
    cells, runs = np.arange(900, dtype=np.int32), np.array([[0, 899]], np.int32)
    assert merge_cells(np.zeros((30, 30), np.uint8), ones, cells, 900, FREE, UNASKED) == (900, 900)
    assert merge_runs(np.zeros((30, 30), np.uint8), ones, runs, 1, FREE, UNASKED) == (900, 900)


def test_runs_are_cells_side_by_side() -> None:
    rng = np.random.default_rng(0)
    for value in (FREE, OBSTACLE):
        known, observable = rng.choice(VALUES, (9, 17)), rng.integers(0, 2, (9, 17)).astype(np.uint8)
        starts = rng.integers(0, 150, 40)
        runs = np.stack([starts, np.minimum(starts + rng.integers(0, 9, 40), 152)], axis=1).astype(np.int32)
        cells = np.concatenate([np.arange(first, last + 1) for first, last in runs[:30]]).astype(np.int32)
        expected = known.copy()
        counted = merge_cells(expected, observable, cells, len(cells), value, UNASKED)
        assert merge_runs(known, observable, runs, 30, value, UNASKED) == counted
        assert np.array_equal(known, expected)


def test_the_crop_is_what_its_twin_says_but_for_ties() -> None:
    rng = np.random.default_rng(0)
    known = rng.choice(VALUES, (23, 31))
    for side in (1, 2, 8, 25, 64):
        for heading in (0.0, math.pi / 2, math.pi, 0.3, -2.2, 1e-17, 0.785):
            x, y = rng.uniform((-9, -9), (40, 32))
            out = np.full((side, side), 9, np.uint8)
            crop_view(known, x, y, heading, out)
            differ = out != slow_crop(known, x, y, heading, side)
            assert not (differ & ~crop_ties(x, y, heading, side)).any()
            assert crop_ties(x, y, heading, side).mean() < 0.5


def test_a_wide_crop_of_a_wide_map_is_exact_too() -> None:
    """Its places are counted in whole numbers of 32 bits."""
    side, known = 200, np.random.default_rng(1).choice(VALUES, (1500, 1500))
    for x, y, heading in ((1234.567, 89.01, 1.0), (3.2, 1499.9, -3.0), (750.5, 750.5, math.pi / 2)):
        out = np.empty((side, side), np.uint8)
        crop_view(known, x, y, heading, out)
        assert not ((out != slow_crop(known, x, y, heading, side)) & ~crop_ties(x, y, heading, side)).any()


def test_heading_is_up_in_the_crop() -> None:
    known = np.zeros((9, 9), np.uint8)
    known[4, 6], known[2, 4] = FREE, OBSTACLE  # right of the middle, above it
    out = np.empty((5, 5), np.uint8)
    crop_view(known, 4.5, 4.5, 0.0, out)
    assert np.argwhere(out == FREE).tolist() == [[0, 2]]
    assert np.argwhere(out == OBSTACLE).tolist() == [[2, 0]]
    crop_view(known, 4.5, 4.5, math.pi / 2, out)
    assert np.array_equal(out, known[2:7, 2:7])


def slow_shrink(known: np.ndarray, middle_x: float, middle_y: float, side_px: float, cells: int) -> np.ndarray:
    """Each cell is the most of the cells that begin in it, whose corner at the top left lies there."""
    out = np.zeros((cells, cells), np.uint8)
    for row, col in np.argwhere(known != UNKNOWN).tolist():
        left, top = middle_x - cells / 2 * side_px, middle_y - cells / 2 * side_px
        for i in range(cells):
            for j in range(cells):
                in_rows = math.floor(top + i * side_px) <= row < math.floor(top + (i + 1) * side_px)
                if in_rows and math.floor(left + j * side_px) <= col < math.floor(left + (j + 1) * side_px):
                    out[i, j] = max(out[i, j], known[row, col])
    return out


@pytest.mark.parametrize("side_px", [1.0, 2.5, 6.25])
def test_the_overview_is_what_its_twin_says(side_px: float) -> None:
    rng = np.random.default_rng(2)
    known = rng.choice(VALUES, (14, 11), p=(0.8, 0.15, 0.05))
    for x, y in ((5.3, 7.7), (0.0, 0.0), (11.0, 20.0)):
        out = np.zeros((6, 6), np.uint8)  # outside the map nothing changes
        draw_overview(known, x, y, side_px, ALL, out)
        assert np.array_equal(out, slow_shrink(known, x, y, side_px, 6))


@pytest.mark.parametrize("side_px", [1.3, 2.5, 4.0])
def test_of_the_overview_only_what_has_changed_is_drawn_anew(side_px: float) -> None:
    rng, cells = np.random.default_rng(4), math.ceil(44 / side_px)
    known, out = np.zeros((40, 40), np.uint8), np.zeros((cells, cells), np.uint8)
    for _ in range(30):
        (top, end), (left, right) = np.sort(rng.integers(0, 41, (2, 2)), axis=1)
        known[top:end, left:right] = rng.choice(VALUES, (end - top, right - left), p=(0.8, 0.15, 0.05))
        draw_overview(known, 20.3, 19.6, side_px, np.array([top, end, left, right]), out)
        assert np.array_equal(out, slow_shrink(known, 20.3, 19.6, side_px, cells))
    before = out.copy()
    draw_overview(np.full((40, 40), FREE, np.uint8), 20.3, 19.6, side_px, np.array([1 << 40, 0, 1 << 40, 0]), out)
    assert np.array_equal(out, before)  # nothing has changed


def test_an_overview_finer_than_the_map_has_no_gaps() -> None:
    known, out = np.full((4, 4), FREE, np.uint8), np.zeros((10, 10), np.uint8)
    draw_overview(known, 2.0, 2.0, 0.5, ALL, out)
    assert (out[1:9, 1:9] == FREE).all()
    assert out[0].max() == UNKNOWN  # off the map
