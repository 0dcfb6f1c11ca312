"""What the page of a review is told of a plan, and of a house without one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from houseexpo.service.api.analysis import shape_values
from houseexpo.service.review.plan_facts import facts_without_plan, unsure_parts
from tests.builders.services import two_rooms

PLAN = two_rooms("a")


def test_unsure_parts_are_named_the_least_sure_first() -> None:
    rooms = (replace(PLAN.rooms[0], confidence=0.45), replace(PLAN.rooms[1], confidence=0.5))
    unsure = replace(PLAN, rooms=rooms, doors=(replace(PLAN.doors[0], confidence=0.2), *PLAN.doors[1:]))
    assert unsure_parts(PLAN) == []
    first, second = unsure_parts(unsure)
    assert first.startswith(f"{PLAN.doors[0].kind} 0, between ")
    assert first.endswith(": 20% sure")
    assert second.startswith("outline of room 0")
    assert second.endswith(": 45% sure")


def test_the_shape_of_a_house_without_a_plan_has_all_that_is_drawn_of_plans() -> None:
    class Source:
        pictured = 0.0, 0.0, 1.0, 1.0
        level: Any = type("Level", (), {"frame": type("Frame", (), {"matrix": None})})

    source: Any = Source()
    assert facts_without_plan("a", source)["shape"].keys() == shape_values(PLAN).keys() - {"frame"}
