"""The store of worlds where something goes wrong: damage, a full disk, no cache folder, an unfinished run."""

from __future__ import annotations

import errno
import hashlib
import os
from dataclasses import replace
from pathlib import Path

import pytest

from houseexpo import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.worlds import cache as cache_module
from houseexpo.pseudoslam.worlds import prepare as prepare_module
from houseexpo.pseudoslam.worlds import store as store_module
from houseexpo.pseudoslam.worlds.cache import WorldCache, world_for
from houseexpo.pseudoslam.worlds.prepare import prepare_worlds
from houseexpo.pseudoslam.worlds.store import Shard, ShardError, WorldStore, encode_world, store_folder, write_shard
from tests.builders.simulations import COARSE, HUTS, assert_same_world, files


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
    prepare_worlds(open_dataset(plans), COARSE, 1)
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
    monkeypatch.setattr(store_module, "write_atomically", full_disk)
    monkeypatch.setattr(cache_module, "MAX_OPEN", 1)
    kept = WorldCache(plans, COARSE)
    for i in (0, 1, 2, 0, 1, 2):
        assert_same_world(kept[i], world_for(HUTS[i], COARSE))
    assert len(made) == 3 + 6  # six are this test's own
    assert len([record for record in caplog.records if "cannot be stored on disk" in record.message]) == 1


def full_disk(file: Path, data: bytes) -> None:
    raise OSError(errno.ENOSPC, "No space left on device", str(file))


def test_preparing_on_a_full_disk_says_so(plans: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "write_atomically", full_disk)
    with pytest.raises(
        ConfigError, match=r"3 worlds, some \d+ MB at once, cannot be written \(No space left on device"
    ):
        prepare_worlds(open_dataset(plans), COARSE, 1)


def test_without_a_cache_folder_it_goes_on(
    plans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    found = open_dataset(plans)
    (tmp_path / "file").touch()
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "file" / "below"))
    kept = WorldCache(found, COARSE)
    assert_same_world(kept[0], world_for(HUTS[0], COARSE))
    kept._stored[1].flush()
    assert "worlds cannot be stored on disk" in caplog.text
    with pytest.raises(ConfigError, match="HOUSEEXPO_CACHE"):
        prepare_worlds(found, COARSE, 1)


def test_preparing_goes_on_where_it_was(plans: Path, made: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prepare_module, "_BATCH", 1)
    found = open_dataset(plans)
    first = prepare_worlds(found[:2], COARSE, 1)
    assert (first.known, first.made, first.refused, made) == (0, 2, (), ["small", "middle"])
    second = prepare_worlds(found, COARSE, 1)
    assert (second.known, second.made, made[2:]) == (2, 1, ["large"])
    assert second.size == sum(file.stat().st_size for file in files()) > 0
    assert len(files()) == 3


def test_a_plan_that_has_no_world_is_named(plans: Path) -> None:
    done = prepare_worlds(open_dataset(plans), replace(COARSE, robot=RobotConfig(radius_m=2.0)), 1)
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
    """Where it has, ``store.WORLDS`` needs another number: what others have kept would be wrong."""
    from houseexpo.floorplan import decode

    found = hashlib.sha256()
    for line in published_lines[:12]:
        world = world_for(decode(line), SimulatorConfig(16.0))
        for raster in (world.occupied, world.traversable, world.observable):
            found.update(repr(raster.shape).encode() + raster.tobytes())
    assert found.hexdigest()[:16] == "3dc9a0396394fe9a"
