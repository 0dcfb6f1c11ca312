from __future__ import annotations

import pytest

from houseexpo.floorplan import FloorPlan
from stats.report import TOTAL_VARIATION, WASSERSTEIN, measure_distances, total_variation
from stats.summary import PlanSummary
from tests.stats.conftest import outline


def summary(*plans: FloorPlan) -> PlanSummary:
    found = PlanSummary()
    for plan in plans:
        found.add(plan)
    return found


def test_a_data_set_is_no_distance_from_itself() -> None:
    one = summary(outline("a"), outline("b", 6.0, 5.0, rooms=4))
    assert {d.value for d in measure_distances(one, one)} == {0.0}


def test_distances_of_known_size() -> None:
    one = summary(outline("a", 4.0, 3.0, rooms=2), outline("b", 4.0, 3.0, rooms=4))
    other = summary(outline("c", 4.0, 5.0, rooms=7))
    found = {d.name: d for d in measure_distances(one, other)}
    assert found["source_rooms"].kind == WASSERSTEIN
    assert found["source_rooms"].value == pytest.approx((5 + 3) / 2)
    assert found["source_rooms"].deviations == pytest.approx(4.0), "the first one's deviation is 1"
    assert found["area_m2"].value == pytest.approx(8.0)
    assert found["area_m2"].deviations is None, "nothing to compare with where all are alike"
    assert found["labels"].kind == TOTAL_VARIATION
    assert found["connected_0.20"].value == 0.0


def test_what_one_of_them_lacks_is_left_out(ring_of_rooms: FloorPlan) -> None:
    names = {d.name for d in measure_distances(summary(ring_of_rooms), summary(outline("a")))}
    assert "source_rooms" in names
    assert not names & {"doors", "loops", "door_kinds"}


def test_total_variation() -> None:
    assert total_variation({"a": 3}, {"b": 1}) == 1.0
    assert total_variation({"a": 1, "b": 1}, {"a": 30, "b": 10}) == pytest.approx(0.25)
