"""The store of worlds where something goes wrong: damage, a full disk, no cache folder, an unfinished run."""

from __future__ import annotations

import hashlib
import sqlite3
from dataclasses import replace
from pathlib import Path

import pytest

from houseexpo import disk_cache, open_dataset
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.worlds import cache as cache_module
from houseexpo.pseudoslam.worlds.cache import WorldCache, prepare_worlds, world_for
from houseexpo.pseudoslam.worlds.store import world_file
from tests.builders.simulations import COARSE, HUTS, assert_same_world


def test_a_full_disk_leaves_worlds_in_memory(
    plans: Path, made: list[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(disk_cache, "_WRITE_S", 0.0)
    monkeypatch.setattr(disk_cache, "_insert", full_disk)
    monkeypatch.setattr(cache_module, "MAX_OPEN", 1)
    kept = WorldCache(plans, COARSE)
    for i in (0, 1, 2, 0, 1, 2):
        assert_same_world(kept[i], world_for(HUTS[i], COARSE))
    assert len(made) == 3 + 6  # six are this test's own
    assert len([record for record in caplog.records if "its entries stay in memory" in record.message]) == 1


def full_disk(*_: object) -> None:
    raise sqlite3.OperationalError("database or disk is full")


def test_preparing_on_a_full_disk_says_so(plans: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_cache, "_insert", full_disk)
    with pytest.raises(
        ConfigError, match=r"3 worlds, some \d+ MB at once, cannot be written \(database or disk is full"
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
    monkeypatch.setattr(cache_module, "_BATCH", 1)
    found = open_dataset(plans)
    first = prepare_worlds(found[:2], COARSE, 1)
    assert (first.known, first.made, first.refused, made) == (0, 2, (), ["small", "middle"])
    second = prepare_worlds(found, COARSE, 1)
    assert (second.known, second.made, made[2:]) == (2, 1, ["large"])
    assert second.size == world_file().stat().st_size > 0


def test_a_plan_that_has_no_world_is_named(plans: Path) -> None:
    done = prepare_worlds(open_dataset(plans), replace(COARSE, robot=RobotConfig(radius_m=2.0)), 1)
    assert done.made == 2
    assert len(done.refused) == 1
    assert "fits nowhere in plan 'small'" in done.refused[0]


def test_how_worlds_are_made_has_not_changed(published_lines: list[bytes]) -> None:
    """Where it has, ``store._WORLDS_FILE`` needs another number: what others have kept would be wrong."""
    from houseexpo.floorplan import decode

    found = hashlib.sha256()
    for line in published_lines[:12]:
        world = world_for(decode(line), SimulatorConfig(16.0))
        for raster in (world.occupied, world.traversable, world.observable):
            found.update(repr(raster.shape).encode() + raster.tobytes())
    assert found.hexdigest()[:16] == "3dc9a0396394fe9a"
