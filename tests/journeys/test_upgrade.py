"""Journey 12: what the last version wrote (plans, corrections, cache, a result) works, by the page's commands.

``last_version.zip`` was written by commit 869715da, in a folder ``/home/anna/houses``::

    houseexpo build "procedural:3?style=test" --seed 3 --out plans/homes  # which this version no longer makes
    houseexpo build houses/bungalow.obj --overrides corrections.toml --out plans/bungalow
    houseexpo split plans/homes --train 0.4 --test 0.6
    cat plans/homes/json/*.json > homes.jsonl       # opened in Python, so that the cache has an index of it
    houseexpo benchmark run --policy wall --track quality --dataset plans/homes --plans 2 --out results/wall.json
"""

from __future__ import annotations

import shlex
import zipfile
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from houseexpo import load_plan, open_dataset
from tests.builders.commands import call
from tests.journeys.pages import commands

IDS = ["7611609110d899e34e21649261e280c9", "96c8049e2e3999baf0482aa14ae19c4e", "ca0889bb7932a0938565452fa7bddf6d"]


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the user, with the cache of the last version."""
    with zipfile.ZipFile(Path(__file__).with_name("last_version.zip")) as kept:
        for name in kept.namelist():
            if not name.endswith("/"):
                (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
                (tmp_path / name).write_bytes(kept.read(name).replace(b"/home/anna/houses", bytes(tmp_path)))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    return tmp_path


def test_a_data_set_of_the_last_version_opens(home: Path) -> None:
    plans = open_dataset("plans/homes")
    assert plans.ids == IDS
    rooms = [len(plan.rooms) for plan in plans]
    assert plans.column("rooms", compute=False) == plans.column("rooms") == rooms == [2, 4, 3]
    assert plans.to_arrow()["rooms"].to_pylist() == rooms
    assert plans.select(rooms=(3, None)).ids == IDS[1:]
    assert [len(plans.split(name)) for name in ("train", "test")] == [1, 2]


def test_the_cache_of_the_last_version_is_used(home: Path) -> None:
    [store] = (home / "cache" / "stores" / "2").iterdir()
    before = {file: file.stat().st_mtime_ns for file in store.iterdir()}
    plans = open_dataset("homes.jsonl")
    assert plans.column("rooms") == [2, 4, 3]
    assert plans[1] == load_plan(f"plans/homes/json/{IDS[1]}.json")
    assert {file: file.stat().st_mtime_ns for file in store.iterdir()} == before


@pytest.mark.slow
def test_the_commands_after_an_upgrade_work(home: Path) -> None:
    plans = {name: open_dataset(f"plans/{name}") for name in ("homes", "bungalow")}
    before = {name: list(each) for name, each in plans.items()}
    for command in commands("docs/installation.md", "houseexpo benchmark compare"):
        call(*shlex.split(command)[1:])
    assert list(open_dataset("plans/homes")) == before["homes"]
    again = open_dataset("plans/bungalow")
    assert {"rooms", "source_rooms", "doors", "cuts"} <= set(pq.read_table(again.path / "index.parquet").column_names)
    [bungalow], [earlier] = again, before["bungalow"]
    assert bungalow.id == earlier.id
    assert abs(bungalow.area - earlier.area) < 0.01 * earlier.area
    assert [room.label for room in bungalow.rooms] == [room.label for room in earlier.rooms]
    assert len(bungalow.rooms) == 2, "the patio is no room, as the corrections say"
    assert any(set(door.rooms) == {0, 1} for door in bungalow.doors), "the bedroom has the door that they draw"
