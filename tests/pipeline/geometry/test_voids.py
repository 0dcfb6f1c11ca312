"""Voids in a floor: a hall of 5 x 4 m, a stair's void of 2 x 3 m in its corner."""

import pytest
import shapely
from shapely import box

from pipeline.geometry.areas import EMPTY
from pipeline.geometry.spaces import without_voids

HALL = box(0, 0, 5, 4)
VOID = box(3, 1, 5, 4)
FLOOR = HALL.difference(VOID)


def test_there_is_no_free_space_over_a_void():
    (left,) = without_voids(HALL, FLOOR, VOID, EMPTY)
    assert left.area == pytest.approx(14.0, abs=0.1)


def test_the_upper_steps_of_a_flight_hide_some_of_it():
    (left,) = without_voids(HALL, FLOOR, VOID.difference(box(3, 1, 4, 2.1)), EMPTY)
    assert left.area == pytest.approx(14.0, abs=0.1)


def test_a_hole_that_shows_nothing_below_is_floor_that_the_file_lacks():
    assert without_voids(HALL, FLOOR, EMPTY, EMPTY) == [HALL]
    assert without_voids(HALL, FLOOR, box(4, 3, 5, 4), EMPTY) == [HALL]


def test_a_void_that_a_room_of_the_source_covers_is_the_rooms():
    assert without_voids(HALL, FLOOR, VOID, HALL) == [HALL]


def test_a_void_that_no_room_of_the_source_covers_is_none():
    (left,) = without_voids(HALL, FLOOR, VOID, FLOOR)
    assert left.area == pytest.approx(14.0, abs=0.1)


def test_a_crack_between_floor_and_wall_is_no_void():
    assert without_voids(HALL, box(0, 0, 4.5, 4), HALL, EMPTY) == [HALL]


def test_a_void_all_round_which_people_walk_is_a_hole():
    (left,) = without_voids(HALL, HALL.difference(box(1, 1, 4, 3)), HALL, EMPTY)
    assert [round(shapely.Polygon(ring).area) for ring in left.interiors] == [6]


def test_a_void_from_wall_to_wall_parts_a_room():
    left = without_voids(HALL, HALL.difference(box(2, 0, 4, 4)), HALL, EMPTY)
    assert [round(part.area) for part in left] == [8, 4]


def test_the_upper_half_of_a_high_hall_is_no_room():
    assert without_voids(HALL, box(0, 0, 0.5, 4), HALL, EMPTY) == []
    assert without_voids(HALL, EMPTY, HALL, HALL) == [HALL]
