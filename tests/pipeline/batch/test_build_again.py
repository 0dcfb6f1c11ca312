"""A build that is run again, was interrupted, or meets a folder that is not its own."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import msgspec
import pytest

from houseexpo.corrections import Override
from houseexpo.dataset import open_dataset
from houseexpo.dataset.splits import split_plans, write_split
from houseexpo.errors import ConfigError
from pipeline.algorithm import plan_level
from pipeline.batch.data_set_folder import ExistingPlansPolicy
from tests.builders.batch import contents, killed_once, lines, one_room, run_build, three_rooms


@pytest.fixture
def street(tmp_path: Path) -> Path:
    return three_rooms(tmp_path / "street")


def journal(out: Path) -> list[str]:
    """Return the ids of the plans that were made, in the order in which they were."""
    file = out / ".build" / "journal.jsonl"
    entries = [msgspec.json.decode(line) for line in file.read_bytes().splitlines() if line.endswith(b"}")]
    return [plan["id"] for entry in entries if not entry["gone"] for plan in entry["plans"]]


def test_an_input_that_changed_is_done_again(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    one_room(street / "b.ply", 9.0, 4.0)
    run_build([street], out)
    assert journal(out) == ["a", "b", "c", "b"]
    fresh = tmp_path / "fresh"
    run_build([street], fresh)
    assert contents(out) == contents(fresh)


@pytest.mark.slow
def test_only_the_ids_that_a_person_spoke_of_are_done_again(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    run_build([street], out, overrides={"b": Override(h_g=0.3)})
    assert journal(out) == ["a", "b", "c", "b"]


@pytest.mark.slow
def test_fewer_inputs_leave_no_plan_of_the_others(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    assert run_build([street], out, limit=1).ids == ("a",)
    assert [name for name in contents(out) if name.startswith("json/")] == ["json/a.json"]


def divided(out: Path) -> None:
    """Split a data set as the command does."""
    write_split(split_plans(open_dataset(out), {"train": 0.67, "test": 0.33}, seed=0), out)


@pytest.mark.slow
def test_lists_of_the_same_plans_stay(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    divided(out)
    before = contents(out)
    assert {"splits/train.txt", "splits/test.txt", "splits/splits.json"} <= before.keys()
    run_build([street], out)
    assert contents(out) == before


@pytest.mark.slow
def test_lists_of_other_plans_are_removed(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    divided(out)
    one_room(street / "d.ply", 9.0, 7.0)
    run_build([street], out)
    fresh = tmp_path / "fresh"
    run_build([street], fresh)
    assert contents(out) == contents(fresh)
    assert not (out / "splits").exists()
    assert open_dataset(out).splits == {}


@pytest.mark.slow
def test_what_is_ones_own_beside_them_is_not_removed(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    divided(out)
    lists = {file.name for file in (out / "splits").iterdir()}
    (out / "splits" / "notes.md").write_text("why")
    (out / "splits" / "mine.txt").write_text("a\n")
    run_build([street], out, overrides={"b": Override(h_g=0.3)})
    assert {file.name for file in (out / "splits").iterdir()} == lists | {"notes.md", "mine.txt"}
    assert set(open_dataset(out).splits) == {"train", "test", "mine"}
    assert "splits/mine.txt" not in msgspec.json.decode((out / "manifest.json").read_bytes())["files"]
    (out / "splits" / "test.txt").write_text("a\nb\n")  # a list of a split that somebody has changed is his own
    run_build([street], out, limit=1)
    assert {file.name for file in (out / "splits").iterdir()} == {"notes.md", "mine.txt", "test.txt"}
    assert open_dataset(out).split("mine").ids == ["a"]


def test_an_interrupted_build_has_no_manifest_and_goes_on(street: Path, tmp_path: Path) -> None:
    out, whole = tmp_path / "out", tmp_path / "whole"
    run_build([street], whole)
    run_build([street], out, limit=2)
    (out / "manifest.json").unlink()
    with (out / ".build" / "journal.jsonl").open("ab") as stream:
        stream.write(b'{"key":"cut sho')
    run_build([street], out)
    assert journal(out) == ["a", "b", "c"]
    assert contents(out) == contents(whole)


def test_no_half_file_is_left_where_a_build_fails(
    street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*args: object) -> bytes:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pipeline.batch.assemble.index_table", full)
    with pytest.raises(OSError, match="No space left"):
        run_build([street], tmp_path / "out")
    assert not (tmp_path / "out" / "manifest.json").exists()
    assert not [file for file in (tmp_path / "out").rglob(".*") if file.is_file()]


@pytest.mark.slow
def test_a_crash_and_a_timeout_cost_only_their_own_house(street: Path, tmp_path: Path) -> None:
    one_room(street / "b_crash.ply")
    one_room(street / "b_sleep.ply", 8.0)
    data_set = run_build([street], tmp_path / "out", workers=2, seconds=1.5)
    assert data_set.ids == ("a", "b", "c")
    rejected = {line["id"]: line for line in lines(tmp_path / "out" / "rejected.jsonl")}
    assert {name: line["reason"] for name, line in rejected.items()} == {"b_crash": "internal", "b_sleep": "timeout"}
    assert "SIGSEGV" in rejected["b_crash"]["detail"]
    assert "--seconds (limits.seconds in a manifest)" in rejected["b_sleep"]["advice"]


@pytest.mark.slow
def test_other_limits_do_again_what_exceeded_them_and_nothing_else(street: Path, tmp_path: Path) -> None:
    one_room(street / "b_sleep.ply", 8.0)
    run_build([street], tmp_path / "out", seconds=1.0)
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "out" / "json").iterdir()}
    data_set = run_build([street], tmp_path / "out", seconds=1.2)
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "out" / "json").iterdir()} == before
    assert {entry.refused[0].detail for entry in data_set.entries if entry.refused} == {"took longer than 1.2 s"}
    assert run_build([street], tmp_path / "out", seconds=1.2).unchanged


def test_a_folder_of_something_else_is_refused(street: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="expected an empty folder or an earlier build"):
        run_build([next(file for file in street.iterdir() if file.is_file())], street)
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(ConfigError, match="expected a folder, found a file"):
        run_build([street], file)


def test_other_parameters_are_refused(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    before = contents(out)
    with pytest.raises(ConfigError, match=r"other parameters \(build.seed: 0, this one's is 3\); --replace"):
        run_build([street], out, seed=3)
    assert contents(out) == before
    assert run_build([street], out, seed=3, others=ExistingPlansPolicy.REPLACE).ids == ("a", "b", "c")


@pytest.mark.slow
def test_a_data_set_without_its_build_folder_is_left_alone(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    (out / ".build").rename(tmp_path / "elsewhere")
    before = contents(out)
    for others in (ExistingPlansPolicy.REFUSE, ExistingPlansPolicy.ADD):
        with pytest.raises(ConfigError, match=r"without the \.build folder"):
            run_build([street], out, others=others)
    assert contents(out) == before
    assert run_build([street], out, others=ExistingPlansPolicy.REPLACE, limit=1).ids == ("a",)
    assert [name for name in contents(out) if name.startswith("json/")] == ["json/a.json"]


@pytest.mark.slow
def test_plans_of_other_sources_are_never_removed_unasked(street: Path, tmp_path: Path) -> None:
    out, other = tmp_path / "out", one_room(tmp_path / "villa.ply", 9.0, 7.0)
    run_build([street], out)
    before = contents(out)
    with pytest.raises(ConfigError, match=r"plans of other sources \(.*street\); --add keeps them"):
        run_build([other], out)
    assert contents(out) == before
    (villa,) = run_build([other], tmp_path / "alone").ids
    assert run_build([other], out, others=ExistingPlansPolicy.ADD).ids == ("a", "b", "c", villa)
    run_build([street, other], tmp_path / "both")
    assert contents(out) == contents(tmp_path / "both")
    assert run_build([other], out, others=ExistingPlansPolicy.REPLACE).ids == (villa,)
    assert contents(out) == contents(tmp_path / "alone")


def test_what_was_added_stays_though_its_source_is_gone(street: Path, tmp_path: Path) -> None:
    out, other = tmp_path / "out", one_room(tmp_path / "villa.ply", 9.0, 7.0)
    run_build([other], out)
    other.unlink()
    assert len(run_build([street], out, others=ExistingPlansPolicy.ADD).ids) == 4
    assert len(run_build([street], out, others=ExistingPlansPolicy.ADD).ids) == 4


def test_more_made_houses_are_no_other_source(tmp_path: Path) -> None:
    run_build([Path("procedural:1")], tmp_path / "out")
    assert run_build([Path("procedural:2")], tmp_path / "out").stats["outcomes"]["inputs"] == 2
    with pytest.raises(ConfigError, match="plans of other sources"):
        run_build([Path("procedural:1")], tmp_path / "out")


def test_a_build_of_test_houses_is_not_replaced_by_homes(tmp_path: Path) -> None:
    """Before homes were the default, ``procedural:2`` meant test houses, later called ``?style=test``."""
    out = tmp_path / "out"
    run_build(["procedural:2?style=published"], out, plan=plan_level)
    for name in ("procedural:2", "procedural:2?style=test"):
        for file in (out / "manifest.json", *(out / ".build").glob("*.json*")):
            file.write_text(re.sub(r"procedural:2(\?style=\w+)?", name, file.read_text()))
        before = contents(out)
        with pytest.raises(ConfigError, match=rf"plans of other sources \({re.escape(name)}\)"):
            run_build(["procedural:2"], out, plan=plan_level)
        with pytest.raises(ConfigError, match="test houses are no longer made"):
            run_build(["procedural:2?style=test"], out, plan=plan_level)
        assert contents(out) == before


def test_a_data_set_whose_style_has_another_name_now_goes_on(tmp_path: Path) -> None:
    """The style ``published`` was called ``home``."""
    out = tmp_path / "out"
    first = run_build(["procedural:1?style=published"], out, plan=plan_level)
    for file in (out / "manifest.json", *(out / ".build").glob("*.json*")):
        file.write_text(file.read_text().replace("style=published", "style=home"))
    for name in ("procedural:2?style=home", "procedural:2?style=published"):
        assert set(first.ids) < set(run_build([name], out, plan=plan_level).ids)


def test_a_source_that_does_not_exist_is_an_error_before_anything_is_touched(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([street], out)
    before = contents(out)
    for others in ExistingPlansPolicy:
        with pytest.raises(ConfigError, match=r"gone\.glb' does not exist"):
            run_build([street, tmp_path / "gone.glb"], out, others=others)
    assert contents(out) == before


@pytest.mark.slow
def test_a_house_whose_worker_was_killed_is_tried_again_at_once(street: Path, tmp_path: Path) -> None:
    run_build([street], tmp_path / "calm")
    run_build([street], tmp_path / "out", plan=partial(killed_once, tmp_path / "killed"))
    assert (tmp_path / "killed").exists()
    assert contents(tmp_path / "out") == contents(tmp_path / "calm")


@pytest.mark.slow
def test_a_house_that_kills_every_worker_is_one_rejection(street: Path, tmp_path: Path) -> None:
    one_room(street / "b_kill.ply")
    for workers in (1, 2):
        data_set = run_build([street], tmp_path / str(workers), workers=workers)
        assert data_set.ids == ("a", "b", "c")
        [line] = lines(tmp_path / str(workers) / "rejected.jsonl")
        assert (line["id"], line["stage"]) == ("b_kill", "executor")
        assert "3 of 3" in line["detail"]


def test_nothing_to_read_is_a_usage_error(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for sources, words in (
        ([], "no SOURCE"),
        ([tmp_path / "empty"], "the folder is empty"),
        ([tmp_path / "absent"], "does not exist"),
    ):
        with pytest.raises(ConfigError, match=words):
            run_build(sources, tmp_path / "out")
    assert not (tmp_path / "out").exists()
