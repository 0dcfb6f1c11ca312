"""Worlds on disk: the same as made, whatever happens to their files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from houseexpo import open_dataset
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.worlds.cache import WorldCache, prepare_worlds, world_for
from houseexpo.pseudoslam.worlds.store import RecordError, decode_world, encode_world
from tests.builders.simulations import COARSE, HUTS, assert_same_step, assert_same_world, hut, native


def test_a_world_read_is_the_world_that_was_made() -> None:
    for plan in HUTS:
        world = world_for(plan, COARSE)
        assert_same_world(decode_world(encode_world(world), 10.0), world)


@pytest.mark.parametrize("cut", [0, 5, 33, 40, -1])
def test_bytes_that_are_no_world_are_refused(cut: int) -> None:
    data = encode_world(world_for(HUTS[0], COARSE))
    with pytest.raises(RecordError):
        decode_world(data[:cut], 10.0)
    with pytest.raises(RecordError, match="a grid of 4294967295 x 4294967295 cells"):
        decode_world(b"\xff" * 8 + data[8:], 10.0)


def test_what_is_asked_for_once_is_found_by_the_next(plans: Path, made: list[str]) -> None:
    first = WorldCache(plans, COARSE)
    kept = [first[i] for i in range(3)]
    assert made == ["small", "middle", "large"]
    first._stored[1].flush()
    second = WorldCache(plans, COARSE)
    for i, world in enumerate(kept):
        assert_same_world(second[i], world)
        assert_same_world(second[i], world_for(HUTS[i], COARSE))
    assert made == ["small", "middle", "large"] * 2  # the second time by this test alone


def test_other_sizes_and_other_plans_are_other_worlds(plans: Path, made: list[str], tmp_path: Path) -> None:
    kept = WorldCache(plans, COARSE)
    kept[0]
    kept._stored[1].flush()
    robot, laser = RobotConfig(radius_m=0.4), LaserConfig(range_m=1.0)
    for config in (SimulatorConfig(11.0), replace(COARSE, robot=robot), replace(COARSE, laser=laser)):
        assert_same_world(WorldCache(plans, config)[0], world_for(HUTS[0], config))
    changed = tmp_path / "changed.jsonl"
    changed.write_bytes(encode(hut("small", 3.1)))
    assert_same_world(WorldCache(changed, COARSE)[0], world_for(hut("small", 3.1), COARSE))
    made.clear()
    WorldCache(plans, replace(COARSE, max_steps=7))[0]
    assert made == []


def test_what_moves_is_not_kept_and_the_rest_is(plans: Path, made: list[str]) -> None:
    config = replace(COARSE, people=PeopleConfig(2))
    kept = WorldCache(plans, config)
    found, fresh = kept[1], world_for(HUTS[1], config)
    np.testing.assert_array_equal(found.flow.toward, fresh.flow.toward)
    kept._stored[1].flush()
    made.clear()
    assert_same_world(WorldCache(plans, COARSE)[1], found)
    assert made == []


def test_episodes_are_the_same_with_and_without(plans: Path) -> None:
    prepare_worlds(open_dataset(plans), COARSE, 1)
    stored = native("Exploration", 3, dataset=plans, config=COARSE)
    plain = native("Exploration", 3, dataset=list(HUTS), config=COARSE)
    assert_same_step(stored.reset(seed=3), plain.reset(seed=3))
    for _ in range(3):
        actions = np.array([0, 1, 0])
        assert_same_step(stored.step(actions), plain.step(actions))
