"""What is not released, and why: unfinished, damaged, empty, not ours to pass on."""

from __future__ import annotations

import fcntl
import hashlib
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from houseexpo.dataset.index import index_table
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.release import PublisherTexts, release
from pipeline.batch.data_set_folder import ExistingPlansPolicy
from tests.builders.batch import one_room, run_build


def _refused(path: Path, tmp_path: Path, expected: str) -> None:
    with pytest.raises(DatasetError, match=expected):
        release(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert not list(tmp_path.glob(".partial*"))


def _manifest(folder: Path, **changes: object) -> None:
    file = folder / "manifest.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **changes}))


def test_nothing_empty_folders_and_other_files_are_named(tmp_path: Path) -> None:
    _refused(tmp_path / "nowhere", tmp_path, "found nothing there")
    (tmp_path / "empty").mkdir()
    _refused(tmp_path / "empty", tmp_path, "expected floor plans")


@pytest.mark.slow
def test_a_source_without_a_licence_is_refused_and_told_what_to_state(tmp_path: Path) -> None:
    one_room(tmp_path / "houses" / "a.ply")
    run_build([tmp_path / "houses"], tmp_path / "built")
    _refused(tmp_path / "built", tmp_path, r"'houses', and nothing states one licence for all of them.*licence = ")


@pytest.mark.slow
def test_a_licence_that_is_stated_later_changes_no_plan(tmp_path: Path) -> None:
    one_room(tmp_path / "houses" / "a.ply")
    run_build([tmp_path / "houses"], tmp_path / "built")
    before = (tmp_path / "built" / "json" / "a.json").read_bytes()
    run_build([tmp_path / "houses"], tmp_path / "built", licence="cc-by-4.0", credit="By C.")
    assert (tmp_path / "built" / "json" / "a.json").read_bytes() == before
    done = release(tmp_path / "built", tmp_path / "out")
    assert done.licence.spdx == "CC-BY-4.0"
    assert "By C." in (done.folder / "LICENSE").read_text()
    assert "By C." in (done.folder / "README.md").read_text()


@pytest.mark.slow
def test_a_licence_is_of_the_sources_it_was_stated_for(tmp_path: Path) -> None:
    sources, out = [tmp_path / name for name in "abc"], tmp_path / "built"
    for i, source in enumerate(sources):
        one_room(source / f"{source.name}.ply", 9.0 + i)

    def add(number: int, **rights: str) -> tuple[str, str, tuple[str, ...]]:
        done = run_build([sources[number]], out, others=ExistingPlansPolicy.ADD, **rights)
        said = json.loads((out / "manifest.json").read_text())
        return said.get("licence", ""), said.get("credit", ""), done.licences

    assert add(0, licence="CC-BY-4.0", credit="By A.") == ("CC-BY-4.0", "By A.", ("CC-BY-4.0",))
    assert add(1, licence="cc-by-4.0", credit="By B.") == ("CC-BY-4.0", "By A.; By B.", ("CC-BY-4.0",))
    assert add(2) == ("", "By A.; By B.", ("CC-BY-4.0", ""))
    _refused(out, tmp_path, "nothing states one licence for all of them")
    assert add(2, licence="CC0-1.0")[2] == ("CC-BY-4.0", "CC0-1.0")
    assert add(2, licence="CC-BY-4.0", credit="By A.") == ("CC-BY-4.0", "By A.; By B.", ("CC-BY-4.0",))
    (out / ".build" / "rights.json").unlink()  # a data set of an earlier version
    assert add(1) == ("", "By A.; By B.", ("CC-BY-4.0", ""))
    assert run_build(["procedural:1"], out, others=ExistingPlansPolicy.REPLACE, licence="CC0-1.0").licences == (
        "CC0-1.0",
    )
    run_build([sources[0]], out, others=ExistingPlansPolicy.REPLACE)
    assert run_build(["procedural:1"], out, others=ExistingPlansPolicy.ADD, licence="CC0-1.0").licences == (
        "",
        "CC0-1.0",
    )
    _refused(out, tmp_path, "nothing states one licence for all of them")


def test_houses_that_the_project_makes_agree_to_any_licence(tmp_path: Path) -> None:
    one_room(tmp_path / "a" / "a.ply")
    run_build(["procedural:1"], tmp_path / "out")
    done = run_build([tmp_path / "a"], tmp_path / "out", others=ExistingPlansPolicy.ADD, licence="CC0-1.0")
    assert done.licences == ("CC0-1.0",)
    assert release(tmp_path / "out", tmp_path / "released").licence.spdx == "CC0-1.0"


def test_an_unknown_licence_names_the_nearest(rooms: Path, tmp_path: Path) -> None:
    _manifest(rooms, licence="CC-BY-ND-4.0")
    _refused(rooms, tmp_path, r"found 'CC-BY-ND-4.0'; the nearest is 'CC-BY-")


@pytest.mark.parametrize("credit", ["By C.\n# Free", "By C.\u2028D.", " By C.", "x" * 301, "\x1b[31mBy C."])
def test_whom_to_name_is_one_line(rooms: Path, tmp_path: Path, credit: str) -> None:
    _manifest(rooms, credit=credit)
    _refused(rooms, tmp_path, "credit: expected a line of at most 300 letters, found")


def test_houses_that_were_withdrawn_are_refused_whatever_is_stated(rooms: Path, tmp_path: Path) -> None:
    file = rooms / "index.parquet"
    file.write_bytes(index_table([{**row, "source": "suncg"} for row in pq.read_table(file).to_pylist()]))
    files = json.loads((rooms / "manifest.json").read_text())["files"]
    _manifest(rooms, files={**files, "index.parquet": hashlib.sha256(file.read_bytes()).hexdigest()})
    _refused(rooms, tmp_path, "3 of its plans were made from SUNCG's houses")


def test_an_unfinished_build_is_refused(rooms: Path, tmp_path: Path) -> None:
    counts = json.loads((rooms / "manifest.json").read_text())["counts"]
    _manifest(rooms, counts={**counts, "not_done": 2})
    _refused(rooms, tmp_path, "found 2 inputs not done")
    (rooms / "manifest.json").unlink()
    _refused(rooms, tmp_path, "expected a finished build, found no manifest.json")


def test_a_build_at_work_is_waited_for(rooms: Path, tmp_path: Path) -> None:
    with (rooms / ".build" / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _refused(rooms, tmp_path, "a build is at work")
    release(rooms, tmp_path / "out")


def test_a_plan_that_was_changed_or_lost_is_named(rooms: Path, tmp_path: Path) -> None:
    file = rooms / "json" / "b.json"
    data = file.read_bytes()
    file.write_bytes(data.replace(b"4", b"5", 1))
    _refused(rooms, tmp_path, r"json/b\.json: expected the SHA-256")
    file.unlink()
    _refused(rooms, tmp_path, "b.json")
    file.write_bytes(data)
    (rooms / "stats.json").write_text("{}")
    _refused(rooms, tmp_path, r"stats\.json: expected the SHA-256")


def test_a_manifest_that_is_none_or_leads_out_is_refused(rooms: Path, tmp_path: Path) -> None:
    files = json.loads((rooms / "manifest.json").read_text())["files"]
    (tmp_path / "secret").write_text("x")
    _manifest(rooms, files={**files, "../secret": "0" * 64})
    _refused(rooms, tmp_path, r"expected names of files in the folder, found '\.\./secret'")
    (rooms / "manifest.json").write_text("[]")
    _refused(rooms, tmp_path, "expected the manifest of a data set")


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("version", "1"),
        ("published", "yesterday"),
        ("published", "20260501"),
        ("doi", "doi.org/x"),
        ("url", "ftp://a"),
        ("title", "a\nb"),
        ("creators", ()),
        ("creators", ("",)),
    ],
)
def test_words_that_fit_nowhere_are_refused(word: str, value: object) -> None:
    with pytest.raises(ConfigError, match=r"release: \w+: expected"):
        PublisherTexts(**{word: value})  # type: ignore[arg-type]
