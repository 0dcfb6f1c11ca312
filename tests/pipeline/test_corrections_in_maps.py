"""Corrections of robots' maps: the counts, the confidences and the quality are those of the corrected plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from houseexpo.corrections import Override
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from pipeline.algorithm import plan_largest_building
from pipeline.batch.job import level_rng
from pipeline.config import PipelineConfig
from pipeline.sources import find, reader
from pipeline.values import Level
from tests.pipeline.sources.test_occupancy_map import FREE, UNSEEN, WALL, saved, two_rooms


def level_of(folder: Path) -> Level:
    """Two rooms and a third one behind a door, the far end of which nobody saw."""
    shades = np.hstack([two_rooms(), np.full((80, 80), UNSEEN, np.uint8)])
    shades[8:72, 156:220] = WALL
    shades[10:70, 158:220] = FREE
    shades[32:50, 154:158] = FREE
    (item,) = find(str(saved(folder, shades)))
    (level,) = reader("occupancy_map").read(item)
    assert isinstance(level, Level)
    return level


def planned(level: Level, said: Override = Override()) -> FloorPlan:  # noqa: B008  # frozen
    corrected = replace(level, corrections=said.corrections)
    return plan_largest_building(corrected, PipelineConfig(), level_rng(level, 0))


def test_the_signs_of_a_map_follow_the_corrected_rooms(tmp_path: Path) -> None:
    level = level_of(tmp_path)
    before = planned(level)
    assert before.quality is not None
    assert before.quality.grounds["half_seen_rooms"] > 0
    fan = max(before.rooms, key=lambda room: float(room.polygon.centroid.x))
    place = source_points_from_plan(before.frame, [fan.polygon.representative_point().coords[0]])[0]
    after = planned(level, Override(no_room=place.tolist()))
    assert len(after.rooms) == len(before.rooms) - 1
    assert after.room_num == before.room_num - 1
    assert after.quality is not None
    assert after.quality.grounds["half_seen_rooms"] == 0
    assert after.quality.grounds["beyond_rooms"] > before.quality.grounds["beyond_rooms"]
    assert (after.provenance or {})["corrections"][0]["outcome"] == "done"


def test_a_name_or_a_word_without_effect_changes_no_sign(tmp_path: Path) -> None:
    level = level_of(tmp_path)
    before = planned(level)
    assert before.quality is not None
    place = source_points_from_plan(before.frame, [before.rooms[0].polygon.representative_point().coords[0]])[0]
    for said in (Override(label=[*place.tolist(), "Kitchen"]), Override(door=[[500, 1], [500, 2]])):  # type: ignore[arg-type]
        after = planned(level, said)
        assert after.quality == before.quality


def test_what_a_person_says_of_a_map_is_certain(tmp_path: Path) -> None:
    level = level_of(tmp_path)
    before = planned(level)
    door = before.doors[0]
    ends = source_points_from_plan(before.frame, door.segment)
    moved = (ends + np.array([0.0, 1.1])).tolist()
    after = planned(level, Override(door=moved))
    new = [each for each in after.doors if each.confidence == 1.0]
    assert [each.kind for each in new] == ["door"]
    assert new[0].width == pytest.approx(door.width, abs=0.15)
    told = planned(level, Override(room=[2.5, 2.0])).rooms
    assert sorted(room.confidence == 1.0 for room in told) == [False, False, True]
