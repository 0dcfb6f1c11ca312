from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from houseexpo import disk_cache, open_dataset
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from houseexpo.processes import THREADS


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    (tmp_path / "street").mkdir()
    for side in (2, 3, 4):
        plan = FloorPlan(f"house_{side}", [(0, 0), (0, side), (side, side), (side, 0)], 1, {})
        (tmp_path / "street" / f"{plan.id}.json").write_bytes(encode(plan))
    return tmp_path / "street"


def threads(plan: FloorPlan) -> list[str | None]:
    return [os.environ.get(name) for name in THREADS]


def area(plan: FloorPlan) -> float:
    return plan.area


def test_workers_measure_what_one_process_does(folder):
    plans = open_dataset(folder)
    assert (
        plans.measure_cached("area, alone", area)
        == plans.measure_cached("area, together", area, workers=2)
        == [4.0, 9.0, 16.0]
    )


def test_workers_compute_with_one_thread_each(folder, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    found = open_dataset(folder).measure_cached("threads", threads, workers=2)
    assert found == [["1"] * len(THREADS)] * 3
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def forgets(plan: FloorPlan) -> float:
    pytest.fail("it was measured before")


def file_of(folder: Path) -> Path:
    (found,) = (folder.parent / "cache").glob("values-*.sqlite")
    return found


def test_what_was_measured_is_kept(folder):
    open_dataset(folder).measure_cached("area", area)
    assert open_dataset(folder).measure_cached("area", forgets) == [4.0, 9.0, 16.0]


@pytest.mark.parametrize("write_s", [2.0, 0.0])
def test_a_file_that_another_process_holds_is_left_alone(folder, monkeypatch, caplog, write_s):
    open_dataset(folder).measure_cached("area", area)
    monkeypatch.setattr(disk_cache, "_TIMEOUT_S", 0.1)
    monkeypatch.setattr(disk_cache, "_WRITE_S", write_s)
    with closing(sqlite3.connect(file_of(folder))) as other:
        other.execute("BEGIN EXCLUSIVE")
        assert open_dataset(folder).measure_cached("area", area) == [4.0, 9.0, 16.0]
    assert "database is locked" in caplog.text
    assert open_dataset(folder).measure_cached("area", forgets) == [4.0, 9.0, 16.0]


def test_a_file_that_cannot_be_written_keeps_what_it_has(folder, monkeypatch):
    open_dataset(folder).measure_cached("area", area)
    monkeypatch.setattr(disk_cache, "_TIMEOUT_S", 0.1)
    monkeypatch.setattr(disk_cache, "_WRITE_S", 0.0)
    with closing(sqlite3.connect(file_of(folder))) as other:
        other.execute("BEGIN IMMEDIATE")  # others may read, and not write
        assert open_dataset(folder).measure_cached("length", lambda plan: plan.area**0.5) == [2.0, 3.0, 4.0]
    assert open_dataset(folder).measure_cached("area", forgets) == [4.0, 9.0, 16.0]
