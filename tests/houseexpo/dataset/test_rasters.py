"""Arrays of one size, and their tensors; a small stand-in plays PyTorch where it is absent."""

from __future__ import annotations

import pickle
import sys
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

from houseexpo import ConfigError, FloorPlan, MissingDependencyError
from houseexpo.dataset.plan_rasters import RasterConfig, rasterise_plan
from houseexpo.torch import PlanDataset
from tests.builders.plan_files import house, houses, pack


def test_small_plans_are_padded_all_round(two_rooms):
    found = rasterise_plan(two_rooms, RasterConfig(size=(50, 90), pixels_per_metre=10))
    assert found.free.shape == found.rooms.shape == found.doors.shape == (50, 90)
    assert found.free.sum() / 100 == pytest.approx(two_rooms.area, rel=0.005)
    rows, cols = np.nonzero(found.free)
    assert (rows.min(), 49 - rows.max()) == (10, 10)
    assert (cols.min(), 89 - cols.max()) in ((9, 10), (10, 9))
    assert set(np.unique(found.rooms[found.free == 1])) <= {-1, 0, 1}
    assert (found.doors == 0).sum() == 8


def test_large_plans_are_shrunk_cropped_or_refused():
    plan = house("long", 20.0)
    shrunk = rasterise_plan(plan, RasterConfig(size=(40, 40), pixels_per_metre=10))
    assert shrunk.frame.pixels_per_metre == 2
    assert shrunk.free.sum() == 40 * 8
    cropped = rasterise_plan(plan, RasterConfig(size=(50, 40), pixels_per_metre=10, fit="crop"))
    assert cropped.free.sum() == 40 * 40
    assert cropped.free.any(axis=0).all()
    with pytest.raises(ConfigError, match=r"'long': 20\.00 x 4\.00 m do not fit"):
        rasterise_plan(plan, RasterConfig(size=(40, 40), fit="refuse"))


def test_rooms_of_published_plans_are_found():
    ring = [(4, 0), (0, 0), (0, 3), (4, 3), (4, 2), (4.1, 2), (4.1, 3), (8, 3), (8, 0), (4.1, 0), (4.1, 1), (4, 1)]
    plan = FloorPlan("two", ring, 2, {})
    assert plan.divided is not plan
    assert plan.divided.divided is plan.divided
    assert plan.graph().number_of_edges() == 1
    assert set(np.unique(plan.door_grid())) == {-1, 0}
    assert set(np.unique(rasterise_plan(plan, RasterConfig(size=(64, 96))).rooms)) == {-1, 0, 1}
    assert set(np.unique(rasterise_plan(plan, RasterConfig(size=(64, 96), find_rooms=False)).rooms)) == {-1}


def test_without_torch_the_message_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(
        MissingDependencyError, match=r"pip install torch.* houseexpo\.dataset\.plan_rasters\.rasterise_plan"
    ):
        PlanDataset(pack(tmp_path, "jsonl", houses(2)))


def test_tensors(tmp_path, monkeypatch):
    if find_spec("torch") is None:
        stand_in = SimpleNamespace(from_numpy=lambda array: array, tensor=np.asarray)
        monkeypatch.setitem(sys.modules, "torch", stand_in)
    data = PlanDataset(pack(tmp_path, "jsonl", houses(3)), RasterConfig(size=(32, 48), pixels_per_metre=4))
    assert len(data) == 3
    item = data[-1]
    assert tuple(item["free"].shape) == (1, 32, 48)
    assert tuple(item["rooms"].shape) == (32, 48)
    assert int(item["index"]) == 2
    assert int(item["free"].sum()) == 4 * 4 * 16
    again = pickle.loads(pickle.dumps(data))  # noqa: S301 - our own bytes
    assert repr(again) == repr(data)
