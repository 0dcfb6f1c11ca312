"""A door that is drawn beside a wall is meant in it; one that is drawn elsewhere is refused at once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from houseexpo.errors import ConfigError
from houseexpo.service.review.pages import INTO_WALL_M, snap_to_wall, unsure_parts
from tests.builders.services import two_rooms

PLAN = two_rooms("a")  # the wall between the rooms stands from x = 4.1 to 4.2, its door from y = 1.1 to 1.9


@pytest.mark.parametrize("x", [4.0, 3.9, 4.3, 4.4])
def test_a_door_beside_a_wall_moves_into_it(x: float) -> None:
    moved = snap_to_wall([(x, 2.1), (x, 2.9)], PLAN)
    expected = 4.1 + INTO_WALL_M if x < 4.1 else 4.2 - INTO_WALL_M
    assert moved == [(pytest.approx(expected), 2.1), (pytest.approx(expected), 2.9)]


@pytest.mark.parametrize("jambs", [[(4.15, 2.1), (4.15, 2.9)], [(4.15, 1.0), (4.15, 1.8)], [(0.0, 1.0), (0.0, 1.9)]])
def test_a_door_in_a_wall_or_over_a_door_stays(jambs: list[tuple[float, float]]) -> None:
    assert snap_to_wall(jambs, PLAN) == jambs


@pytest.mark.parametrize("x", [2.0, 3.5, -0.6])
def test_a_door_that_is_in_no_wall_is_refused(x: float) -> None:
    with pytest.raises(ConfigError, match=r"expected a place in a wall, found one .* m from the nearest wall"):
        snap_to_wall([(x, 1.2), (x, 2.0)], PLAN)


def test_unsure_parts_are_named_the_least_sure_first() -> None:
    rooms = (replace(PLAN.rooms[0], confidence=0.45), replace(PLAN.rooms[1], confidence=0.5))
    unsure = replace(PLAN, rooms=rooms, doors=(replace(PLAN.doors[0], confidence=0.2), *PLAN.doors[1:]))
    assert unsure_parts(PLAN) == []
    first, second = unsure_parts(unsure)
    assert first.startswith(f"{PLAN.doors[0].kind} 0, between ")
    assert first.endswith(": 20% sure")
    assert second.startswith("outline of room 0")
    assert second.endswith(": 45% sure")
