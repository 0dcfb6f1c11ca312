"""Made floors of offices: thin and thick walls, corridors, rooms with doors, the same for the same seed."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from houseexpo.pseudoslam.predictor.office_floors import make_office_floor

SEEDS = range(12)


def test_a_seed_gives_the_same_floor_and_another_seed_another_one() -> None:
    (one, corridor), (same, other) = (make_office_floor(np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one, same)
    np.testing.assert_array_equal(corridor, other)
    assert not np.array_equal(one, make_office_floor(np.random.default_rng(4))[0])


@pytest.mark.parametrize("seed", SEEDS)
def test_walls_are_not_too_thick_and_corridors_are_free(seed: int) -> None:
    walls, corridor = make_office_floor(np.random.default_rng(seed))
    assert walls.dtype == corridor.dtype == np.bool_
    assert walls.shape == corridor.shape
    assert not (walls & corridor).any()
    assert 0.01 < walls.mean() < 0.4
    solid = cv2.erode(walls.astype(np.uint8), np.ones((15, 15), np.uint8))
    assert solid.sum() < 0.02 * walls.sum()  # outer walls have at most 0.8 m; a few shafts are filled
    assert not walls[[0, -1]].any() and not walls[:, [0, -1]].any()  # noqa: PT018  # outside is free


def test_a_robot_gets_from_corridors_into_most_rooms() -> None:
    shares = []
    for seed in SEEDS:
        walls, corridor = make_office_floor(np.random.default_rng(seed))
        free = (~walls).astype(np.uint8)
        outside = free.copy()
        cv2.floodFill(outside, None, (0, 0), 2, flags=4)
        inside = (free != 0) & (outside != 2)
        wide = cv2.erode(inside.astype(np.uint8), np.ones((3, 3), np.uint8))  # a robot of 0.1 m radius
        _, labels = cv2.connectedComponents(wide, connectivity=4)
        reached = np.isin(labels, np.unique(labels[corridor & (wide != 0)]))
        shares.append(reached[wide != 0].mean() if inside.any() else 0.0)
    assert np.median(shares) > 0.95
    assert np.mean(np.array(shares) > 0.8) >= 0.75
