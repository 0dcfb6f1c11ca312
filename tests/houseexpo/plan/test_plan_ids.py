"""The input, the building and the level of a plan stand in its id, in one form for all who read it."""

from __future__ import annotations

import pytest

from houseexpo.plan.ids import PlanId, building_id, is_of_input, parts_of


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("house", ("house", "", "", "")),
        ("house_L1", ("house", "", "_L1", "")),
        ("house_B2", ("house", "_B2", "", "")),
        ("house_B2_L1", ("house", "_B2", "_L1", "")),
        ("house_B2_L1_0a1b2c3d", ("house", "_B2", "_L1", "_0a1b2c3d")),
        ("house_0a1b2c3d_2", ("house", "", "", "_0a1b2c3d_2")),
        ("a_l1_b2", ("a_l1_b2", "", "", "")),
    ],
)
def test_an_id_has_up_to_four_parts(name: str, parts: tuple[str, ...]) -> None:
    found = parts_of(name)
    assert found == PlanId(*parts)
    assert "".join(found) == name
    assert is_of_input(name, found.base)
    assert is_of_input(found.of_input, found.base)


def test_what_a_plan_is_of() -> None:
    found = parts_of("house_B2_L1_0a1b2c3d")
    assert found.of_input == "house_0a1b2c3d"
    assert found.of_level == "house_L1_0a1b2c3d"
    assert found.of_building == "house_B2_0a1b2c3d"
    assert found.without_digits == "house_B2_L1"
    assert not is_of_input("house_2", "house")
    assert not is_of_input("house_L1_B2", "house")


@pytest.mark.parametrize(
    ("level", "building"),
    [
        ("house", "house_B2"),
        ("house_L1", "house_B2_L1"),
        ("house_20210401", "house_20210401_B2"),
        ("a_L3_x", "a_L3_x_B2"),
    ],
)
def test_the_building_stands_before_the_level(level: str, building: str) -> None:
    assert building_id(level, 2) == building
