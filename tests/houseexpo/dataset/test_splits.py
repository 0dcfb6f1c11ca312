"""No house and no copy of one on both sides; the same kinds of houses on each."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pyarrow.parquet as pq
import pytest

from houseexpo import ConfigError, encode, find_duplicates, open_dataset
from houseexpo.dataset.index import index_row, index_table
from houseexpo.dataset.splits import PAPER, inseparable_groups, split_plans, write_split
from houseexpo.dataset.validation import validate_dataset
from houseexpo.floorplan import FloorPlan
from tests.builders.plan_files import pack

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data" / "houseexpo" / "plans_33717.jsonl.gz"
SHARES = {"train": 0.7, "val": 0.1, "test": 0.2}


def ell(name: str, i: int, **more: object) -> FloorPlan:
    """Return an L, unlike every other."""
    w, h, a, b = 4 + (i % 9) * 0.6, 4 + (i // 9) * 0.7, 1 + (i % 4) * 0.3, 1 + (i % 3) * 0.4
    ring = [(0.1, 0.1), (0.1, 0.1 + h), (0.1 + a, 0.1 + h), (0.1 + a, 0.1 + b), (0.1 + w, 0.1 + b), (0.1 + w, 0.1)]
    return FloorPlan(name, np.round(ring, 2), 1 + i % 12, {}, **more)


def mirrored(name: str, plan: FloorPlan) -> FloorPlan:
    ring = plan.verts[::-1] * [-1, 1]
    return replace(plan, id=name, verts=np.round(ring - ring.min(axis=0) + 0.1, 2))


@pytest.fixture(scope="module")
def plans(tmp_path_factory):
    found = [ell(f"p{i:03}", i) for i in range(100)]
    found += [mirrored(f"m{i:03}", ell("x", i)) for i in range(0, 100, 5)]
    found += [replace(ell(f"house_{i}_L{level}", 7 * i + level)) for i in range(9) for level in (0, 1)]
    found += [ell(f"file{i}", 50 + i, provenance={"sha256": "abc"}) for i in range(3)]
    path = pack(tmp_path_factory.mktemp("split"), "jsonl", {plan.id: encode(plan) for plan in found})
    return open_dataset(path)


def test_copies_levels_and_files_stay_together(plans):
    found = split_plans(plans, SHARES, 5)
    part_of = {name: part for part, ids in found.parts.items() for name in ids}
    assert sorted(part_of) == sorted(plans.ids)
    assert all(part_of[f"m{i:03}"] == part_of[f"p{i:03}"] for i in range(0, 100, 5))
    assert all(part_of[f"house_{i}_L0"] == part_of[f"house_{i}_L1"] for i in range(9))
    assert len({part_of[f"file{i}"] for i in range(3)}) == 1
    for duplicate in find_duplicates(plans):
        assert part_of[duplicate.id] == part_of[duplicate.kept_id]
    for name, share in SHARES.items():
        assert len(found.parts[name]) == pytest.approx(share * len(plans), abs=4)
        assert list(found.parts[name]) == sorted(found.parts[name])


def test_kinds_of_houses_are_the_same(plans):
    found = split_plans(plans, {"one": 0.5, "two": 0.5}, 1)
    rooms = [np.mean([plans[name].room_num for name in ids]) for ids in found.parts.values()]
    assert rooms[0] == pytest.approx(rooms[1], abs=0.6)


def test_the_seed_decides(plans):
    assert split_plans(plans, SHARES, 3) == split_plans(plans, SHARES, 3)
    assert split_plans(plans, SHARES, 3).parts != split_plans(plans, SHARES, 4).parts
    assert set(split_plans(plans, PAPER, 0).parts) == {"train", "test"}


@pytest.mark.parametrize("shares", [{"train": 0.7}, {"train": 1.2, "test": -0.2}, {"train": float("nan"), "test": 1.0}])
def test_shares_add_up(plans, shares):
    with pytest.raises(ConfigError, match="add up to 1"):
        split_plans(plans, shares, 0)


def test_a_folder_is_told(tmp_path):
    found = {f"p{i}": ell(f"p{i}", i) for i in range(10)}
    folder = pack(tmp_path, "nested", {name: encode(plan) for name, plan in found.items()})
    (folder / "index.parquet").write_bytes(index_table([index_row(plan) for plan in found.values()]))
    hashes = {
        file.relative_to(folder).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }
    (folder / "manifest.json").write_bytes(msgspec.json.encode({"seed": 1, "files": hashes}))
    write_split(split_plans(open_dataset(folder), SHARES, 2), folder)
    again = open_dataset(folder)
    assert sum(len(again.split(name)) for name in SHARES) == 10
    table = pq.read_table(folder / "index.parquet").to_pylist()
    assert {row["id"] for row in table if row["split"] == "test"} == set(again.split("test").ids)
    assert not [finding for finding in validate_dataset(folder).findings if finding.rule == "manifest"]
    said = msgspec.json.decode((folder / "splits" / "splits.json").read_bytes())
    for name in SHARES:
        data = (folder / "splits" / f"{name}.txt").read_bytes()
        assert said["lists"][name]["sha256"] == hashlib.sha256(data).hexdigest()
    write_split(split_plans(again, PAPER, 2), folder)
    assert set(open_dataset(folder).splits) == {"train", "test"}
    assert not [finding for finding in validate_dataset(folder).findings if finding.rule == "manifest"]


@pytest.mark.slow
def test_the_published_lists_and_copies_among_published_plans():
    if not SHARED.exists():
        pytest.skip("the published plans are not on this machine")
    plans = open_dataset(SHARED)
    assert (len(plans.splits["train"]), len(plans.splits["test"])) == (24_588, 10_538)
    some = plans.sample(1500, 0)
    groups = inseparable_groups(some)
    part_of = {name: g for g, group in enumerate(groups) for name in group}
    for duplicate in find_duplicates(some):
        assert part_of[duplicate.id] == part_of[duplicate.kept_id]
