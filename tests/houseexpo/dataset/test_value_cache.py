from __future__ import annotations

import os
from pathlib import Path

import pytest

from houseexpo import DatasetError, open_dataset
from houseexpo.dataset.store.cache import VERSION
from houseexpo.files import cache_folder
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from tests.builders.plan_files import houses, pack


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    (tmp_path / "street").mkdir()
    for side in (2, 3, 4):
        plan = FloorPlan(f"house_{side}", [(0, 0), (0, side), (side, side), (side, 0)], 1, {})
        (tmp_path / "street" / f"{plan.id}.json").write_bytes(encode(plan))
    return tmp_path / "street"


def area(plan: FloorPlan) -> float:
    return plan.area


def test_workers_measure_what_one_process_does(folder):
    plans = open_dataset(folder)
    assert (
        plans.measure_cached("area, alone", area)
        == plans.measure_cached("area, together", area, workers=2)
        == [4.0, 9.0, 16.0]
    )


# The cache of a data set: damaged, left half made, or of a file that changed behind its time.


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))


def _store() -> Path:
    (found,) = cache_folder("stores", VERSION).iterdir()
    return found


def test_a_block_that_rotted_is_named_and_made_again(tmp_path: Path) -> None:
    path = pack(tmp_path, "jsonl", houses(70))
    expected = list(open_dataset(path))
    file = _store() / "plans.arrow"
    data = bytearray(file.read_bytes())
    data[300:800] = b"\xff" * 500
    file.write_bytes(data)
    rotten = open_dataset(path)
    with pytest.raises(DatasetError, match="open the data set again"):
        rotten[0]
    assert list(open_dataset(path)) == expected


def test_a_change_of_the_same_size_and_time_is_seen(tmp_path: Path) -> None:
    path = pack(tmp_path, "jsonl", houses(3))
    before, ids = path.stat(), open_dataset(path).ids
    path.write_bytes(path.read_bytes().replace(ids[0].encode(), b"x" * len(ids[0])))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert "x" * len(ids[0]) in open_dataset(path).ids


def test_what_a_killed_process_left_is_swept_and_what_is_being_made_is_not(tmp_path: Path) -> None:
    stores = cache_folder("stores", VERSION)
    for name, age in {"old": 7200, "new": 10}.items():
        folder = stores / f".partial-{name}"
        folder.mkdir()
        (folder / "index.arrow").write_bytes(b"half")
        for entry in (folder / "index.arrow", folder):
            os.utime(entry, (entry.stat().st_mtime - age,) * 2)
    open_dataset(pack(tmp_path, "jsonl", houses(3)))
    assert [entry.name for entry in stores.glob(".partial-*")] == [".partial-new"]
