"""Shapes of rooms, and voids in floors."""

from __future__ import annotations

import pytest
import shapely
from shapely import Polygon, box

from pipeline.geometry.areas import EMPTY
from pipeline.geometry.room_shapes import are_rooms_misshapen, have_jutting_walls, subtract_floor_voids

ROOM = box(0, 0, 5, 4)


@pytest.mark.parametrize(
    ("room", "is_odd"),
    [
        (box(0, 0, 1.1, 1.3), True),  # too small
        (box(0, 0, 0.8, 4.0), True),  # too narrow
        (box(0, 0, 20, 11), True),  # too large
        (box(0, 0, 1.0, 10.0), False),  # a corridor
        (box(0, 0, 1.3, 1.2), False),  # a toilet
    ],
)
def test_rooms_of_odd_shape_or_size(room: Polygon, is_odd: bool) -> None:
    assert are_rooms_misshapen((ROOM, room)).tolist() == [False, is_odd]


def test_a_room_with_many_teeth_is_ragged() -> None:
    teeth = [box(x, 0, x + 0.9, 2.8) for x in range(10)]
    assert are_rooms_misshapen((Polygon(shapely.union_all([box(0, 2.8, 10, 4), *teeth])),)).all()


@pytest.mark.parametrize(
    ("wall", "ends"),
    [
        (box(2, 0, 2.1, 2), True),
        (box(2, 0, 2.1, 0.4), False),  # a nib beside a door
        (box(2, 0, 3, 2), False),  # a chimney breast
        (box(2, 0, 2.02, 2), False),  # a crack
        (box(2, 1, 2.1, 3), False),  # it stands free: a pillar, which holes show
    ],
)
def test_a_wall_that_ends_in_the_middle_of_a_room(wall: Polygon, ends: bool) -> None:
    assert have_jutting_walls((ROOM, Polygon(ROOM.difference(wall)))).tolist() == [False, ends]


HALL = box(0, 0, 5, 4)
VOID = box(3, 1, 5, 4)
FLOOR = HALL.difference(VOID)


def test_there_is_no_free_space_over_a_void():
    (left,) = subtract_floor_voids(HALL, FLOOR, VOID, EMPTY)
    assert left.area == pytest.approx(14.0, abs=0.1)


def test_the_upper_steps_of_a_flight_hide_some_of_it():
    (left,) = subtract_floor_voids(HALL, FLOOR, VOID.difference(box(3, 1, 4, 2.1)), EMPTY)
    assert left.area == pytest.approx(14.0, abs=0.1)


def test_a_hole_that_shows_nothing_below_is_floor_that_the_file_lacks():
    assert subtract_floor_voids(HALL, FLOOR, EMPTY, EMPTY) == [HALL]
    assert subtract_floor_voids(HALL, FLOOR, box(4, 3, 5, 4), EMPTY) == [HALL]


def test_a_void_that_a_room_of_the_source_covers_is_the_rooms():
    assert subtract_floor_voids(HALL, FLOOR, VOID, HALL) == [HALL]


def test_a_void_that_no_room_of_the_source_covers_is_none():
    (left,) = subtract_floor_voids(HALL, FLOOR, VOID, FLOOR)
    assert left.area == pytest.approx(14.0, abs=0.1)


def test_a_crack_between_floor_and_wall_is_no_void():
    assert subtract_floor_voids(HALL, box(0, 0, 4.5, 4), HALL, EMPTY) == [HALL]


def test_a_void_all_round_which_people_walk_is_a_hole():
    (left,) = subtract_floor_voids(HALL, HALL.difference(box(1, 1, 4, 3)), HALL, EMPTY)
    assert [round(shapely.Polygon(ring).area) for ring in left.interiors] == [6]


def test_a_void_from_wall_to_wall_parts_a_room():
    left = subtract_floor_voids(HALL, HALL.difference(box(2, 0, 4, 4)), HALL, EMPTY)
    assert [round(part.area) for part in left] == [8, 4]


def test_the_upper_half_of_a_high_hall_is_no_room():
    assert subtract_floor_voids(HALL, box(0, 0, 0.5, 4), HALL, EMPTY) == []
    assert subtract_floor_voids(HALL, EMPTY, HALL, HALL) == [HALL]
