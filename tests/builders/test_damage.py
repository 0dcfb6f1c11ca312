"""Damaged levels: each is another level than before, the same for the same seed, and stands where it stood."""

from __future__ import annotations

import numpy as np
import pytest

from tests.builders.damage import damaged
from tests.builders.houses import level, three_rooms
from tests.builders.meshes import one_level, write
from tests.builders.variations import VariedHouse, house_of


@pytest.mark.parametrize("seed", range(12))
def test_damage_is_drawn_from_its_seed_and_moves_nothing(seed: int) -> None:
    sound = level(three_rooms())
    one, other = (damaged(sound, np.random.default_rng(seed)) for _ in range(2))
    np.testing.assert_array_equal(one.walls.vertices, other.walls.vertices)
    np.testing.assert_array_equal(one.walls.faces, other.walls.faces)
    assert one.frame == sound.frame
    low, high = one.walls.vertices[one.walls.faces].reshape(-1, 3)[:, :2].min(0), sound.walls.vertices[:, :2].min(0)
    assert (low > high - 0.2).all()


# The variations of a house change what they say, and no more.


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> VariedHouse:
    return house_of(write(one_level(), tmp_path_factory.mktemp("varied") / "house.obj"))
