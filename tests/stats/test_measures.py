from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from houseexpo.analysis.similarity import SYMMETRIES
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import PlanObject, Quality
from stats.record import measure_plan, ring_digest, ring_fault, shape_digest
from tests.stats.conftest import outline


def test_a_house_with_rooms(ring_of_rooms: FloorPlan) -> None:
    found = measure_plan(ring_of_rooms)
    numbers = found.numbers
    assert (numbers["rooms"], numbers["doors"]) == ([4], [5])
    assert numbers["doors_per_room"] == [3, 3, 1, 2]
    assert numbers["degree"] == [2, 2, 1, 1]
    assert numbers["loops"] == [1], "two doors between the same rooms are a way round"
    assert numbers["depth"] == [3], "entrance into 3, then 0, 1, 2"
    assert numbers["room_area_m2"] == pytest.approx([4.0, 4.0, 4.0, 2.0])
    assert found.door_kinds == {"door": 2, "opening": 1, "cut": 1, "entrance": 1}


def test_quality_and_furniture_are_of_plans_that_have_them(ring_of_rooms: FloorPlan) -> None:
    assert not {"quality", "furniture"} & set(measure_plan(ring_of_rooms).numbers)
    stool = PlanObject(0, "stool", None, [(0.5, 0.5), (0.5, 0.8), (0.8, 0.8)], 0.45)
    told = replace(ring_of_rooms, quality=Quality(0.75), objects=(stool,))
    assert (measure_plan(told).numbers["quality"], measure_plan(told).numbers["furniture"]) == ([0.75], [1])


def test_an_outline_has_no_doors_to_count() -> None:
    numbers = measure_plan(outline("a", 4.0, 3.0)).numbers
    assert not {"doors", "loops", "depth", "rooms", "doors_per_room"} & set(numbers)
    assert numbers["label_boxes"] == [2]
    assert numbers["area_m2"] == pytest.approx([12.0])
    assert numbers["long_side_m"] + numbers["short_side_m"] == pytest.approx([4.0, 3.0])


def test_rings_that_are_not_simple() -> None:
    crossing = FloorPlan("x", [(0, 0), (2, 2), (2, 0), (0, 2.5)], 1, {})
    touching = FloorPlan("t", [(0, 0), (0, 4), (2, 2), (4, 4), (4, 0), (2, 2)], 1, {})
    assert ring_fault(crossing) == "crosses"
    assert ring_fault(touching) == "touches"
    assert ring_fault(outline("a")) is None


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_a_turned_or_mirrored_plan_has_the_same_shape(symmetry: str, ring_of_rooms: FloorPlan) -> None:
    swap, flip_y, flip_x = SYMMETRIES[symmetry]
    verts = ring_of_rooms.verts[:, ::-1] if swap else ring_of_rooms.verts
    verts = verts * np.array([-1 if flip_x else 1, -1 if flip_y else 1]) + 7.3
    moved = FloorPlan("moved", np.roll(verts, 2, axis=0)[::-1], 4, {})
    bare = FloorPlan("bare", ring_of_rooms.verts, 4, {})
    assert shape_digest(moved) == shape_digest(bare)
    assert ring_digest(moved) != ring_digest(bare)


def test_another_plan_has_another_shape() -> None:
    assert shape_digest(outline("a", 4.0, 3.0)) == shape_digest(outline("b", 3.0, 4.0))
    assert shape_digest(outline("a", 4.0, 3.0)) != shape_digest(outline("b", 4.0, 3.01))
