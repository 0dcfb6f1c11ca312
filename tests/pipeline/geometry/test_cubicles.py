"""Cubicles in a lavatory: partitions from 0.5 to 1.8 m, doors of 1.5 m in them."""

import pytest

from pipeline.geometry.known_doors import cubicle_leaves
from pipeline.geometry.meshes import Bodies
from tests.builders.houses import CEILING, Hole, Parts, kinds, plan_of, two_rooms
from tests.builders.meshes import box, joined

THIN = 0.025
FRONT = 1.6


def lavatory(leaf_top: float = 1.5, partition_top: float = 1.8) -> Parts:
    """Two rooms; in the left one a cubicle of 1.8 x 1.6 m, its front along y = 1.6 with a door of 0.9 m in it."""
    side = box((1.8, 0.0, 1.8 + THIN, FRONT), 0.5, partition_top)
    jambs = [box((x1, FRONT, x2, FRONT + THIN), 0.5, partition_top) for x1, x2 in ((0.0, 0.4), (1.3, 1.8 + THIN))]
    head = box((0.4, FRONT, 1.3, FRONT + THIN), leaf_top, partition_top)
    leaf = box((0.41, FRONT, 1.29, FRONT + THIN), 0.0, leaf_top)
    return [*two_rooms(Hole(1.0, 1.9)), side, *jambs, *([head] if leaf_top < partition_top else []), leaf]


def test_the_door_of_a_cubicle_is_a_door() -> None:
    plan = plan_of(lavatory())
    assert kinds(plan) == ["door", "door"]
    assert sorted(door.width for door in plan.doors) == pytest.approx([0.9, 0.9], abs=0.05)


def leaves(parts: Parts) -> int:
    return len(cubicle_leaves(Bodies.of(joined(parts)), CEILING))


def test_a_plate_must_be_held_by_higher_partitions_in_its_line() -> None:  # R2
    *partitions, leaf = lavatory()
    assert leaves([*partitions, leaf]) == 1
    assert leaves([*partitions, leaf.copy().apply_translation((0.0, 0.3, 0.0))]) == 0
    assert leaves([*two_rooms(), leaf]) == 0
    assert leaves(lavatory(partition_top=CEILING)) == 0
    assert leaves(lavatory(partition_top=1.5)) == 0


@pytest.mark.parametrize("top", [0.9, 1.1])
def test_a_panel_is_no_leaf(top: float) -> None:  # R1
    assert leaves(lavatory(leaf_top=top)) == 0
