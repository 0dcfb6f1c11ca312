import pytest
import shapely

from pipeline.geometry.areas import union_of
from pipeline.geometry.closing import closes_most, enclosed_area, from_floor, from_hull, from_wall_ends

FLOOR = shapely.box(0, 0, 5, 4)


def u_shape(thickness: float) -> shapely.Geometry:
    """Three walls round the floor, open below."""
    t = thickness
    return union_of([shapely.box(-t, 0, 0, 4 + t), shapely.box(-t, 4, 5 + t, 4 + t), shapely.box(5, 0, 5 + t, 4 + t)])


@pytest.mark.parametrize("thickness", [0.05, 0.1, 0.2, 0.4])
def test_wall_ends_of_any_thickness_are_closed_across_an_open_front(thickness: float) -> None:
    walls = u_shape(thickness)
    assert enclosed_area(walls) == 0
    bands = from_wall_ends(walls, walls, 2.0)
    assert enclosed_area(union_of([walls, *bands])) == pytest.approx(20.0, rel=0.02)


def test_a_closed_house_gets_nothing() -> None:
    walls = union_of([u_shape(0.2), shapely.box(-0.2, -0.2, 5.2, 0)])
    assert from_wall_ends(walls, walls, 2.0) == []
    assert closes_most([FLOOR], walls)


def test_walls_far_apart_are_no_house() -> None:
    far = union_of([shapely.box(0, 0, 0.2, 4), shapely.box(30, 0, 30.2, 4)])
    assert from_wall_ends(far, far, 2.0) == []
    assert not closes_most([], far)


def test_the_edge_of_the_floor_closes_a_front_and_leaves_the_floor_free() -> None:
    walls = u_shape(0.2)
    bands = from_floor(FLOOR, walls, 2.0)
    assert enclosed_area(union_of([walls, *bands])) == pytest.approx(20.0, rel=0.01)
    assert union_of(bands).intersection(FLOOR).area < 0.01


def test_a_slab_in_a_garden_is_no_room() -> None:
    walls = shapely.box(-0.2, -0.2, 0, 4)  # one wall along it
    assert from_floor(FLOOR, walls, 2.0) == []


def test_a_floor_that_is_closed_already_gets_nothing() -> None:
    walls = union_of([u_shape(0.2), shapely.box(-0.2, -0.2, 5.2, 0)])
    assert from_floor(FLOOR, walls, 2.0) == []


@pytest.mark.parametrize(("depth", "fronts"), [(6.0, 1), (2.5, 0)])
def test_what_walls_leave_open_around_a_deep_room_is_its_front_and_around_a_stage_is_not(
    depth: float, fronts: int
) -> None:
    walls = shapely.box(0, 0, depth + 0.2, 4.4).difference(shapely.box(-1, 0.2, depth, 4.2))
    bands = from_hull(walls, 2.0)
    assert len(bands) == fronts
    assert all(band.distance(shapely.Point(0.0, 2.0)) < 0.2 for band in bands)


def test_a_corner_has_no_front() -> None:
    corner = shapely.box(0, 0, 4, 4).difference(shapely.box(0.2, 0.2, 5, 5))
    assert from_hull(corner, 2.0) == []
