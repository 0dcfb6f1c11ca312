from __future__ import annotations

import os
from pathlib import Path

import pytest

from houseexpo import open_dataset
from houseexpo.dataset.store import derived as module
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from houseexpo.workers import THREADS, single_threaded


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
    assert plans.derived("area, alone", area) == plans.derived("area, together", area, workers=2) == [4.0, 9.0, 16.0]


def test_workers_compute_with_one_thread_each(folder, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    found = open_dataset(folder).derived("threads", threads, workers=2)
    assert found == [["1"] * len(THREADS)] * 3
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_the_environment_comes_back_after_an_error(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    with pytest.raises(ZeroDivisionError), single_threaded():
        raise ZeroDivisionError
    assert os.environ["OMP_NUM_THREADS"] == "7"


def test_the_bar_names_the_data_set(folder, monkeypatch):
    said = []

    def noted(items, what, total):
        said.append((what, total))
        yield from items

    monkeypatch.setattr(module, "watched", noted)
    open_dataset(folder).derived("a key that is nobody's business, 3", area)
    assert said == [("measuring street", 3)]
