from __future__ import annotations

import doctest
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from houseexpo import inference
from houseexpo.errors import PlanError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.inference import with_rooms
from houseexpo.inference.snapping import snap_polygon, snap_polygons, snap_ring
from tests.builders.batch import made_plans
from tests.builders.matching import bare, matches, total
from tests.builders.shared import CASES, DATA, NOT_YET, as_json, case, needs_shared, plan_nearest, scorer


def plan_of(*free, boxes=None) -> FloorPlan:
    """A plan whose free space is the union of some shapes, metres."""
    space = shapely.union_all(free, grid_size=0.01)
    assert isinstance(space, Polygon)
    rings = [np.round(shapely.get_coordinates(ring)[:-1], 2) for ring in (space.exterior, *space.interiors)]
    return FloorPlan("made", rings[0], 1, boxes or {}, holes=tuple(rings[1:]))


def areas(plan: FloorPlan) -> list[float]:
    return sorted(round(room.area, 1) for room in plan.rooms)


LEFT, RIGHT = box(0, 0, 4, 3), box(4.1, 0, 7, 3)


@pytest.mark.parametrize(
    "door",
    [
        box(4, 1, 4.1, 1.8),  # in the middle of a wall
        box(4, 0, 4.1, 0.8),  # along the wall of both rooms
        box(4, 0.02, 4.1, 0.8),
        box(4, 0.5, 4.1, 2.1),  # wide
    ],
)
def test_a_door_in_a_wall_parts_two_rooms(door):
    plan = with_rooms(plan_of(LEFT, RIGHT, door))
    assert areas(plan) == [8.7, 12.0]
    (found,) = plan.doors
    x1, y1, x2, y2 = door.bounds
    assert found.kind == "door"
    assert found.rooms == (0, 1)
    assert found.width == pytest.approx(y2 - y1, abs=0.03)
    assert np.mean(found.segment, axis=0) == pytest.approx(((x1 + x2) / 2, (y1 + y2) / 2), abs=0.03)
    assert found.polygon.equals(door)


def test_walls_of_a_pixel_contour_with_its_steps():
    steps = [(4, 0.9), (4.0, 0.91), (4.01, 0.92), (4.01, 0.98), (4.02, 0.99), (4.09, 0.99), (4.1, 0.98), (4.1, 0.9)]
    ring = [(0, 0), (0, 1.5), (0.01, 1.51), (0.01, 3), (4, 3), (4, 1.8), (4.1, 1.8), (4.1, 3), (7, 3), (7, 0), (4.1, 0)]
    plan = with_rooms(FloorPlan("steps", [*ring, *steps[::-1], (4, 0)], 2, {}))
    assert areas(plan) == [8.7, 12.0]
    assert plan.doors[0].width == pytest.approx(0.82, abs=0.03)


def test_doors_side_by_side_between_different_rooms():
    closets = box(4.1, 0, 6, 1.4), box(4.1, 1.5, 6, 3)
    doors = box(4, 0.55, 4.1, 1.38), box(4, 1.52, 4.1, 2.35)
    plan = with_rooms(plan_of(LEFT, *closets, *doors))
    assert areas(plan) == [2.7, 2.9, 12.0]
    assert len(plan.doors) == 2


def test_a_corridor_with_six_doors_stays_whole():
    corridor = box(0, 3.1, 9.2, 4.2)
    rooms = [box(3.1 * k, y, 3.1 * k + 3, y + 3) for k in range(3) for y in (0, 4.3)]
    doors = [box(3.1 * k + 1, y, 3.1 * k + 1.8, y + 0.1) for k in range(3) for y in (3, 4.2)]
    plan = with_rooms(plan_of(corridor, *rooms, *doors))
    assert areas(plan) == [9.0] * 6 + [10.1]
    assert len(plan.doors) == 6


