from __future__ import annotations

import pytest
import shapely
from shapely import Polygon, box

from pipeline.geometry.spaces import misshapen_rooms, with_loose_ends

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
    assert misshapen_rooms([ROOM, room]).tolist() == [False, is_odd]


def test_a_room_with_many_teeth_is_ragged() -> None:
    teeth = [box(x, 0, x + 0.9, 2.8) for x in range(10)]
    assert misshapen_rooms([Polygon(shapely.union_all([box(0, 2.8, 10, 4), *teeth]))]).all()


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
    assert with_loose_ends([ROOM, Polygon(ROOM.difference(wall))]).tolist() == [False, ends]
