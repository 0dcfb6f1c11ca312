"""Worlds on disk: the same as made, whatever happens to their files."""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.config.dynamics import PeopleConfig
from houseexpo.pseudoslam.worlds import cache as cache_module
from houseexpo.pseudoslam.worlds import prepare as prepare_module
from houseexpo.pseudoslam.worlds import shards as shards_module
from houseexpo.pseudoslam.worlds import store as store_module
from houseexpo.pseudoslam.worlds.cache import WorldCache, world_for
from houseexpo.pseudoslam.worlds.prepare import prepare
from houseexpo.pseudoslam.worlds.records import RecordError, decode_world, encode_world
from houseexpo.pseudoslam.worlds.shards import Shard, ShardError, write_shard
from houseexpo.pseudoslam.worlds.store import WorldStore, store_folder
from houseexpo.pseudoslam.worlds.world import World
from tests.builders.vectors import HUTS, assert_same_step, hut, native

COARSE = SimulatorConfig(pixels_per_metre=10.0)


@pytest.fixture
def plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data set of three huts, and a cache of its own."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "huts.jsonl"
    file.write_bytes(b"\n".join(map(encode, HUTS)))
    return file


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The plans of which worlds were made, not read."""
    ids: list[str] = []
    true = cache_module.make_world

    def watched(plan: Any, *rest: Any) -> World:
        ids.append(plan.id)
        return true(plan, *rest)

    monkeypatch.setattr(cache_module, "make_world", watched)
    return ids


def assert_same_world(one: World, other: World) -> None:
    assert (one.plan_id, one.frame, one.observable_cells) == (other.plan_id, other.frame, other.observable_cells)
    for name in ("occupied", "traversable", "observable"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert getattr(one, name).dtype == np.uint8
        assert not getattr(one, name).flags.writeable


def files() -> list[Path]:
    return sorted(store_folder(COARSE).glob("*.worlds"))


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


def test_what_waits_is_written_when_nobody_needs_the_store_any_more(plans: Path) -> None:
    one = WorldCache(plans, COARSE)
    one[1]
    assert not files()
    one._stored[1].close()  # as at the end of a program
    assert [len(Shard(file)) for file in files()] == [1]


def test_others_find_it_while_both_go_on(plans: Path, made: list[str]) -> None:
    one, other = WorldCache(plans, COARSE), WorldCache(plans, COARSE)
    one[0]
    one._stored[1].flush()
    other[0]
    assert made == ["small"]


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
    prepare(open_dataset(plans), COARSE, 1)
    stored = native("Exploration", 3, dataset=plans, config=COARSE)
    plain = native("Exploration", 3, dataset=list(HUTS), config=COARSE)
    assert_same_step(stored.reset(seed=3), plain.reset(seed=3))
    for _ in range(3):
        actions = np.array([0, 1, 0])
        assert_same_step(stored.step(actions), plain.step(actions))


def damaged(data: bytes, how: str) -> bytes:
    if how == "cut off":
        return data[:-10]
    if how == "empty":
        return b""
    if how == "another version":
        return data[:8] + bytes([255]) + data[9:]
    if how == "a world":
        return data[:-10] + bytes([data[-10] ^ 1]) + data[-9:]
    return data[:30] + bytes([data[30] ^ 1]) + data[31:]  # the table


@pytest.mark.parametrize("how", ["cut off", "empty", "another version", "a world", "the table"])
def test_what_is_damaged_is_made_again(plans: Path, made: list[str], how: str) -> None:
    prepare(open_dataset(plans), COARSE, 1)
    (file,) = files()
    file.write_bytes(damaged(file.read_bytes(), how))
    made.clear()
    kept = WorldCache(plans, COARSE)
    for i in range(3):
        assert_same_world(kept[i], world_for(HUTS[i], COARSE))
    assert len(made) - 3 == (1 if how == "a world" else 3)  # three are this test's own
    kept._stored[1].flush()
    made.clear()
    WorldCache(plans, COARSE)[2]
    assert made == []


def test_a_full_disk_leaves_worlds_in_memory(
    plans: Path, made: list[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(store_module, "_PENDING", 1)
    monkeypatch.setattr(shards_module, "write_whole", full_disk)
    monkeypatch.setattr(cache_module, "MAX_OPEN", 1)
    kept = WorldCache(plans, COARSE)
    for i in (0, 1, 2, 0, 1, 2):
        assert_same_world(kept[i], world_for(HUTS[i], COARSE))
    assert len(made) == 3 + 6  # six are this test's own
    assert len([record for record in caplog.records if "not kept on disk" in record.message]) == 1


def full_disk(file: Path, data: bytes) -> None:
    raise OSError(errno.ENOSPC, "No space left on device", str(file))


def test_preparing_on_a_full_disk_says_so(plans: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shards_module, "write_whole", full_disk)
    with pytest.raises(
        ConfigError, match=r"3 worlds, some \d+ MB at once, cannot be written \(No space left on device"
    ):
        prepare(open_dataset(plans), COARSE, 1)


def test_without_a_cache_folder_it_goes_on(
    plans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    found = open_dataset(plans)
    (tmp_path / "file").touch()
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "file" / "below"))
    kept = WorldCache(found, COARSE)
    assert_same_world(kept[0], world_for(HUTS[0], COARSE))
    kept._stored[1].flush()
    assert "worlds are not kept" in caplog.text
    with pytest.raises(ConfigError, match="HOUSEEXPO_CACHE"):
        prepare(found, COARSE, 1)


def test_preparing_goes_on_where_it_was(plans: Path, made: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prepare_module, "_BATCH", 1)
    found = open_dataset(plans)
    first = prepare(found[:2], COARSE, 1)
    assert (first.known, first.made, first.refused, made) == (0, 2, (), ["small", "middle"])
    second = prepare(found, COARSE, 1)
    assert (second.known, second.made, made[2:]) == (2, 1, ["large"])
    assert second.size == sum(file.stat().st_size for file in files()) > 0
    assert len(files()) == 3


def test_a_plan_that_has_no_world_is_named(plans: Path) -> None:
    done = prepare(open_dataset(plans), replace(COARSE, robot=RobotConfig(radius_m=2.0)), 1)
    assert done.made == 2
    assert len(done.refused) == 1
    assert "fits nowhere in plan 'small'" in done.refused[0]


def test_many_small_files_become_one(plans: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "_FILES", 4)
    store = WorldStore(store_folder(COARSE), 10.0)
    other = WorldStore(store_folder(COARSE), 10.0)
    records = {hashlib.sha256(bytes([i])).digest()[:20]: encode_world(world_for(HUTS[i % 3], COARSE)) for i in range(9)}
    for key, record in records.items():
        store.put(key, record)
        store.flush()
        assert key in other
    assert 1 <= len(files()) <= 4
    for reader in (store, other, WorldStore(store_folder(COARSE), 10.0)):
        assert len(reader) == 9
        for i, key in enumerate(records):
            found = reader.get(key)
            assert found is not None
            assert found.plan_id == HUTS[i % 3].id


def test_a_shard_holds_what_was_written(tmp_path: Path) -> None:
    records = {os.urandom(20): os.urandom(n) for n in (0, 1, 1000)}
    write_shard(tmp_path / "one", records)
    shard = Shard(tmp_path / "one")
    assert {key: shard.get(key) for key in shard.keys()} == records  # noqa: SIM118  # it is no dictionary
    assert shard.get(bytes(20)) is None
    with pytest.raises(ShardError, match="cannot be read"):
        Shard(tmp_path / "none")


def test_how_worlds_are_made_has_not_changed(published_lines: list[bytes]) -> None:
    """Where it has, ``records.WORLDS`` needs another number: what others have kept would be wrong."""
    from houseexpo.floorplan import decode

    found = hashlib.sha256()
    for line in published_lines[:12]:
        world = world_for(decode(line), SimulatorConfig(16.0))
        for raster in (world.occupied, world.traversable, world.observable):
            found.update(repr(raster.shape).encode() + raster.tobytes())
    assert found.hexdigest()[:16] == "3dc9a0396394fe9a"
