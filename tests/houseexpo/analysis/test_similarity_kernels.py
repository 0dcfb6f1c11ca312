"""The kernels against their twins, which are NumPy and obvious."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon

from houseexpo.analysis.kernels import masks
from houseexpo.analysis.similarity import SYMMETRIES, comparison_frame, crop_mask, difference_lower_bound
from houseexpo.grids.raster import all_rings, edges_in_pixels
from tests.builders.mask_twins import apply_symmetry, blob, compare_masks, comparison_mask, mask_fingerprint


def near(mask: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same with a few cells changed, turned and mirrored by chance."""
    other = mask.copy()
    for _ in range(int(rng.integers(0, 8))):
        other[rng.integers(0, len(mask)), rng.integers(0, mask.shape[1])] ^= True
    return crop_mask(apply_symmetry(other, list(SYMMETRIES)[rng.integers(0, 8)]))


def as_cells(mask: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(mask).view(np.uint8)


def as_shape(mask: np.ndarray) -> masks.PackedMask:
    return masks.pack_mask(as_cells(mask))


def test_a_house_is_filled_as_its_twin_fills_it() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        angles = np.sort(rng.uniform(0, 2 * np.pi, 9))
        ring = np.round(np.column_stack([np.cos(angles), np.sin(angles)]) * rng.uniform(2, 5, (9, 1)), 2)
        hole = Polygon([(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.35)])
        house = Polygon(ring, [hole.exterior.coords])
        frame = comparison_frame(house)
        filled = masks.fill_rings(*edges_in_pixels(all_rings(house), frame), *frame.shape)
        np.testing.assert_array_equal(crop_mask(filled.astype(bool)), comparison_mask(house))


def test_offsets_lie_near_one_end_or_the_other_and_each_comes_once() -> None:
    for size, size_, shift in ((9, 9, 2), (9, 8, 2), (9, 4, 2), (4, 9, 2), (5, 6, 1), (20, 3, 0), (7, 7, 0)):
        expected = {end + by for end in (0, size - size_) for by in range(-shift, shift + 1)}
        found = masks.profile_offsets(size, size_, shift).tolist()
        assert sorted(found) == sorted(expected)


def test_a_row_of_words_holds_the_cells_wherever_it_is_laid() -> None:
    mask = blob(np.random.default_rng(4), 9, 150)
    for right, cols in (
        (0, 150),
        (3, 150),
        (-5, 150),
        (0, 63),
        (40, 64),
        (-149, 10),
        (-64, 130),
        (64, 300),
        (-200, 70),
    ):
        laid = np.zeros((9, cols), bool)
        left = max(right, 0)
        part = mask[:, max(-right, 0) :][:, : max(cols - left, 0)]
        laid[:, left : left + part.shape[1]] = part
        words = masks.shift_words(masks.pack_words(as_cells(mask)), right, cols)
        bits = np.unpackbits(words.view(np.uint8), axis=1, bitorder="little")[:, :cols]
        np.testing.assert_array_equal(bits, laid)
    np.testing.assert_array_equal(masks.unpack_words(as_shape(mask).words, mask.shape[1]), as_cells(mask))


@pytest.mark.parametrize("limit", [0.0, 0.02, 0.1, 1.9])
def test_the_least_difference_is_its_twins(limit: float) -> None:
    rng = np.random.default_rng(5)
    for _ in range(25):
        one = blob(rng, *rng.integers(15, 80, 2))
        other = near(one, rng) if rng.random() < 0.7 else blob(rng, *rng.integers(15, 80, 2))
        expected = compare_masks(one, other, limit)
        cells, symmetry = masks.least_difference(as_shape(one), as_shape(other), limit, 2, 8)
        found = None if symmetry < 0 else (cells / max(one.sum(), other.sum()), list(SYMMETRIES)[symmetry])
        assert found == expected


def fewest_apart(one: np.ndarray, other: np.ndarray, shift: int, symmetry: str) -> int:
    """The least that two masks differ by as their profiles say, wherever the second is laid."""
    turned = apply_symmetry(other, symmetry)
    least = 0
    for axis in (0, 1):
        here, there = one.sum(axis=1 - axis), turned.sum(axis=1 - axis)
        ends = {end + by for end in (0, len(here) - len(there)) for by in range(-shift, shift + 1)}
        least = max(least, min(apart_at(here, there, at) for at in ends))
    return least


def apart_at(here: np.ndarray, there: np.ndarray, at: int) -> int:
    """How far apart two profiles are, the second laid at ``at``, with room for both."""
    room = len(here) + len(there) + 10
    line, line_ = np.zeros(3 * room, int), np.zeros(3 * room, int)
    line[room : room + len(here)] = here
    line_[room + at : room + at + len(there)] = there
    return int(abs(line - line_).sum())


@pytest.mark.parametrize("symmetries", [1, 8])
@pytest.mark.parametrize("limit", [0.0, 0.05, 0.3])
def test_profiles_rule_out_what_their_twin_rules_out(limit: float, symmetries: int) -> None:
    rng = np.random.default_rng(7)
    told = []
    for _ in range(60):
        one = blob(rng, *rng.integers(15, 60, 2))
        others = (one, near(one, rng), blob(rng, *rng.integers(15, 60, 2)))
        other = others[int(rng.choice(3, p=(0.1, 0.6, 0.3)))]
        least = min(fewest_apart(one, other, 2, name) for name in list(SYMMETRIES)[:symmetries])
        profiles = masks.mask_profiles(as_cells(one)), masks.mask_profiles(as_cells(other))
        told.append(masks.profiles_may_match(*profiles, limit, 2, symmetries))
        assert told[-1] == (least <= limit * max(one.sum(), other.sum()))
    assert len(set(told)) == 2


def test_prints_rule_out_what_their_twin_rules_out() -> None:
    rng = np.random.default_rng(6)
    plans = [blob(rng, *rng.integers(20, 30, 2)) for _ in range(12)]
    plans += [near(mask, rng) for mask in plans]
    prints = np.array(sorted((mask_fingerprint(mask) for mask in plans), key=lambda row: row[0]), np.int32)
    fresh = np.arange(len(prints)) % 3 == 0
    expected = {
        (i, j)
        for i in range(len(prints))
        for j in range(i + 1, len(prints))
        if (fresh[i] or fresh[j]) and difference_lower_bound(prints[i], prints[j : j + 1])[0] <= 0.05 * prints[j, 0]
    }
    areas, groups = prints[:, 0].copy(), masks.pool_fingerprints(prints)
    parts = [
        masks.near_fingerprint_pairs(prints, areas, groups, fresh, 0.05, first, first + 8)
        for first in range(0, len(prints), 8)
    ]
    assert {tuple(pair) for part in parts for pair in part.tolist()} == expected
    assert expected
