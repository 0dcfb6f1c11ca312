"""What happens to a data set between two builds: edits, damage, other people's files; and two builds at once."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from houseexpo.corrections import Override
from houseexpo.errors import ConfigError
from pipeline.batch.data_set_folder import ExistingPlansPolicy
from pipeline.batch.disk import lock_folder
from pipeline.batch.verify import find_damaged_files
from tests.builders.batch import contents, lines, one_room, run_build, three_rooms


@pytest.fixture
def street(tmp_path: Path) -> Path:
    return three_rooms(tmp_path / "street")


@pytest.fixture
def out(street: Path, tmp_path: Path) -> Path:
    run_build([street], tmp_path / "out")
    return tmp_path / "out"


def store(out: Path) -> list[Path]:
    return sorted((out / ".build" / "plans").glob("*/*"))


def spoil(file: Path, how: str) -> None:
    data = file.read_bytes()
    match how:
        case "edited":
            file.write_bytes(data.replace(b"0.1", b"0.2"))
        case "same size and time":
            before = file.stat()
            file.write_bytes(data.replace(b"0.1", b"0.2"))
            os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
        case "truncated":
            file.write_bytes(data[: len(data) // 2])
        case "empty":
            file.write_bytes(b"")
        case "deleted":
            file.unlink()


def test_a_second_run_finds_nothing_to_do_and_writes_nothing(street: Path, out: Path) -> None:
    def written(file: Path) -> tuple[int, int]:
        return file.stat().st_ino, file.stat().st_ctime_ns

    before = {
        file: written(file) for file in out.rglob("*") if file.is_file() and file.name not in {"build.json", "lock"}
    }
    again = run_build([street], out)
    assert again.unchanged
    assert again.ids == ("a", "b", "c")
    assert again.stats["outcomes"]["plans"] == 3
    assert not [file for file, was in before.items() if written(file) != was]


def test_plans_share_no_inode_with_the_store(out: Path) -> None:
    assert {file.stat().st_nlink for file in (*store(out), *(out / "json").iterdir())} == {1}


@pytest.mark.parametrize("how", ["edited", "truncated", "empty", "deleted"])
@pytest.mark.parametrize("name", ["json/b.json", "index.parquet", "stats.json", "manifest.json", "rejected.jsonl"])
@pytest.mark.slow
def test_a_file_that_was_spoilt_after_the_build_is_written_again(street: Path, out: Path, name: str, how: str) -> None:
    before = contents(out)
    spoil(out / name, how)
    run_build([street], out)
    assert contents(out) == before


@pytest.mark.parametrize("how", ["edited", "same size and time", "truncated", "empty", "deleted"])
@pytest.mark.slow
def test_a_plan_that_the_store_has_lost_too_is_made_again(street: Path, out: Path, how: str) -> None:
    before = contents(out)
    for file in store(out):
        spoil(file, how)
    spoil(out / "json" / "b.json", "truncated")
    run_build([street], out)
    assert contents(out) == before
    assert not list(find_damaged_files(out))


def test_a_lost_plan_of_a_source_that_is_gone_is_taken_from_the_data_set(street: Path, out: Path) -> None:
    villa = one_room(street.parent / "villa.ply", 9.0, 7.0)
    before = contents(out)
    for file in street.iterdir():
        file.unlink()
    for file in store(out):
        file.unlink()
    found = run_build([villa], out, others=ExistingPlansPolicy.ADD)
    assert len(found.ids) == 4
    assert all(contents(out)[name] == data for name, data in before.items() if name.startswith("json/"))


@pytest.mark.parametrize("record", ["build.json", "finished.json", "journal.jsonl"])
@pytest.mark.parametrize("how", ["truncated", "empty"])
def test_a_damaged_record_makes_no_folder_unusable(street: Path, out: Path, record: str, how: str) -> None:
    before = contents(out)
    spoil(out / ".build" / record, how)
    run_build([street], out)
    assert contents(out) == before
    assert run_build([street], out).unchanged


@pytest.mark.parametrize("others", [ExistingPlansPolicy.REFUSE, ExistingPlansPolicy.ADD])
@pytest.mark.slow
def test_without_a_journal_plans_of_other_sources_stay(street: Path, out: Path, others: ExistingPlansPolicy) -> None:
    villa = one_room(street.parent / "villa.ply", 9.0, 7.0)
    before = contents(out)
    (out / ".build" / "journal.jsonl").unlink()
    with pytest.raises(ConfigError, match=r"plans of other sources \(street\), and no journal"):
        run_build([villa], out, others=others)
    assert contents(out) == before
    run_build([street], out)
    assert contents(out) == before
    (out / ".build" / "journal.jsonl").unlink()
    assert run_build([villa], out, others=ExistingPlansPolicy.REPLACE).ids == (f"{street.parent.name}_villa",)


@pytest.mark.slow
def test_a_copy_that_a_person_keeps_stays_when_other_sources_are_added(street: Path, out: Path) -> None:
    one_room(street / "d.ply", 4.0, 4.0)  # as a is
    assert "d" in run_build([street], out, overrides={"d": Override(keep=True)}).ids
    villa = one_room(street.parent / "villa.ply", 9.0, 7.0)
    assert "d" in run_build([villa], out, others=ExistingPlansPolicy.ADD).ids
    assert "d" not in run_build([street], out, others=ExistingPlansPolicy.ADD).ids


def test_without_a_record_of_parameters_those_of_the_manifest_count(street: Path, out: Path) -> None:
    (out / ".build" / "build.json").unlink()
    with pytest.raises(ConfigError, match="a build with other parameters"):
        run_build([street], out, seed=5)


def test_a_journal_full_of_garbage_costs_what_it_said(street: Path, out: Path) -> None:
    before = contents(out)
    journal = out / ".build" / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"\xff\x00{}\n" + lines[0] + b'{"input":"zz","source":1}\n[]\n' + lines[1] + lines[2][:40])
    run_build([street], out)
    assert contents(out) == before


def test_files_that_no_build_wrote_are_left_alone(street: Path, out: Path) -> None:
    (out / "json" / "mine.json").write_text("{}")
    before = contents(out)
    for others in (ExistingPlansPolicy.REFUSE, ExistingPlansPolicy.ADD):
        with pytest.raises(ConfigError, match=r"1 files that no build wrote \(mine\.json\)"):
            run_build([street], out, others=others)
    assert contents(out) == before
    run_build([street], out, others=ExistingPlansPolicy.REPLACE)
    assert "json/mine.json" not in contents(out)


def test_links_are_neither_followed_nor_removed(street: Path, out: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    (out / "json").rename(elsewhere)
    (out / "json").symlink_to(elsewhere)
    for others in ExistingPlansPolicy:
        with pytest.raises(ConfigError, match="json is a link"):
            run_build([street], out, others=others, limit=1)
    assert len(list(elsewhere.iterdir())) == 3
    (out / "json").unlink()
    elsewhere.rename(out / "json")
    (out / "json" / "x.json").symlink_to(street / "a.ply")
    for others in ExistingPlansPolicy:
        with pytest.raises(ConfigError, match=r"json/x\.json is a link"):
            run_build([street], out, others=others)


def test_two_builds_into_one_folder_do_not_meet(street: Path, out: Path) -> None:
    with lock_folder(out / ".build" / "lock"), pytest.raises(ConfigError, match=f"process {os.getpid()}"):
        run_build([street], out)
    assert run_build([street], out).unchanged  # a lock file alone holds nobody up


def test_verify_names_what_is_not_as_it_was_written(out: Path) -> None:
    assert not list(find_damaged_files(out))
    spoil(out / "json" / "a.json", "same size and time")
    spoil(out / "json" / "b.json", "deleted")
    (out / "json" / "mine.json").touch()
    spoil(store(out)[0], "same size and time")
    found = list(find_damaged_files(out))
    assert found[:3] == [
        "json/a.json: changed since it was written",
        "json/b.json: missing",
        "json/mine.json: no build wrote it",
    ]
    assert len(found) == 4
    assert "damaged" in found[3]


@pytest.mark.slow
@pytest.mark.parametrize("how", ["kept", "truncated", "deleted"])
def test_copies_are_those_of_a_fresh_build_whatever_was_compared_before(street: Path, out: Path, how: str) -> None:
    one_room(street / "aa.ply", 4.0, 5.0)  # b, turned; its id comes first
    one_room(street / "d.ply", 9.0, 4.0)
    (street / "c.ply").unlink()
    if how != "kept":
        spoil(out / ".build" / "copies.npz", how)
    run_build([street], out)
    run_build([street], street.parent / "fresh")
    assert contents(out) == contents(street.parent / "fresh")
    assert [line["id"] for line in lines(out / "duplicates.jsonl")] == ["b"]


def test_what_interrupted_writes_left_is_swept(street: Path, out: Path) -> None:
    left = [out / ".partial-1", out / "json" / ".partial-2", store(out)[0].with_name(".partial-3")]
    for file in left:
        file.touch()
    run_build([street], out)
    assert not [file for file in left if file.exists()]


@pytest.mark.parametrize("name", ["lock", "journal.jsonl", "pictures", "plans", "report.html", "json"])
@pytest.mark.parametrize("others", list(ExistingPlansPolicy))
def test_no_link_in_a_data_set_is_written_through(
    street: Path, out: Path, tmp_path: Path, name: str, others: ExistingPlansPolicy
) -> None:
    target, link = tmp_path / "mine", out / "json" if name == "json" else out / ".build" / name
    if link.is_dir():
        shutil.rmtree(link)
        target.mkdir()
        (target / "holidays.png").write_bytes(b"mine")
        (target / "a.json").write_bytes(b"mine")
    else:
        link.unlink(missing_ok=True)
        target.write_bytes(b"mine")
    link.symlink_to(target)
    with pytest.raises(ConfigError, match=f"{link.relative_to(out)} is a link; move it away"):
        run_build([street], out, others=others)
    mine = sorted(target.iterdir()) if target.is_dir() else [target]
    assert [file.read_bytes() for file in mine] == [b"mine"] * len(mine)


def test_a_copy_made_of_hard_links_is_built_apart(street: Path, out: Path, tmp_path: Path) -> None:
    shutil.copytree(out, tmp_path / "copy", copy_function=os.link)
    before = contents(out), (out / ".build" / "journal.jsonl").read_bytes()
    one_room(street / "d.ply", 7.0)
    run_build([street], tmp_path / "copy")
    assert (contents(out), (out / ".build" / "journal.jsonl").read_bytes()) == before
