"""A door in a partition as thin as itself shows by its frame; a stretch of the partition has none."""

import pytest
import trimesh

from tests.builders.houses import Hole, Parts, gap, kinds, plan_of, two_rooms, wall
from tests.builders.meshes import box

THIN = 0.05
X1, X2 = 4.0, 4.0 + THIN


def partition() -> Parts:
    """Rooms with a thin partition between, an open gap of it at one end, a hole for a door at the other."""
    return [*two_rooms(gap(0.0, 1.0), Hole(1.8, 2.7), thickness=THIN)]


def frame(proud: float) -> trimesh.Trimesh:
    """Two jambs and a head as one body."""
    low, high = X1 - proud, X2 + proud
    jambs = [box((low, 1.8, high, 1.84), 0.0, 2.1), box((low, 2.66, high, 2.7), 0.0, 2.1)]
    return trimesh.boolean.union([*jambs, box((low, 1.8, high, 2.7), 2.06, 2.1)], engine="manifold")


@pytest.mark.parametrize("proud", [0.0, 0.005])
def test_a_leaf_in_its_frame_is_a_door_in_the_thinnest_wall(proud: float) -> None:
    leaf = box((X1 + 0.008, 1.845, X1 + 0.038, 2.655), 0.005, 2.055)
    assert kinds(plan_of([*partition(), frame(proud), leaf])) == ["door", "opening"]


def test_a_stretch_of_the_partition_without_a_frame_is_wall() -> None:
    stretch = wall((X1, 1.8, X2, 2.7), top=2.1)
    assert kinds(plan_of([*partition(), *stretch])) == ["opening"]
