from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import msgspec
import pyarrow.parquet as pq
import pytest
import shapely

from houseexpo.corrections import Override
from houseexpo.errors import ConfigError
from houseexpo.floorplan import decode, load_plan
from pipeline.algorithm import plan_level
from pipeline.batch.build import build
from pipeline.batch.job import Job, JobSettings, _as_rejection, make_plans, run_job
from pipeline.batch.plan_store import PlanStore
from pipeline.batch.result_store import FolderStore
from pipeline.config import DedupeConfig, PipelineConfig
from pipeline.rejection import Reason
from pipeline.sources import find
from pipeline.sources.files import links_left_out
from pipeline.values import Input
from tests.builders.batch import boxed, config_for, contents, lines, one_room, run_build
from tests.builders.suncg_houses import write_houses


@pytest.fixture
def street(tmp_path: Path) -> Path:
    """Five houses, two of them equal but for a quarter turn, and three things that are no houses."""
    folder = tmp_path / "street"
    one_room(folder / "a.ply")
    one_room(folder / "b.ply", 4.0, 5.0)
    one_room(folder / "far" / "c.obj", 7.0, 4.0)
    one_room(folder / "d_refuse.ply", 6.0, 4.0)
    one_room(folder / "e_fault.ply", 6.0, 5.0)
    (folder / "empty.stl").touch()
    (folder / "garbage.glb").write_bytes(b"no mesh at all")
    (folder / "notes.txt").write_text("not a source")
    return folder


def test_every_input_ends_as_a_plan_a_rejection_or_a_duplicate(street: Path, tmp_path: Path) -> None:
    data_set = run_build([street], tmp_path / "out")
    assert data_set.ids == ("a", "far_c")
    assert lines(tmp_path / "out" / "duplicates.jsonl") == [
        {"id": "b", "kept_id": "a", "difference": 0.0, "symmetry": "transpose"}
    ]
    rejected = {line["id"]: line for line in lines(tmp_path / "out" / "rejected.jsonl")}
    assert {name: (line["stage"], line["reason"]) for name, line in rejected.items()} == {
        "d_refuse": ("layout", "not_enclosed"),
        "e_fault": ("internal", "internal"),
        "empty": ("source", "empty"),
        "garbage": ("source", "unreadable"),
    }
    assert "ZeroDivisionError at batch.py:" in rejected["e_fault"]["detail"]
    assert all(line["advice"] for line in rejected.values())
    assert data_set.stats["outcomes"] == {
        "inputs": 7,
        "plans": 2,
        "doubtful": 0,
        "duplicates": 1,
        "rejected": 4,
        "not_done": 0,
        "reasons": {"empty": 1, "internal": 1, "not_enclosed": 1, "unreadable": 1},
        "rules": {},
    }


@pytest.mark.parametrize("error", [MemoryError(), shapely.errors.GEOSException("std::bad_alloc")])
def test_a_library_without_memory_is_no_fault_of_the_program(error: Exception, tmp_path: Path) -> None:
    refused = _as_rejection(error, Input("map", "occupancy_map", str(tmp_path / "map.yaml")))
    assert (refused.stage, refused.reason) == ("executor", Reason.OUT_OF_MEMORY)


@pytest.mark.slow
def test_a_build_counts_the_plans_in_which_a_rule_had_something_to_do(tmp_path: Path) -> None:
    write_houses(tmp_path / "houses", 40, 7)
    outcomes = run_build([tmp_path / "houses"], tmp_path / "out", seed=7, plan=plan_level).stats["outcomes"]
    plans = [decode(file.read_bytes()) for file in (tmp_path / "out" / "json").iterdir()]
    notes = [(plan.provenance or {})["notes"] for plan in plans]
    assert outcomes["rules"]["boundary:floor_edge"] == sum("boundary" in note for note in notes) > 0
    assert outcomes["rules"]["filled_cells"] == sum("filled_cells" in note for note in notes) > 0


def test_workers_change_no_byte_and_no_path_of_the_machine_is_told(street: Path, tmp_path: Path) -> None:
    run_build([street], tmp_path / "one", workers=1)
    run_build([street], tmp_path / "two", workers=2)
    one, two = contents(tmp_path / "one"), contents(tmp_path / "two")
    assert one == two
    assert set(one) == {
        *("duplicates.jsonl", "index.parquet", "json/a.json", "json/far_c.json"),
        *("manifest.json", "rejected.jsonl", "stats.json"),
    }
    assert not [name for name, data in one.items() if str(tmp_path).encode() in data]


