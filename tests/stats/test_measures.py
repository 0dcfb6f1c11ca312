from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from houseexpo.analysis.similarity import SYMMETRIES
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import PlanObject, Quality
from stats import measures
from stats.record import record
from tests.stats.conftest import outline


def test_a_house_with_rooms(ring_of_rooms: FloorPlan) -> None:
    assert measures.rooms_found(ring_of_rooms) == 4
    assert measures.doors(ring_of_rooms) == 5
    assert measures.doors_per_room(ring_of_rooms) == [3, 3, 1, 2]
    assert measures.neighbours(ring_of_rooms) == [2, 2, 1, 1]
    assert measures.loops(ring_of_rooms) == 1, "two doors between the same rooms are a way round"
    assert measures.depth(ring_of_rooms) == 3, "entrance into 3, then 0, 1, 2"
    assert measures.room_areas_m2(ring_of_rooms) == pytest.approx([4.0, 4.0, 4.0, 2.0])
    assert measures.door_kinds(ring_of_rooms) == {"door": 2, "opening": 1, "cut": 1, "entrance": 1}


def test_quality_and_furniture_are_of_plans_that_have_them(ring_of_rooms) -> None:
    assert (measures.quality(ring_of_rooms), measures.furniture(ring_of_rooms)) == (None, None)
    stool = PlanObject(0, "stool", None, [(0.5, 0.5), (0.5, 0.8), (0.8, 0.8)], 0.45)
    told = replace(ring_of_rooms, quality=Quality(0.75), objects=(stool,))
    assert (measures.quality(told), measures.furniture(told)) == (0.75, 1)
    assert (record(told).numbers["quality"], record(told).numbers["furniture"]) == ([0.75], [1])


def test_an_outline_has_no_doors_to_count() -> None:
    plan = outline("a", 4.0, 3.0)
    assert (measures.doors(plan), measures.loops(plan), measures.depth(plan)) == (None, None, None)
    assert measures.rooms_found(plan) is None
    assert measures.doors_per_room(plan) == []
    assert measures.label_boxes(plan) == 2
    assert measures.area_m2(plan) == pytest.approx(12.0)
    assert (measures.long_side_m(plan), measures.short_side_m(plan)) == pytest.approx((4.0, 3.0))


def test_rings_that_are_not_simple() -> None:
    crossing = FloorPlan("x", [(0, 0), (2, 2), (2, 0), (0, 2.5)], 1, {})
    touching = FloorPlan("t", [(0, 0), (0, 4), (2, 2), (4, 4), (4, 0), (2, 2)], 1, {})
    assert measures.ring_fault(crossing) == "crosses"
    assert measures.ring_fault(touching) == "touches"
    assert measures.ring_fault(outline("a")) is None


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_a_turned_or_mirrored_plan_has_the_same_shape(symmetry: str, ring_of_rooms: FloorPlan) -> None:
    swap, flip_y, flip_x = SYMMETRIES[symmetry]
    verts = ring_of_rooms.verts[:, ::-1] if swap else ring_of_rooms.verts
    verts = verts * np.array([-1 if flip_x else 1, -1 if flip_y else 1]) + 7.3
    moved = FloorPlan("moved", np.roll(verts, 2, axis=0)[::-1], 4, {})
    bare = FloorPlan("bare", ring_of_rooms.verts, 4, {})
    assert measures.shape_digest(moved) == measures.shape_digest(bare)
    assert measures.ring_digest(moved) != measures.ring_digest(bare)


def test_another_plan_has_another_shape() -> None:
    assert measures.shape_digest(outline("a", 4.0, 3.0)) == measures.shape_digest(outline("b", 3.0, 4.0))
    assert measures.shape_digest(outline("a", 4.0, 3.0)) != measures.shape_digest(outline("b", 4.0, 3.01))
