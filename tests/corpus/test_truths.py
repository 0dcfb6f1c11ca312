"""Truths that persons draw: their rooms come from strokes and seeds, and plans are compared with them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.plan.json_codec import encode
from pipeline.algorithm import plan_largest_building
from pipeline.config import PipelineConfig
from pipeline.values import Level
from tests.builders.houses import Hole, Parts, level, shell, two_rooms, window
from tests.corpus.manifest import load as load_manifest
from tests.corpus.truths import TRUTHS, Door, Found, Room, Storey, Truth, compare, extent_of, load, rooms_of, save

DOOR = Hole(1.0, 1.9)
ROOMS = [Room((2.0, 1.5), "Kitchen"), Room((5.5, 1.5))]
DOORS = [Door((4.1, 1.0), (4.1, 1.9))]


def house(parts: Parts) -> tuple[Level, Storey]:
    """A level, and its storey as a person draws it."""
    found = level(parts)
    return found, Storey(0, extent_of(found), ROOMS, DOORS)


def planned(found: Level) -> dict[str, Any]:
    plan = plan_largest_building(found, PipelineConfig(), np.random.default_rng(0))
    return json.loads(encode(plan))


def test_rooms_are_what_seeds_reach_between_walls_and_doors() -> None:
    found, storey = house(two_rooms(DOOR))
    assert [room.area for room in rooms_of(found, storey)] == pytest.approx([12.0, 9.0], abs=0.4)


def test_a_stroke_closes_a_window_that_no_section_shows() -> None:
    parts = [part for part in two_rooms(DOOR) if part.bounds[0, 1] > -0.1]  # without the lower outer wall
    found, storey = house(parts)
    with pytest.raises(ConfigError, match=r"room 0.*open to the outside"):
        rooms_of(found, storey)
    closed = Storey(0, storey.extent, ROOMS, DOORS, walls=[(-0.3, 0.0, 7.5, 0.0)])
    assert [room.area for room in rooms_of(found, closed)] == pytest.approx([12.0, 9.0], abs=0.4)


def test_a_door_that_is_not_drawn_leaves_one_room_with_two_seeds() -> None:
    found, storey = house(two_rooms(DOOR))
    with pytest.raises(ConfigError, match=r"room 1.*in another room"):
        rooms_of(found, Storey(0, storey.extent, ROOMS))


def test_what_stands_in_a_box_that_is_ignored_is_no_wall() -> None:
    found, storey = house(two_rooms(DOOR))
    one = Storey(0, storey.extent, ROOMS[:1], ignore=[(3.9, 0.05, 4.3, 2.95)])
    assert rooms_of(found, one)[0].area == pytest.approx(21.6, abs=0.5)


def test_a_plan_is_compared_room_by_room_and_door_by_door() -> None:
    found, storey = house(two_rooms(DOOR, window(2.1, 2.8)))
    assert compare(Truth([storey]), [found], [planned(found)]).row == ["2 of 2", "2", "0.99", "1 of 1", "1"]
    one, _ = house(two_rooms())  # the door is walled up: the plan has a cut, which finds none
    assert compare(Truth([storey]), [found], [planned(one)]).row[3:] == ["0 of 1", "0"]


def test_a_storey_of_another_size_or_without_a_plan_has_nothing_that_is_found() -> None:
    found, storey = house(two_rooms(DOOR))
    nothing = ["0 of 2", "0", "0.00", "0 of 1", "0"]
    assert compare(Truth([storey]), [found], []).row == nothing
    larger = replace(found, walls=replace(found.walls, vertices=found.walls.vertices * 1.5))
    assert compare(Truth([storey]), [larger], [planned(larger)]).row == nothing


def test_all_is_found_or_not() -> None:
    assert Found(2, 2, 2, 1, 1, 1, 1.9).is_whole
    assert not (Found(2, 2, 2, 1, 1, 1, 1.9) + Found(1, 1, 2)).is_whole


def test_a_truth_is_read_as_it_was_written_and_damage_is_named(tmp_path: Path) -> None:
    truth = Truth([Storey(1, (8.0, 6.0), ROOMS, DOORS, [(0, 0, 1, 0)], [(1, 0, 2, 0)], [(3, 3, 4, 4)], [1.2])])
    save("house", truth, tmp_path)
    assert load("house", tmp_path) == truth
    assert load("other", tmp_path) is None
    (tmp_path / "bad.json").write_text('{"storeys": [{"level": 0}]}')
    with pytest.raises(ConfigError, match=r"bad.json.*extent"):
        load("bad", tmp_path)


def test_each_truth_belongs_to_an_interior_of_the_list() -> None:
    interiors = {file.name for file in load_manifest() if file.interior}
    names = {path.stem for path in TRUTHS.glob("*.json")}
    assert names <= interiors
    assert all(load(name) for name in names)


def test_a_hall_around_a_room_is_without_it() -> None:
    found, _ = house(shell((0.0, 0.0, 8.0, 8.0)) + shell((3.0, 3.0, 5.0, 5.0)))
    hall, core = rooms_of(found, Storey(0, extent_of(found), [Room((1.0, 1.0)), Room((4.0, 4.0))]))
    assert core.area == pytest.approx(4.0, abs=0.3)
    assert hall.area == pytest.approx(60.0, abs=0.5)
