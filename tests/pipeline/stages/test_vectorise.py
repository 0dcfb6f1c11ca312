"""Stage vectorise: rings of docs/format.md."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate, translate

from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Frame
from pipeline.geometry.areas import OUTSIDE
from pipeline.geometry.openings import Opening
from pipeline.stages.vectorise import vectorise
from pipeline.values import NamedRoom, SourceRoom, Spaces
from tests.builders.houses import level, shell

LEFT, RIGHT = shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3)


def passage(x: float = 4.1, kind: str = "door", sides: tuple[int, int] = (1, 0), depth: float = 0.2) -> Opening:
    return Opening(np.array([x, 1.5]), np.array([0.0, 1.0]), 0.9, depth, sides, kind)


def plan_from(shapes: list[shapely.Polygon], *passages: Opening, **values: object) -> FloorPlan:
    house = level(shell((0, 0, 7.2, 3)), **values)
    named = tuple(NamedRoom(r, ("Kitchen",) if k else (), ("Küche",) if k else ()) for k, r in enumerate(shapes))
    return vectorise(house, Spaces(shapely.Polygon(), tuple(shapes), passages), named, {"source": "test"})


def rings(plan: FloorPlan) -> list[np.ndarray]:
    inner = [ring for room in plan.rooms for ring in (room.ring, *room.holes)]
    return [plan.verts, *plan.holes, *inner, *(door.ring for door in plan.doors)]


def check_rings(plan: FloorPlan) -> None:
    for ring in rings(plan):
        assert shapely.Polygon(ring).is_valid
        np.testing.assert_array_equal(ring, np.round(ring, 2))
        step = np.roll(ring, -1, axis=0) - ring
        after = np.roll(step, -1, axis=0)
        assert (np.abs(step).max(axis=1) > 0).all()
        assert (np.abs(step[:, 0] * after[:, 1] - step[:, 1] * after[:, 0]) > 1e-9).all()
    assert plan.verts.min(axis=0) == pytest.approx([0.1, 0.1])
    assert not shapely.LinearRing(plan.verts).is_ccw
    assert all(shapely.LinearRing(hole).is_ccw for hole in plan.holes)
    parts = [room.polygon for room in plan.rooms] + [d.polygon for d in plan.doors if d.kind != "entrance"]
    assert shapely.union_all(parts).symmetric_difference(plan.free_space).area < 0.05
    assert sum(p.area for p in parts) == pytest.approx(plan.free_space.area, abs=0.05)


def test_a_cut_says_in_the_provenance_what_speaks_for_its_place() -> None:
    plan = plan_from([LEFT, RIGHT], passage(), replace(passage(kind="cut"), why="a lintel"))
    assert plan.provenance == {"source": "test", "cuts": [{"door": 1, "why": "a lintel"}]}
    assert plan_from([LEFT, RIGHT], passage()).provenance == {"source": "test"}


@pytest.mark.parametrize("lost", [shapely.box(7.4, 0, 7.404, 3), shapely.box(1, 1, 1.003, 1.003)])
def test_a_room_that_vanishes_on_the_grid_is_left_out_with_its_doors(lost: shapely.Polygon) -> None:
    into = Opening(np.array([7.3, 1.5]), np.array([0.0, 1.0]), 0.9, 0.2, (1, 2), "door")
    plan = plan_from([LEFT, RIGHT, lost], passage(), into)
    assert [room.label for room in plan.rooms] == ["Unlabelled", "Kitchen"]
    assert [sorted(door.rooms) for door in plan.doors] == [[0, 1]]


def test_two_rooms_and_a_door() -> None:
    plan = plan_from([LEFT, RIGHT], passage())
    check_rings(plan)
    assert len(plan.verts) == 12
    assert plan.bbox == (0.1, 0.1, 7.3, 3.1)
    assert plan.area == pytest.approx(21 + 0.18)
    assert [r.label for r in plan.rooms] == ["Unlabelled", "Kitchen"]
    assert plan.rooms[1].source_labels == ("Küche",)
    (door,) = plan.doors
    assert (door.kind, door.width, set(door.rooms)) == ("door", 0.9, {0, 1})
    assert sorted(door.segment) == [(4.2, 1.15), (4.2, 2.05)]
    assert door.polygon.equals(shapely.box(4.1, 1.15, 4.3, 2.05))


def test_an_entrance_stays_closed_in_the_outline_and_comes_last() -> None:
    plan = plan_from([LEFT, RIGHT], passage(7.3, "entrance", (OUTSIDE, 1)), passage())
    check_rings(plan)
    assert [d.kind for d in plan.doors] == ["door", "entrance"]
    assert plan.doors[1].rooms == (1, None)
    assert plan.bbox[2] == 7.3


def test_neighbours_share_vertices_where_they_meet() -> None:
    slanted = [
        shapely.Polygon([(0, 0), (4, 0), (4.37, 3), (0, 3)]),
        shapely.Polygon([(4, 0), (8, 0), (8, 3), (4.37, 3)]),
    ]
    plan = plan_from(slanted)
    check_rings(plan)
    first, second = ({tuple(p) for p in room.ring.tolist()} for room in plan.rooms)
    assert len(first & second) == 2


def test_holes() -> None:
    pillar = shapely.box(1, 1, 1.4, 1.4)
    plan = plan_from([LEFT.difference(pillar), RIGHT], passage())
    check_rings(plan)
    assert len(plan.holes) == 1
    assert shapely.Polygon(plan.holes[0]).bounds == pytest.approx((1.1, 1.1, 1.5, 1.5))


def test_a_corridor_round_a_block_of_walls_has_its_hole() -> None:
    ring = shapely.box(0, 0, 6, 6).difference(shapely.box(2, 2, 4, 4))
    plan = plan_from([ring])
    check_rings(plan)
    assert plan.area == 32.0


@pytest.mark.parametrize("degrees", [17, 45, 73.3])
def test_oblique_rooms_tile_too(degrees: float) -> None:
    rooms = [rotate(r, degrees, origin=(0, 0)) for r in (LEFT, RIGHT)]
    along = np.array([-np.sin(np.deg2rad(degrees)), np.cos(np.deg2rad(degrees))])
    centre = shapely.get_coordinates(rotate(shapely.Point(4.1, 1.5), degrees, origin=(0, 0)))[0]
    plan = plan_from(rooms, Opening(centre, along, 0.9, 0.2, (1, 0), "door"))
    check_rings(plan)
    assert plan.area == pytest.approx(21.18, abs=0.05)


def test_vertices_on_a_straight_edge_are_gone() -> None:
    many = shapely.segmentize(LEFT, 0.05)
    assert len(plan_from([many]).verts) == 4


@pytest.mark.parametrize("shift", [(0, 0), (-3.217, 1234.5678)])
def test_the_frame_leads_back_to_the_source(shift: tuple[float, float]) -> None:
    frame = Frame(((0.0, -1.0, 5.0), (1.0, 0.0, -2.0)), "y", 2.7, 3)
    plan = plan_from([translate(LEFT, *shift)], frame=frame)
    corners = {tuple(np.round(p, 2)) for p in source_points_from_plan(plan.frame, plan.verts)}
    x, y = shift
    expected = {tuple(np.round((5 - (b + y), a + x - 2), 2)) for a, b in ((0, 0), (4, 0), (4, 3), (0, 3))}
    assert max(min(np.hypot(a - c, b - d) for c, d in expected) for a, b in corners) < 0.011
    assert (plan.frame.up, plan.frame.floor, plan.frame.level) == ("y", 2.7, 3)


def test_boxes_of_labels_are_the_sources_own_where_it_has_them() -> None:
    own = SourceRoom(("bedroom",), ("Bedroom",), box=(-0.2, -0.2, 4.2, 3.2))
    line = SourceRoom(("kitchen",), ("Kitchen",), box=(1.0, 2.0, 3.0, 2.004))
    plan = plan_from([LEFT, RIGHT], passage(), rooms=(own, line))
    assert plan.room_category == {"Bedroom": ((-0.1, -0.1, 4.3, 3.3),)}
    assert plan_from([LEFT, RIGHT], passage()).room_category == {"Kitchen": ((4.3, 0.1, 7.3, 3.1),)}


@pytest.mark.parametrize(("count", "expected"), [(None, 2), (5, 5), (0, 0)])
def test_room_num_is_the_sources_count(count: int | None, expected: int) -> None:
    assert plan_from([LEFT, RIGHT], passage(), room_count=count).room_num == expected


def test_of_free_space_in_two_parts_the_larger_is_the_plan() -> None:
    plan = plan_from([LEFT, RIGHT])
    assert plan.area == pytest.approx(12.0)
    assert len(plan.rooms) == 1


def test_a_door_with_a_spur_that_is_a_cell_wide_on_the_grid_only_stays() -> None:
    """The way from the room below ends half a cell past it, and another way crosses it: on the grid, the middle of the
    face that is left of it lies in a spur along the room."""
    end = 5.984999999999999  # rounded up on the grid
    below, hall, left = (
        shapely.box(3.026, 0.025, 5.975, 2.974),
        shapely.box(5.025, 3.026, 9, 8),
        shapely.box(0, 3.026, 4.975, 8),
    )
    way = Opening(np.array([(5.0 + end) / 2, 3.0]), np.array([1.0, 0.0]), end - 5.0, 0.052, (0, 1))
    mouth = Opening(np.array([5.0, 4.0135]), np.array([0.0, 1.0]), 1.973, 0.05, (2, 1))
    plan = plan_from([below, hall, left], way, mouth)
    check_rings(plan)
    assert (len(plan.rooms), len(plan.doors)) == (3, 2)