@pytest.mark.parametrize(
    "free",
    [
        (box(0, 0, 4, 3), box(4.1, 0, 7, 3), box(4, 0.2, 4.1, 2.8)),  # a gap of 2.6 m
        (box(0, 0, 4, 1.1), box(4, -3, 8, 3)),  # the mouth of a corridor
        (box(0, 0, 1, 6), box(0, 5, 6, 6)),  # a corridor round a corner
        (box(0, 0, 5, 4), box(5, 1, 5.6, 2)),  # a niche
        (box(0, 0, 5, 4), box(5, 1, 5.1, 1.8), box(5.1, 0.9, 5.7, 1.9)),  # a niche behind an opening: 0.6 m2
        (box(0, 0, 8, 1.2) - box(4, 0, 4.3, 0.03) - box(4, 1.17, 4.3, 1.2),),  # pilasters in a corridor
        (box(0, 0, 6, 5) - box(2.9, 1.8, 3.0, 3.2),),  # a wall that stands free in a room
        (box(0, 0, 6, 5) - box(2.9, 2, 3.2, 2.3),),  # a pillar
    ],
)
def test_what_is_no_door(free):
    plan = with_rooms(plan_of(*free))
    assert plan.doors == ()
    assert len(plan.rooms) == 1
    assert plan.rooms[0].area == pytest.approx(plan.area, abs=1e-6)


def test_rooms_in_a_ring_about_a_core_that_stands_free():
    walls = [box(2, 2, 4, 4), box(0, 2.9, 2, 3), box(4, 2.9, 6, 3)]
    plan = with_rooms(plan_of(box(0, 0, 6, 6) - shapely.union_all(walls), box(0.5, 2.9, 1.3, 3), box(4.6, 2.9, 5.4, 3)))
    assert len(plan.rooms) == len(plan.doors) == 2
    assert {door.rooms for door in plan.doors} == {(0, 1)}


def test_pieces_that_only_touch_are_rooms_apart():
    ring = [(0, 0), (0, 2), (2, 2), (2, 4), (4, 4), (4, 2), (2, 2), (2, 0)]
    plan = with_rooms(FloorPlan("touch", ring, 1, {}))
    assert areas(plan) == [4.0, 4.0]
    with pytest.raises(PlanError, match="plan 'line': verts: expected a ring that encloses an area"):
        with_rooms(FloorPlan("line", [(0, 0), (1, 0), (3, 0)], 1, {}))


def test_boxes_give_the_labels():
    parts = LEFT, RIGHT, box(7.1, 0, 9, 1.5), box(4, 1, 4.1, 1.8), box(7, 0.4, 7.1, 1.2)
    boxes = {
        "Kitchen": ((-0.1, -0.1, 2.0, 3.1),),  # two rooms of the source form one here
        "Living_Room": ((-0.1, -0.1, 4.1, 3.1),),
        "Bathroom": ((7.0, -0.1, 12.0, 3.2),),  # objects make the box far too large
        "Toilet": ((7.0, -0.1, 12.0, 3.2),),  # one room under two labels
        "Garage": ((20.0, 20.0, 24.0, 24.0),),  # of no room of this plan
    }
    plan = with_rooms(plan_of(*parts, boxes=boxes))
    named = {int(room.area): (room.label, set(room.source_labels)) for room in plan.rooms}
    assert named[12] == ("Living_Room", {"Living_Room", "Kitchen"})
    assert named[8] == ("Unlabelled", set())
    assert named[2][0] in {"Bathroom", "Toilet"}
    assert named[2][1] == {"Bathroom", "Toilet"}


def assert_tiled(plan: FloorPlan) -> None:
    """Rings are valid, on the grid, without vertices in line; they tile the free space; doors touch their rooms."""
    rings = [ring for room in plan.rooms for ring in (room.ring, *room.holes)] + [door.ring for door in plan.doors]
    for ring in rings:
        cells = np.round(ring * 100)
        assert np.allclose(ring * 100, cells, atol=1e-6), plan.id
        before, after = cells - np.roll(cells, 1, axis=0), np.roll(cells, -1, axis=0) - cells
        assert (before[:, 0] * after[:, 1] != before[:, 1] * after[:, 0]).all(), plan.id
    shapes = [part.polygon for part in (*plan.rooms, *plan.doors)]
    assert all(shape.is_valid for shape in shapes), plan.id
    tiled = shapely.union_all(shapes)
    assert sum(shape.area for shape in shapes) == pytest.approx(tiled.area, abs=0.05)
    assert tiled.symmetric_difference(plan.free_space).area <= 0.05, plan.id
    shape_of = {room.id: room.polygon for room in plan.rooms}
    for door in plan.doors:
        assert all(shape_of[room].distance(door.polygon) < 0.005 for room in door.rooms if room is not None), plan.id


