"""What is asked of a home: it follows the published statistics, and what goes together there goes together here."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pipeline.sources.homes.kinds import COUNTED, NUMBERS, STRATA, TABLE, draw_house, draw_wish, stratum_of
from pipeline.sources.homes.values import Wish


@pytest.mark.slow
def test_a_wish_is_drawn_from_the_published_statistics() -> None:
    rng = np.random.default_rng(1)
    wishes = [draw_wish(rng) for _ in range(400)]
    assert np.median([wish.area_m2 for wish in wishes]) == pytest.approx(113, rel=0.15)
    assert np.median([wish.rooms for wish in wishes]) == pytest.approx(7, abs=1)
    assert all(wish.short_m <= wish.long_m for wish in wishes)
    assert all(sum(wish.areas_m2) == pytest.approx(wish.area_m2) for wish in wishes)


@pytest.fixture(scope="module")
def wishes() -> list[Wish]:
    rng = np.random.default_rng(3)
    return [draw_wish(rng) for _ in range(1000)]


@pytest.mark.slow
def test_a_wish_has_one_door_less_than_spaces_and_no_more_names_than_labels(wishes: list[Wish]) -> None:
    for wish in wishes:
        assert len(wish.doors) == wish.spaces - 1
        assert len(wish.names) == len(wish.areas_m2) == wish.spaces
        assert list(wish.doors) == sorted(wish.doors)
        assert min(wish.doors, default=1.0) >= 0.5
        assert min(wish.areas_m2) > 0.9


@pytest.mark.slow
def test_doors_of_a_home_are_of_few_makes(wishes: list[Wish]) -> None:
    five = [wish.doors for wish in wishes if len(wish.doors) == 5]
    assert 2.0 < np.mean([len(set(doors)) for doors in five]) < 3.4
    every = np.array([width for wish in wishes for width in wish.doors])
    assert np.isin(every, (0.74, 1.0, 0.98, 1.2, 1.84)).mean() == pytest.approx(0.68, abs=0.06)


@pytest.mark.slow
def test_labels_that_go_together_are_drawn_together(wishes: list[Wish]) -> None:
    labels = [{label for names in wish.names for label in names} for wish in wishes]
    hallway = [house for house in labels if "Hallway" in house]
    assert len(hallway) > 60
    with_hallway = np.mean(["Child_Room" in house for house in hallway])
    without = np.mean(["Child_Room" in house for house in labels if "Hallway" not in house])
    assert with_hallway > 2 * without


@pytest.mark.slow
def test_as_many_labels_are_drawn_as_go_with_the_spaces() -> None:
    rng = np.random.default_rng(1)
    known = {tuple(row[:-1]) for row in json.loads(TABLE.read_text())["houses"]}
    for _ in range(200):
        house = draw_house(rng)
        assert (house.spaces, house.rooms, len(house.labels), house.nameless) in known


@pytest.mark.slow
def test_strata() -> None:
    assert [stratum_of(n) for n in (0, 1, 2, 7, 8, 9, 11, 12, 70)] == [0, 0, 1, 6, 6, 7, 7, 8, 8]


@pytest.mark.slow
def test_the_table_holds_distributions_and_no_plan() -> None:
    table = json.loads(TABLE.read_text())
    keys = {"plans", "shares", "houses", "strata", "kinds", "door_kinds", "sides_cm", "room_areas", "hubs"}
    assert set(table) == keys
    assert len(table["strata"]) == len(STRATA)
    for stratum in table["strata"]:
        assert set(stratum) == {*COUNTED, *NUMBERS}
        assert all(len(values) == len(table["shares"]) for values in stratum.values())
