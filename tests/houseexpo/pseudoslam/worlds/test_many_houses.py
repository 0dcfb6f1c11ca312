"""Thousands of houses: their rasters stay in memory as bits, up to a limit, and are made anew beyond it."""

from __future__ import annotations

import gzip
import itertools
import time

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.floorplan import decode
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.worlds import cache as worlds
from houseexpo.pseudoslam.worlds.cache import WorldCache, _Packed, world_for
from houseexpo.pseudoslam.worlds.world import World
from tests.builders.shared import DATA, needs_shared
from tests.builders.simulations import HUTS, assert_same_step, native

COARSE = SimulatorConfig(pixels_per_metre=16.0)
NUMBER = 10_000


def rasters(world: World) -> list[np.ndarray]:
    return [world.occupied, world.traversable, world.observable, world.flow.toward, world.flow.spots]


def test_what_is_kept_is_what_was_made() -> None:
    config = SimulatorConfig(pixels_per_metre=16.0, people=PeopleConfig(2))
    kept = WorldCache(HUTS, config)
    for _ in range(2):
        for i, plan in enumerate(HUTS):
            found, fresh = kept[i], world_for(plan, config)
            assert (found.plan_id, found.frame) == (fresh.plan_id, fresh.frame)
            for one, other in zip(rasters(found), rasters(fresh), strict=True):
                np.testing.assert_array_equal(one, other)
                assert one.dtype == other.dtype
            assert not found.occupied.flags.writeable


def test_beyond_the_limit_houses_are_paged_and_stay_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    many = native("Exploration", 4, dataset=HUTS, config=COARSE)
    monkeypatch.setattr(worlds, "MAX_KEPT", 1500)  # bytes: less than two of them
    monkeypatch.setattr(worlds, "MAX_OPEN", 1)
    paged = WorldCache(HUTS, COARSE)
    for i in (0, 1, 2, 1, 0, 2):
        for one, other in zip(rasters(paged[i]), rasters(world_for(HUTS[i], COARSE)), strict=True):
            np.testing.assert_array_equal(one, other)
        assert len(paged._kept) <= 2
        assert paged._kept.size == sum(_Packed(world_for(HUTS[j], COARSE)).size for j in paged._kept)
        assert list(paged._open) == [i]
    few = native("Exploration", 4, dataset=HUTS, config=COARSE)
    for _ in range(5):
        assert_same_step(few.reset(seed=1), many.reset(seed=1))
        actions = np.array([0, 1, 2, 0])
        assert_same_step(few.step(actions), many.step(actions))


def test_what_was_used_last_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []
    for i in range(3):
        one = WorldCache(HUTS, COARSE)
        one[i]
        sizes.append(one._kept.size)
    monkeypatch.setattr(worlds, "MAX_KEPT", sum(sizes) - 1)
    kept = WorldCache(HUTS, COARSE)
    for i in (0, 1, 0, 2):
        kept[i]
    assert list(kept._kept) == [0, 2]


def test_a_house_used_again_is_not_unpacked_again() -> None:
    kept = WorldCache(HUTS, COARSE)
    first, other = kept[0], kept[1]
    assert kept[0] is first
    assert kept[1] is other
    held = [(*rasters(world)[:3], world.unknown, world.nearest) for world in (first, other)]
    assert kept._open.size == sum(array.nbytes for arrays in held for array in arrays)


def test_a_house_that_cannot_be_used_leaves_nothing_behind() -> None:
    kept = WorldCache(HUTS, SimulatorConfig(pixels_per_metre=16.0, people=PeopleConfig(2, radius_m=2.5)))
    with pytest.raises(ConfigError, match=r"people\.radius_m"):
        kept[0]
    assert (len(kept._kept), kept._kept.size, len(kept._open)) == (0, 0, 0)
    assert kept[2].plan_id == "large"


@needs_shared
@pytest.mark.slow
def test_ten_thousand_houses_fit_in_memory(record_property) -> None:
    """At 16 px/m, with all that Python needs to hold them."""
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        plans = [decode(line) for line in itertools.islice(stream, NUMBER)]
    kept = WorldCache(plans, COARSE)
    kept[0]
    before, began = resident_bytes(), time.process_time()
    for i in range(len(plans)):
        kept[i]
    seconds, grown = time.process_time() - began, resident_bytes() - before
    record_property("bytes a house", kept._kept.size / NUMBER)
    record_property("resident bytes a house", grown / NUMBER)
    record_property("milliseconds a house", seconds / NUMBER * 1e3)
    assert len(kept._kept) == NUMBER  # none was dropped
    assert kept._kept.size < worlds.MAX_KEPT / 2
    assert grown < worlds.MAX_KEPT


def resident_bytes() -> int:
    """What the process holds in memory."""
    import psutil

    return int(psutil.Process().memory_info().rss)