def test_manifest_holds_parameters_counts_and_the_hash_of_every_other_file(street: Path, tmp_path: Path) -> None:
    run_build([street], tmp_path / "out", seed=7)
    files = contents(tmp_path / "out")
    manifest = msgspec.json.decode(files.pop("manifest.json"))
    assert manifest["files"] == {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    assert manifest["parameters"]["build"]["seed"] == 7
    assert manifest["parameters"]["connectivity"]["samples"] == 100
    assert manifest["sources"] == ["street"]
    assert manifest["counts"]["plans"] == 2
    assert "numpy" in manifest["versions"]


def test_index_has_a_row_for_each_plan(street: Path, tmp_path: Path) -> None:
    run_build([street], tmp_path / "out")
    rows = pq.read_table(tmp_path / "out" / "index.parquet").to_pylist()
    assert [(row["id"], row["area"], row["width"], row["height"]) for row in rows] == [
        ("a", 20.0, 5.0, 4.0),
        ("far_c", 28.0, 7.0, 4.0),
    ]
    assert [row["copies"] for row in rows] == [["b"], []]  # the table still has what was left out
    assert rows[0]["source"] == "mesh"
    assert rows[0]["split"] is None


def test_copies_are_kept_on_demand_and_no_plan_is_made_again(street: Path, tmp_path: Path) -> None:
    run_build([street], tmp_path / "out")
    usual = config_for([street])
    keeping = replace(usual, stages=replace(usual.stages, dedupe=DedupeConfig(off=True)))
    assert keeping.digest() == usual.digest()  # no plan depends on it
    data_set = build(keeping, tmp_path / "out", workers=1, overrides={}, progress=lambda *_: None, plan=boxed)
    assert data_set.ids == ("a", "b", "far_c")
    assert lines(tmp_path / "out" / "duplicates.jsonl") == []
    manifest = msgspec.json.decode((tmp_path / "out" / "manifest.json").read_bytes())
    assert manifest["parameters"]["dedupe"]["off"] is True


def test_equal_ids_get_eight_digits_of_their_content(tmp_path: Path) -> None:
    first, second = one_room(tmp_path / "x" / "house.ply"), one_room(tmp_path / "y" / "house.ply", 7.0, 5.0)
    data_set = run_build([first.parent, second.parent], tmp_path / "out")
    digits = [hashlib.sha256(path.read_bytes()).hexdigest()[:8] for path in (first, second)]
    assert data_set.ids == tuple(sorted(f"house_{found}" for found in digits))
    assert load_plan(tmp_path / "out" / "json" / f"{data_set.ids[0]}.json").id == data_set.ids[0]


def test_limit_takes_the_first_and_a_source_given_twice_counts_once(street: Path, tmp_path: Path) -> None:
    data_set = run_build([street, street], tmp_path / "out", limit=2)
    assert data_set.stats["outcomes"]["inputs"] == 2
    assert data_set.ids == ("a",)


def test_a_person_keeps_drops_and_sets_heights(street: Path, tmp_path: Path) -> None:
    words = {"b": Override(keep=True), "far_c": Override(drop=True, why="a hall"), "a": Override(h_g=0.4, h_d=1.0)}
    data_set = run_build([street], tmp_path / "out", overrides=words)
    assert data_set.ids == ("a", "b")
    dropped = next(line for line in lines(tmp_path / "out" / "rejected.jsonl") if line["id"] == "far_c")
    assert (dropped["stage"], dropped["reason"], dropped["detail"]) == ("overrides", "dropped_by_hand", "a hall")
    a, b = (load_plan(tmp_path / "out" / "json" / f"{name}.json").provenance or {} for name in ("a", "b"))
    assert (a["ground_m"], a["characters"]) == (0.4, True)
    assert (b["ground_m"], b["characters"]) == (0.01, True)  # no rule rejects it: none is switched off


@pytest.mark.slow
def test_chance_depends_on_seed_and_id_alone(street: Path, tmp_path: Path) -> None:
    def drawn(out: str, seed: int, limit: int | None = None) -> object:
        run_build([street], tmp_path / out, seed=seed, limit=limit)
        return (load_plan(tmp_path / out / "json" / "a.json").provenance or {})["drawn"]

    assert drawn("whole", 1) == drawn("part", 1, limit=1)
    assert drawn("whole", 1) != drawn("other", 2, limit=1)


def test_a_data_set_is_no_source(street: Path, tmp_path: Path) -> None:
    run_build([street], tmp_path / "out")
    with pytest.raises(ConfigError, match="no file in it is a house"):
        run_build([tmp_path / "out"], tmp_path / "again")


def test_hidden_files_of_a_folder_are_no_houses(tmp_path: Path) -> None:
    for name in ("house.ply", ".house.ply", "._house.ply", ".git/house.ply", "__MACOSX/._house.ply", "more/house.ply"):
        one_room(tmp_path / "in" / name)
    (tmp_path / "in" / ".gone").symlink_to("nothing")
    assert [item.id for item in find(str(tmp_path / "in"))] == ["house", "more_house"]
    assert len(list(find(str(tmp_path / "in" / ".house.ply")))) == 1
    assert links_left_out(tmp_path / "in") == []


def test_a_file_that_no_reader_knows_costs_no_other(tmp_path: Path) -> None:
    house, strange = one_room(tmp_path / "house.obj"), tmp_path / "world.unknown"
    strange.write_text("no house")
    found = run_build([house, strange], tmp_path / "out")
    assert len(found.ids) == 1
    assert found.passed_over == (str(strange),)
    with pytest.raises(ConfigError, match=r"world\.unknown.*cannot read this file"):
        run_build([strange], tmp_path / "none")
    with pytest.raises(ConfigError, match="does not exist"):
        run_build([house, tmp_path / "gone.glb"], tmp_path / "gone")


def test_a_file_that_cannot_be_read_is_dropped_by_hand_where_a_person_says_so(tmp_path: Path) -> None:
    (tmp_path / "barn.usdz").write_bytes(b"PK not a zip")
    item = Input("barn", "mesh_file", str(tmp_path / "barn.usdz"))
    for said, reason in (({}, "unreadable"), ({"barn": Override(drop=True)}, "dropped_by_hand")):
        settings = JobSettings(PipelineConfig(), 0, {}, {}, make_plans, PlanStore(FolderStore(tmp_path / "out")))
        (refused,) = run_job(settings, Job("barn", item, str(tmp_path), "", said)).refused
        assert refused.reason == reason
