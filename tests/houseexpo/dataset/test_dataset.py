"""Opening data sets of every packing, and choosing plans from them."""

from __future__ import annotations

import io
import os
import pickle
import time
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from houseexpo import ConfigError, DatasetError, UnknownPlanError, encode, open_dataset
from houseexpo.dataset.index import index_row, index_table
from houseexpo.plan import Navigability, Quality, Room
from tests.builders.plan_files import KINDS, hexed, house, houses, pack


@pytest.fixture
def plans(tmp_path):
    return open_dataset(pack(tmp_path, "jsonl.gz", houses(40)))


@pytest.mark.parametrize("kind", KINDS)
def test_every_packing_gives_the_same(tmp_path, kind):
    members = houses(5)
    path = pack(tmp_path, kind, {**members, "splits/train.txt": f"{hexed(1)}\n{hexed(3)}\n".encode()})
    if kind.startswith("jsonl"):
        path = pack(tmp_path, kind, members)
        (tmp_path / "splits").mkdir()
        (tmp_path / "splits" / "train.txt").write_text(f"{hexed(1)}\n{hexed(3)}\n")
    for _ in range(2):  # the second time from the cache
        found = open_dataset(path)
        assert found.ids == list(members)
        assert [encode(plan) for plan in found] == list(members.values())
        assert found.raw(hexed(2)) == members[hexed(2)]
        assert found.split("train").ids == [hexed(1), hexed(3)]


def test_a_folder_with_plans_and_json_lines_is_refused_even_where_it_was_opened_before(tmp_path):
    path = pack(tmp_path, "folder", houses(1))
    (path / "rejected.jsonl").write_bytes(b"{}")  # a build's, no plans
    assert len(open_dataset(path)) == 1
    lines = pack(path, "jsonl.gz", houses(3))
    with pytest.raises(DatasetError, match=f"found {hexed(0)}.json and plans.jsonl.gz; open {lines} itself"):
        open_dataset(path)
    (path / f"{hexed(0)}.json").unlink()
    with pytest.raises(DatasetError, match=f"found none; open {lines}"):
        open_dataset(path)
    assert len(open_dataset(lines)) == 3


def test_plans_by_number_id_and_slice(plans):
    assert len(plans) == 40
    assert plans[-1].id == hexed(39)
    assert plans[hexed(7)] == plans[7]
    assert plans[5:8].ids == [hexed(i) for i in (5, 6, 7)]
    assert plans[5:8][hexed(6)].id == hexed(6)
    assert hexed(6) in plans[5:8]
    assert hexed(9) not in plans[5:8]
    assert plans[3] in plans
    assert repr(plans[5:8]) == "Dataset('plans.jsonl.gz', 3 of 40 plans)"
    with pytest.raises(IndexError):
        plans[40]
    assert plans[np.int64(3)] == plans[3]
    for several in ([[1, 2]], {1}, 1.5):
        with pytest.raises(TypeError, match="expected a number, an id, a slice"):
            plans[several]
    with pytest.raises(UnknownPlanError, match="no 'nobody'"):
        plans["nobody"]
    with pytest.raises(KeyError):
        plans[5:8][hexed(9)]


def test_selecting(plans):
    assert plans.select(source_rooms=(4, 9)).ids == [hexed(i) for i in range(3, 9)]
    assert plans.select(source_rooms=4).ids == [hexed(3)]
    assert plans.select(area=(None, 14)).ids == [hexed(0), hexed(1)]
    assert plans.select(source_rooms=(38, None), labels={"kitchen"}).ids == [hexed(i) for i in (37, 38, 39)]
    assert len(plans.select(labels={"Gym"})) == 0
    assert plans.select(where=lambda plan: plan.room_num == 2).ids == [hexed(1)]
    assert plans[10:].select(source_rooms=(None, 11)).ids == [hexed(10)]
    with pytest.raises(ConfigError, match="nearest is 'Kitchen'"):
        plans.select(labels={"Kitchn"})
    with pytest.raises(ConfigError, match="from <= to"):
        plans.select(rooms=(9, 4))
    with pytest.raises(ConfigError, match="robot_radius"):
        plans.select(min_connected=0.9)


def test_conditions_that_are_none_are_refused_and_numbers_of_numpy_are_numbers(plans):
    assert plans.select(source_rooms=np.int64(4)).ids == plans.select(source_rooms=4).ids
    as_list = plans.select(source_rooms=[4, None], labels="kitchen")
    assert as_list.ids == plans.select(source_rooms=(4, None), labels={"Kitchen"}).ids
    for rooms in ((2,), (2, 3, 4), "2-4", "24", range(2, 9), (float("nan"), 4), True):
        with pytest.raises(ConfigError, match=r"rooms: expected a number, or \(from, to\)"):
            plans.select(rooms=rooms)
    with pytest.raises(ConfigError, match=r"area: expected \(from, to\), None for an open end; found 50"):
        plans.select(area=50)  # no area is 50 to the last digit
    with pytest.raises(ConfigError, match="min_connected: expected 0 to 1, found 90"):
        plans.select(robot_radius=0.2, min_connected=90)
    for radius in (-0.2, float("nan"), float("inf"), "0.2"):
        with pytest.raises(ConfigError, match="robot_radius: expected metres"):
            plans.select(robot_radius=radius)


