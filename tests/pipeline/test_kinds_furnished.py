"""Furnished houses that nobody named: leaves ajar in frames, curtains, lamps, wardrobes that stand askew."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import trimesh

from houseexpo.floorplan import FloorPlan
from pipeline.config import EvidenceConfig
from pipeline.geometry.known_doors import find_leaves
from pipeline.geometry.meshes import Bodies
from pipeline.stages.evidence import gather
from tests.builders.houses import CEILING, HEAD, Hole, Parts, gap, kinds, level, plan_of, two_rooms, window
from tests.builders.meshes import box, joined

DOOR = Hole(1.0, 1.9)


def leaf(hinge: tuple[float, float], degrees: float, width: float = 0.88, high: float = 2.0) -> trimesh.Trimesh:
    """A leaf 4 cm thick, hung at a point and swung from the x axis by so many degrees."""
    plate = box((0.0, -0.02, width, 0.02), 0.0, high)
    plate.apply_transform(trimesh.transformations.rotation_matrix(np.deg2rad(degrees), [0, 0, 1]))
    plate.apply_translation((*hinge, 0.0))
    return plate


def frame(x1: float, x2: float, y1: float, y2: float) -> Parts:
    """The two posts of a frame, 3 cm, at the jambs of a doorway that runs along y."""
    return [box((x1, y1, x2, y1 + 0.03), 0.0, 2.0), box((x1, y2 - 0.03, x2, y2), 0.0, 2.0)]


def areas(plan: FloorPlan) -> list[float]:
    return sorted(room.area for room in plan.rooms)


@pytest.mark.parametrize("degrees", [72.0, 65.0, 50.0])
def test_a_leaf_ajar_in_its_frame_is_no_wall(degrees: float) -> None:
    """A leaf hung at (4.05, 1.05) stands ajar by 18 to 40 degrees, and touches its frame only."""
    plan = plan_of([*two_rooms(DOOR), *frame(3.98, 4.22, 1.0, 1.9), leaf((3.96, 1.05), 180.0 - degrees)])
    assert kinds(plan) == ["door"]
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.15)


def test_leaves_that_touch_at_an_angle_are_leaves_of_their_own() -> None:
    crossing = [leaf((0.0, 0.0), 40.0), leaf((0.7, 0.0), 140.0)]
    assert len(find_leaves(Bodies.of(joined(crossing)))) == 2
    double = [leaf((0.0, 0.0), 0.0), leaf((0.9, 0.0), 0.0)]  # closed: one door
    assert len(find_leaves(Bodies.of(joined(double)))) == 1


def test_frames_of_two_doors_that_touch_in_a_corner_belong_to_a_door_each() -> None:
    """One door from x 0.02 to 0.92 in a wall along x, the other from y 0.02 to 0.92 in a wall along y."""
    one = [box((x, -0.04, x + 0.03, 0.05), 0.0, 2.03) for x in (0.02, 0.89)]
    other = [box((-0.04, y, 0.05, y + 0.03), 0.0, 2.03) for y in (0.06, 0.93)]
    closed = [leaf((0.05, 0.0), 0.0, 0.84), leaf((0.0, 0.09), 90.0, 0.84)]
    found = find_leaves(Bodies.of(joined([*one, *other, *closed])))
    assert [len(each.bodies) for each in found] == [3, 3]


@pytest.mark.parametrize(("high", "found"), [(2.0, 1), (CEILING, 0)])
def test_what_reaches_the_ceiling_is_no_leaf(high: float, found: int) -> None:
    plate = joined([leaf((0.0, 0.0), 0.0, high=high)])
    assert len(find_leaves(Bodies.of(plate), CEILING)) == found


def test_a_leaf_that_swings_against_a_cross_wall_stands_open() -> None:
    """The doorway lies in the corner; the leaf's end touches the outer wall, and its lintel hangs beside it."""
    plan = plan_of([*two_rooms(Hole(0.05, 0.85)), leaf((4.0, 0.84), 252.0, 0.88)])
    assert kinds(plan) == ["door"]
    assert plan.doors[0].width == pytest.approx(0.8, abs=0.06)


def lamp(x: float, y: float) -> trimesh.Trimesh:
    return box((x - 0.2, y - 0.2, x + 0.2, y + 0.2), HEAD - 0.15, HEAD + 0.1)


def test_a_lamp_over_a_table_is_no_window_and_a_window_is_wall() -> None:
    table = box((1.0, 1.0, 2.2, 2.0), 0.0, 0.75)
    walls = gather(level([*two_rooms(window(1.0, 2.0)), table, lamp(1.6, 1.5)]), EvidenceConfig()).walls
    assert not walls.intersects(shapely.box(1.0, 1.0, 2.2, 2.0))
    assert walls.contains(shapely.Point(4.1, 1.5))


@pytest.mark.parametrize("degrees", [0.0, 3.0, 7.0])
def test_a_wardrobe_leaves_no_crease_that_parts_the_floor(degrees: float) -> None:
    wardrobe = box((0.0, 0.0, 2.0, 0.6), 0.0, 1.9)
    wardrobe.apply_transform(trimesh.transformations.rotation_matrix(np.deg2rad(degrees), [0, 0, 1]))
    wardrobe.apply_translation((1.2, 0.1, 0.0))
    found = gather(level([*two_rooms(DOOR), wardrobe]), EvidenceConfig())
    assert not found.walls.intersects(shapely.box(0.01, 0.01, 3.99, 2.99))
    assert found.furniture.area == pytest.approx(1.2, abs=0.05)


def test_double_leaves_in_a_gap_of_full_height_are_a_door() -> None:
    """The wall ends 1.4 m before one that crosses: too far for a gap; it parts the rooms, and leaves hang there."""
    bare = two_rooms(gap(0.0, 1.4))
    open_leaves = [leaf((4.1, 1.38), 200.0, 0.68), leaf((4.1, 0.02), 160.0, 0.68)]
    assert kinds(plan_of(bare)) == ["opening"]
    plan = plan_of([*bare, *open_leaves])
    assert kinds(plan) == ["door"]
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.3)


def curtains(y: float, *spans: tuple[float, float]) -> Parts:
    return [box((a, y, b, y + 0.06), 0.03, 2.3) for a, b in spans]


def test_curtains_before_a_wall_or_a_door_part_nothing() -> None:
    """Between two curtains 6 cm before a wall lies no opening, and one beside a doorway does not close it again."""
    drawn = curtains(0.06, (0.1, 0.5), (1.4, 1.8), (2.7, 3.1))
    plan = plan_of([*two_rooms(DOOR), *drawn])
    assert kinds(plan) == ["door"]
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.15)
