from __future__ import annotations

import pytest

from houseexpo.analysis.measures import BY_NAME, MEASURES
from houseexpo.dataset.index import SCHEMA, index_row
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import PlanData

SQUARE = PlanData("square", [(0, 0), (0, 3), (4, 3), (4, 0)], 1, {"Kitchen": ((0, 0, 4, 3),)})


def test_names_and_columns_are_unique_and_described():
    assert len(BY_NAME) == len(MEASURES)
    columns = [measure.column for measure in MEASURES if measure.column]
    assert len(set(columns)) == len(columns)
    assert set(columns) <= set(SCHEMA.names)
    assert all(measure.about.endswith(".") and measure.title for measure in MEASURES)


def test_a_plan_without_rooms_has_no_numbers_of_rooms_and_doors():
    for name in (
        "rooms",
        "room_area",
        "doors",
        "cuts",
        "door_width",
        "doors_per_room",
        "degree",
        "loops",
        "depth",
    ):
        assert not list(BY_NAME[name].numbers(SQUARE)), name
    measured = {
        name: list(BY_NAME[name].numbers(SQUARE)) for name in ("source_rooms", "area", "long_side", "short_side")
    }
    assert measured == {"source_rooms": [1], "area": [12.0], "long_side": [4.0], "short_side": [3.0]}


def test_two_rooms_with_a_door(two_rooms):
    found = {measure.name: list(measure.numbers(two_rooms)) for measure in MEASURES if not measure.is_of_robot}
    assert found["rooms"] == [2]
    assert found["room_area"] == pytest.approx([4 * 3 - 0.4**2, 9.0])
    assert (found["doors"], found["cuts"], found["loops"], found["holes"]) == ([2], [0], [0], [1])
    assert (found["doors_per_room"], found["degree"], found["door_width"]) == ([2, 1], [1, 1], [0.8, 0.9])
    assert found["depth"] == [1]
    assert index_row(two_rooms)["area"] == round(two_rooms.area, 2)
    assert (index_row(two_rooms)["doors"], index_row(two_rooms)["cuts"], index_row(two_rooms)["width"]) == (
        2,
        0,
        7.1,
    )


def test_measures_of_a_robot(two_rooms):
    measured = FloorPlan(**{name: getattr(two_rooms, name) for name in ("id", "verts", "room_num", "room_category")})
    assert BY_NAME["reach"].of(measured) == 1.0
    assert 0 < BY_NAME["narrowest"].of(measured) <= 3.0
