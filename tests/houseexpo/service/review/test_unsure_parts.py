"""What the page of a review names as unsure."""

from __future__ import annotations

from dataclasses import replace

from houseexpo.service.review.plan_facts import unsure_parts
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
