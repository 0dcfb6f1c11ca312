"""Damaged levels: each is another level than before, the same for the same seed, and stands where it stood."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.builders.damage import damaged
from tests.builders.houses import level, three_rooms
from tests.builders.meshes import one_level, write
from tests.builders.variations import VARIATIONS, VariedHouse, house_of, levels_of


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


def volume(house: VariedHouse) -> float:
    a, b, c = house.corners.transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_walls_are_cut_and_keep_their_winding(house):
    block = trimesh.creation.box(bounds=[[0.0, 0.0, 0.0], [4.0, 3.0, 2.0]])
    owner = np.zeros(len(block.faces), np.int32)
    cut = VARIATIONS["walls cut at 1.2 m"](replace(house, corners=np.asarray(block.triangles), owner=owner))
    assert cut.high[:, 2].max() == pytest.approx(1.2)
    made = trimesh.Trimesh(cut.corners.reshape(-1, 3), np.arange(3 * len(cut.corners)).reshape(-1, 3), process=False)
    assert made.area == pytest.approx(4.0 * 3.0 + 2 * (4.0 + 3.0) * 1.2)
    outward = made.triangles_center - (2.0, 1.5, 0.6)
    assert (np.einsum("ij,ij->i", made.face_normals, outward) > 0).all()


def test_the_other_axis_and_the_winding_are_what_changes(house):
    assert volume(VARIATIONS["each face inside out"](house)) == pytest.approx(-volume(house))
    (level,) = levels_of(VARIATIONS["on the other axis"](house))
    assert level.guesses == ("up",)