def test_rooms_are_those_that_a_plan_has(tmp_path):
    """The source counts one room in each; two rooms are recorded in one plan, and the other records none."""
    rings = [[(x, 0.0), (x, 3.0), (x + 2.0, 3.0), (x + 2.0, 0.0)] for x in (0.0, 2.0)]
    halves = [Room(number, "Bedroom", ring) for number, ring in enumerate(rings)]
    members = {plan.id: encode(plan) for plan in (replace(house("divided"), rooms=halves), house("outline"))}
    plans = open_dataset(pack(tmp_path, "jsonl", members))
    assert plans.column("rooms", compute=False) == [2, None]
    assert plans.column("rooms") == [len(plan.divided.rooms) for plan in plans] == [2, 1]
    assert plans.column("rooms", compute=False) == plans.to_arrow().column("rooms").to_pylist() == [2, 1]
    assert plans.column("source_rooms") == [1, 1]
    assert plans.select(rooms=2).ids == ["divided"]
    assert plans.select(rooms=1).ids == ["outline"]
    assert len(plans.select(source_rooms=1)) == 2


def test_selecting_by_quality(tmp_path):
    judged = [house(f"q{score}", quality=Quality(score)) for score in (0.2, 0.8, 0.95)]
    members = {plan.id: encode(plan) for plan in (*judged, house("published"))}
    plans = open_dataset(pack(tmp_path, "jsonl", members))
    assert plans.column("quality") == [0.2, 0.8, 0.95, None]
    assert plans.select(min_quality=0.8).ids == ["q0.8", "q0.95"]
    assert plans.select(min_quality=0.0).ids == ["q0.2", "q0.8", "q0.95"]
    with pytest.raises(ConfigError, match="min_quality: expected 0 to 1, found 80"):
        plans.select(min_quality=80)


def test_an_index_of_before_there_was_a_quality_still_opens(tmp_path):
    plan = house("a", quality=Quality(0.9))
    path = pack(tmp_path, "nested", {"a": encode(plan)})
    table = pq.read_table(io.BytesIO(index_table([index_row(plan)])))
    pq.write_table(table, path / "index.parquet")
    assert open_dataset(path).column("quality") == [0.9]
    pq.write_table(table.drop_columns(["quality"]), path / "index.parquet")
    assert open_dataset(path).column("quality") == [None]
    pq.write_table(table.drop_columns(["area"]), path / "index.parquet")
    with pytest.raises(DatasetError, match="expected the columns"):
        open_dataset(path)


def test_what_is_not_recorded_is_computed_once_and_kept(tmp_path):
    # two rooms of 2 x 4 m joined by a gap of 0.5 m
    ring = [(0.1, 0.1), (0.1, 4.1), (2.1, 4.1), (2.1, 2.1), (2.2, 2.1), (2.2, 4.1)]
    ring += [(4.2, 4.1), (4.2, 0.1), (2.2, 0.1), (2.2, 1.6), (2.1, 1.6), (2.1, 0.1)]
    narrow = replace(house("narrow"), verts=ring)
    recorded = replace(house("told"), navigability={"0.30": Navigability(2, 0.5, 0.4)})
    plans = open_dataset(pack(tmp_path, "zip", {plan.id: encode(plan) for plan in (narrow, house("wide"), recorded)}))
    assert plans.select(robot_radius=0.2).ids == ["narrow", "wide", "told"]
    assert plans.select(robot_radius=0.3).ids == ["wide"]
    assert plans.select(robot_radius=0.3, min_connected=0.45).ids == ["narrow", "wide", "told"]
    calls = []
    assert plans.measure_cached("area, test", lambda plan: calls.append(plan.id) or plan.area) == [
        p.area for p in plans
    ]
    assert plans.measure_cached("area, test", lambda plan: calls.append(plan.id)) == [p.area for p in plans]
    assert calls == ["narrow", "wide", "told"]
    assert plans.column("navigability")[1]["0.20"]["components"] == 1
    assert plans.column("source_rooms") == [1, 1, 1]
    assert plans.select(doors=0).ids == ["wide", "told"]
    with pytest.raises(ConfigError, match="no 'aera'; the nearest is 'area'"):
        plans.column("aera")
    with pytest.raises(ConfigError, match="no 'xyz'; there are 'id', "):
        plans.column("xyz")


def test_sampling_repeats(plans):
    assert plans.sample(7, 3).ids == plans.sample(7, 3).ids
    assert len(set(plans.sample(40, np.random.default_rng(1)).ids)) == 40
    with pytest.raises(ConfigError, match="0 to 40"):
        plans.sample(41, 0)


def test_lists_are_read_as_they_are(tmp_path):
    path = pack(tmp_path, "jsonl", houses(3))
    (tmp_path / "map_id_test.txt").write_text(f"{hexed(2)}.json\r\n\n{hexed(77)}\n{hexed(0)}\n")
    plans = open_dataset(path)
    assert plans.splits["test"] == (hexed(2), hexed(77), hexed(0))
    assert plans.split("test").ids == [hexed(2), hexed(0)]
    with pytest.raises(DatasetError, match="no list 'val'; known: test"):
        plans.split("val")


def test_pickles_are_small_and_open_again(plans):
    data = pickle.dumps(plans[3:5])
    assert len(data) < 1000
    assert pickle.loads(data).ids == plans[3:5].ids  # noqa: S301 - our own bytes


def test_a_changed_file_is_read_again(tmp_path):
    path = pack(tmp_path, "folder", houses(2))
    assert open_dataset(path)[0].room_num == 1
    file = path / f"{hexed(0)}.json"
    file.write_bytes(encode(house(hexed(0), 9, 5)))
    os.utime(file, ns=(time.time_ns(), time.time_ns() + 10**9))
    plans = open_dataset(path)
    assert plans.column("source_rooms") == [5, 2]
    file.write_bytes(encode(house("other")))
    with pytest.raises(Exception, match=r"expected '0+', as the index"):
        plans[0]
