import numpy as np
import pytest
import shapely

from pipeline.geometry.areas import OUTSIDE, enclosed_pieces
from pipeline.geometry.bridges import Bridge, bridges, distance_in_row, free_intervals, join_rows

SHELL = shapely.box(-0.2, -0.2, 7.4, 3.2).difference(shapely.box(0, 0, 7.2, 3))
UPPER, LOWER = shapely.box(4.0, 1.9, 4.2, 3.0), shapely.box(4.0, 0.0, 4.2, 1.0)
DOOR = shapely.union_all([SHELL, UPPER, LOWER])
LINTEL = shapely.box(4.0, 1.0, 4.2, 1.9)


def found(piece: shapely.Polygon, door: shapely.Geometry = DOOR) -> list[Bridge]:
    plane, rooms = enclosed_pieces(shapely.union_all([door, piece]))
    return bridges([piece], rooms, plane, door)[0]


def test_a_lintel_is_a_bridge_from_face_to_face() -> None:
    (bridge,) = found(LINTEL)
    assert bridge.centre == pytest.approx([4.1, 1.45])
    assert (bridge.width, bridge.depth) == (pytest.approx(0.9), pytest.approx(0.2))
    assert set(bridge.sides) == {0, 1}
    assert bridge.strip().symmetric_difference(LINTEL).area < 1e-9
    assert sorted(bridge.segment[:, 1].tolist()) == pytest.approx([1.0, 1.9])
    assert bridge.has_jamb(DOOR)


def test_across_points_from_the_first_side_to_the_second() -> None:
    (bridge,) = found(LINTEL)
    rooms = enclosed_pieces(DOOR.union(LINTEL))[1]
    for side, sign in zip(bridge.sides, (-1, 1), strict=True):
        assert rooms[side].contains(shapely.Point(bridge.centre + sign * 0.2 * bridge.across))


def test_a_lintel_in_an_outer_wall_leads_outside() -> None:
    hole = shapely.box(1, -0.2, 2, 0)
    (bridge,) = found(hole, DOOR.union(LINTEL).difference(hole))
    assert OUTSIDE in bridge.sides


@pytest.mark.parametrize("step", [(4.2, 1.0, 5.0, 1.2), (4.2, 1.3, 5.0, 1.5), (4.2, 1.7, 5.0, 1.9)])
def test_a_step_that_hangs_before_a_lintel_is_no_part_of_the_wall(step: tuple[float, float, float, float]) -> None:
    (bridge,) = found(LINTEL.union(shapely.box(*step)))
    assert bridge.strip().symmetric_difference(LINTEL).area < 1e-3


def test_a_lintel_thicker_for_a_part_of_it_is_as_deep_as_that() -> None:
    (bridge,) = found(LINTEL.union(shapely.box(4.2, 1.6, 4.3, 1.9)))
    assert (bridge.width, bridge.depth) == (pytest.approx(0.9), pytest.approx(0.3))


def test_a_shelf_in_a_room_is_none() -> None:
    assert found(shapely.box(0, 0, 0.3, 2)) == []


def test_an_oblique_lintel() -> None:
    turn = [shapely.affinity.rotate(g, 17, origin=(0, 0)) for g in (LINTEL, DOOR)]
    (bridge,) = found(*turn)
    assert (bridge.width, bridge.depth) == (pytest.approx(0.9, abs=1e-6), pytest.approx(0.2, abs=1e-6))
    assert abs(bridge.along @ [-np.sin(np.deg2rad(17)), np.cos(np.deg2rad(17))]) == pytest.approx(1)


def test_a_strip_wider_and_deeper() -> None:
    bridge = Bridge(np.array([1.0, 2.0]), np.array([1.0, 0.0]), 0.8, 0.2, (0, 1))
    assert bridge.strip(deeper_m=0.1, wider_m=0.2).bounds == pytest.approx((0.4, 1.8, 1.6, 2.2))
    assert bridge.part_between(-0.4, 0.0).strip().bounds == pytest.approx((0.6, 1.9, 1.0, 2.1))


def test_what_stands_in_a_strip_divides_it() -> None:
    bridge = Bridge(np.array([0.0, 0.0]), np.array([1.0, 0.0]), 2.0, 0.2, (0, 1))
    post = shapely.box(-0.1, -0.1, 0.1, 0.1)
    assert free_intervals(bridge, post) == [pytest.approx((-1.0, -0.1)), pytest.approx((0.1, 1.0))]
    assert free_intervals(bridge, shapely.Polygon()) == [(-1.0, 1.0)]


@pytest.mark.parametrize(("apart", "sides", "number"), [(0.3, (0, 1), 1), (0.3, (0, 2), 2), (0.8, (0, 1), 2)])
def test_neighbours_in_a_row_are_one_bridge(apart: float, sides: tuple[int, int], number: int) -> None:
    first = Bridge(np.array([0.0, 0.0]), np.array([1.0, 0.0]), 1.0, 0.2, (0, 1))
    second = Bridge(np.array([1.0 + apart, 0.02]), np.array([1.0, 0.0]), 1.0, 0.2, sides)
    result = join_rows([first, second], shapely.Polygon())
    assert len(result) == number
    if number == 1:
        assert result[0].width == pytest.approx(2.0 + apart)
        assert result[0].depth == pytest.approx(0.22)


def test_the_distance_in_a_row() -> None:
    first = Bridge(np.array([0.0, 0.0]), np.array([1.0, 0.0]), 1.0, 0.2, (0, 1))
    second = Bridge(np.array([0.0, 1.5]), np.array([1.0, 0.0]), 1.0, 0.2, (0, 1))
    crossing = Bridge(np.array([1.0, 0.0]), np.array([0.0, 1.0]), 1.0, 0.2, (0, 1))
    in_row = Bridge(np.array([-2.0, 0.0]), np.array([-1.0, 0.0]), 1.0, 0.2, (1, 0))
    assert distance_in_row(first, second) is None
    assert distance_in_row(first, crossing) is None
    assert distance_in_row(first, in_row) == pytest.approx(1.0)