def test_published_plans_are_tiled_and_rooms_are_about_as_many_as_stated(published_lines):
    off = []
    for line in published_lines[:50]:
        plan = with_rooms(decode(line))
        assert_tiled(plan)
        off.append(abs(len(plan.rooms) - plan.room_num))
        doors = [door.polygon for door in plan.doors]
        assert not any(one.intersects(other) and one.intersection(other).area for one, other in combinations(doors, 2))
    assert np.median(off) <= 1


def test_a_plan_with_rooms_gets_them_back(two_rooms):
    counts = total([matches(two_rooms, with_rooms(bare(two_rooms)))])
    assert counts.rates() == (1.0, 1.0, 1.0, 1.0)


def test_examples():
    assert doctest.testmod(inference).failed == 0


# Rings on the grid of a plan.


ROOM = shapely.box(0.004, 0, 4, 3).union(shapely.box(4, 1, 4.002, 2))
"""A rectangle with a nib of 2 mm, which is none on the grid."""
COURT = shapely.box(0, 0, 9, 9).difference(shapely.box(4, 4, 5, 5)).difference(shapely.box(2, 2, 2.001, 3))
"""With a hole, and one that has no area on the grid."""


def test_rings_have_no_vertices_that_they_do_not_need() -> None:
    ring, holes = snap_polygon(ROOM)
    assert sorted(ring.tolist()) == [[0.0, 0.0], [0.0, 3.0], [4.0, 0.0], [4.0, 3.0]]
    assert holes == ()


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0), (0.9, 0), (0.9, 0.174), (0.734, 0.001), (0.001, 0.147)],  # a corner comes to lie on the first side
        [(0, 0), (0.9, 0), (0.9, 0.134), (0.895, 0.004), (0.044, 0.086)],  # two corners come together
    ],
)
def test_a_polygon_that_rounding_would_cross_is_its_largest_part(corners: list[tuple[float, float]]) -> None:
    shape = Polygon(corners)
    ring, _ = snap_polygon(shape)
    assert Polygon(ring).is_valid
    assert Polygon(ring).area > shape.area / 2


def test_several_polygons_are_snapped_as_each_by_itself() -> None:
    shift = np.array([0.1, -0.2])
    found = snap_polygons([COURT, ROOM], shift)
    assert [len(holes) for _, holes in found] == [1, 0]
    for (ring, holes), shape in zip(found, (COURT, ROOM), strict=True):
        moved = shapely.transform(shape, lambda points: points + shift)
        assert np.array_equal(ring, snap_ring(moved.exterior, clockwise=True))
        assert shapely.LinearRing(ring).is_ccw is False
        assert all(shapely.LinearRing(hole).is_ccw for hole in holes)


HOUSES, SEED = 12, 5
# Plans whose rooms and doors are known, with all of that hidden.


LEAST = 0.85


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Plans that the pipeline makes of a few houses."""
    return made_plans(tmp_path_factory.mktemp("houses"), HOUSES, SEED)


@pytest.mark.slow
@pytest.mark.parametrize("holes", [True, False])
def test_rooms_and_doors_of_the_pipelines_plans_are_found_again(made, holes):
    counts = total([matches(plan, with_rooms(bare(plan, holes=holes))) for plan in made])
    assert counts.rooms_known > 50
    assert min(counts.rates()) >= LEAST


def test_labels_of_the_pipelines_plans_come_back(made):
    known = found = 0
    for plan in made:
        ours = with_rooms(bare(plan))
        for room in plan.rooms:
            twin = max(ours.rooms, key=lambda other: other.polygon.intersection(room.polygon).area)
            if room.label != "Unlabelled":
                known += 1
                found += room.label in twin.source_labels
    assert found >= 0.95 * known


@needs_shared
@pytest.mark.slow
def test_real_houses_are_divided_again_from_their_rings():
    rates: dict[str, list[float]] = {}
    for name in sorted(set(CASES) - set(NOT_YET)):
        truth = case(name)
        plan = plan_nearest(DATA / truth["mesh"], truth["floor_z"])
        score = scorer()(as_json(with_rooms(replace(plan, rooms=(), doors=(), windows=()))), truth)
        assert score["valid"], name
        for key in ("room_recall", "room_precision", "door_recall", "door_precision"):
            rates.setdefault(key, []).append(score[key])
    for key, values in rates.items():
        assert sum(values) / len(values) >= LEAST, key
