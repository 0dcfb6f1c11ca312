import numpy as np
import pytest
import shapely
from shapely.affinity import rotate

from pipeline.geometry.straighten import are_straight, straighten_outlines

ROOM = shapely.box(0, 0, 5, 4)
L_ROOM = shapely.Polygon([(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)])


def straight(*rooms: shapely.Polygon) -> list[shapely.Polygon]:
    return straighten_outlines(list(rooms), offset_m=0.03, angle_deg=2.0)


def corners(room: shapely.Polygon) -> set[tuple[float, float]]:
    return {(round(x, 3) + 0.0, round(y, 3) + 0.0) for x, y in shapely.get_coordinates(room)}


@pytest.mark.parametrize("room", [ROOM, L_ROOM, rotate(L_ROOM, 17), rotate(L_ROOM, 45)])
def test_a_straight_room_stays_as_it_is(room: shapely.Polygon) -> None:
    (found,) = straight(room)
    assert found.hausdorff_distance(room) < 1e-6
    assert len(corners(found)) == len(corners(room))


@pytest.mark.parametrize(
    ("room", "known"),
    [
        (ROOM, True),
        (L_ROOM, True),
        (rotate(ROOM, 90), True),
        (rotate(ROOM, 17), False),
        (ROOM.union(shapely.box(4.9, 1.0, 5.02, 2.0)), False),  # a jog
        (ROOM.difference(shapely.box(4.0, 1.0, 5.0, 1.02)), False),  # a slit
    ],
)
def test_rooms_are_known_to_be_straight(room: shapely.Polygon, known: bool) -> None:
    assert are_straight([room], 0.03) is known


def test_rooms_with_faces_that_belong_on_one_line_are_not_straight() -> None:
    other = shapely.box(5.2, 0.02, 8.0, 4.0)
    assert not are_straight([ROOM, other], 0.03)
    assert are_straight([ROOM, shapely.box(7.0, 0.02, 8.0, 4.0)], 0.03), "too far apart to be one wall"
    assert are_straight([ROOM, other], 0.01)


def test_a_room_a_degree_off_the_axes_is_turned_only_if_its_walls_are_short() -> None:
    assert straight(rotate(shapely.box(0, 0, 1.5, 1.2), 1.0))[0].hausdorff_distance(shapely.box(0, 0, 1.5, 1.2)) < 1e-3
    long = rotate(shapely.box(0, 0, 9, 8), 1.0)
    assert straight(long)[0].hausdorff_distance(long) < 1e-6


def test_skewed_slabs_give_straight_walls() -> None:
    skewed = shapely.Polygon([(0, 0), (2.5, 0.02), (5, 0.01), (5.02, 4.01), (0.01, 3.99)])
    (found,) = straight(skewed)
    assert len(corners(found)) == 4
    edges = np.diff(shapely.get_coordinates(found), axis=0)
    assert np.abs(edges).min(axis=1).max() < 1e-9
    assert found.symmetric_difference(skewed).area < 0.15


def test_a_jog_of_a_centimetre_is_no_corner() -> None:
    jogged = shapely.Polygon([(0, 0), (2, 0), (2, 0.01), (5, 0.01), (5, 4), (0, 4)])
    (found,) = straight(jogged)
    assert len(corners(found)) == 4
    assert found.bounds[1] == pytest.approx(0.006, abs=0.003)  # between the two, the longer counts more


def test_a_jog_of_ten_centimetres_is_one() -> None:
    stepped = shapely.Polygon([(0, 0), (2, 0), (2, 0.1), (5, 0.1), (5, 4), (0, 4)])
    assert straight(stepped)[0].symmetric_difference(stepped).area < 1e-6


def test_a_notch_thinner_than_noise_goes_and_a_niche_stays() -> None:
    niche = shapely.box(2, 4, 3, 4.3)
    sliver = shapely.box(1, 0, 1.02, 0.02)
    (found,) = straight(ROOM.union(niche).difference(sliver))
    assert found.symmetric_difference(ROOM.union(niche)).area < 0.01


def test_the_stair_steps_of_a_raster_become_an_oblique_edge() -> None:
    steps = [(k * 0.01, k * 0.01 - 0.01 * (s == 0)) for k in range(1, 200) for s in (0, 1)]
    stairs = shapely.Polygon([(0, 0), *steps, (1.99, 4), (0, 4)]).buffer(0)
    (found,) = straight(stairs)
    triangle = shapely.Polygon([(0, 0), (1.99, 1.99), (1.99, 4), (0, 4)])
    assert len(corners(found)) <= 6
    assert found.symmetric_difference(triangle).area < 0.05


@pytest.mark.parametrize("degrees", [17.0, 30.0, 45.0])
def test_an_oblique_wall_keeps_its_angle_beside_straight_ones(degrees: float) -> None:
    cut_off = ROOM.difference(rotate(shapely.box(4, -5, 9, 9), -degrees, origin=(4, 2)))
    (found,) = straight(cut_off)
    assert found.hausdorff_distance(cut_off) < 1e-3
    edges = np.diff(shapely.get_coordinates(found), axis=0)
    angles = np.degrees(np.arctan2(edges[:, 0], edges[:, 1])) % 180
    assert np.abs(angles - degrees).min() < 0.01


def test_a_house_that_stands_askew_is_straight_in_its_own_directions() -> None:
    noisy = shapely.Polygon([(0, 0), (2.5, 0.015), (5, 0.0), (5.01, 4.01), (0.01, 4.0)])
    (found,) = straight(rotate(noisy, 17, origin=(0, 0)))
    assert len(corners(found)) == 4
    edges = np.diff(shapely.get_coordinates(found), axis=0)
    angles = np.degrees(np.arctan2(edges[:, 1], edges[:, 0])) % 180
    assert angles[:2] == pytest.approx(angles[2:], abs=1e-6)  # opposite walls are parallel
    assert sorted(angles % 90) == pytest.approx([17] * 4, abs=0.3)


def test_a_round_tower_stays_round() -> None:
    tower = shapely.Point(0, 0).buffer(2.0, quad_segs=8)
    (found,) = straight(tower)
    assert found.hausdorff_distance(tower) < 0.09
    assert found.area == pytest.approx(tower.area, rel=0.02)


def test_faces_of_one_wall_in_two_rooms_come_to_lie_on_one_line() -> None:
    upper, lower = shapely.box(0, 2.6, 3, 5), shapely.box(0.012, 0, 3, 2.4)
    rooms = straight(upper, lower)
    assert rooms[0].bounds[0] == pytest.approx(rooms[1].bounds[0], abs=1e-9)


def test_the_two_faces_of_a_thin_wall_stay_apart() -> None:
    left, right = shapely.box(0, 0, 3, 3), shapely.box(3.02, 0, 6, 3)
    found = straight(left, right)
    assert found[1].bounds[0] - found[0].bounds[2] == pytest.approx(0.02, abs=1e-6)


def test_holes_are_straightened_too() -> None:
    pillar = shapely.Polygon([(2, 2), (2.4, 2.01), (2.4, 2.4), (2.0, 2.4)])
    (found,) = straight(ROOM.difference(pillar))
    assert len(found.interiors) == 1
    assert found.area == pytest.approx(20 - 0.158, abs=0.02)


def test_no_rooms_are_no_rooms() -> None:
    assert straight() == []
