"""The folder of a release: whole or not there, the same bytes each time, and nobody else's files."""

from __future__ import annotations

import subprocess
import tarfile
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from houseexpo.release import release, write_release
from tests.builders.batch import contents
from tests.houseexpo.release.conftest import ABOUT

FILES = {
    *("README.md", "LICENSE", "CITATION.cff", "croissant.json", "SHA256SUMS"),
    *("json.tar.gz", "stats.json", "provenance.json", "pictures/plans.png", "pictures/measures.png"),
}


@pytest.mark.slow
def test_one_data_set_gives_the_same_bytes_whatever_the_workers(made: Path, released: Path, tmp_path: Path) -> None:
    again = release(made, tmp_path / "eight-houses", ABOUT, workers=2).folder
    assert contents(again) == contents(released)
    assert set(contents(again)) >= FILES
    assert not list(tmp_path.glob(".*"))


def test_it_holds_nothing_of_this_machine(made: Path, released: Path) -> None:
    places = [str(made.parent).encode(), b"/tmp/", b"/root/"]
    text = [data for name, data in contents(released).items() if not name.endswith((".png", ".parquet", ".gz"))]
    assert not [data for data in text if any(place in data for place in places)]


def test_the_checksums_hold(released: Path) -> None:
    subprocess.run(["sha256sum", "--check", "--strict", "--quiet", "SHA256SUMS"], cwd=released, check=True)
    lines = (released / "SHA256SUMS").read_text().splitlines()
    assert {line.partition("  ")[2] for line in lines} == set(contents(released)) - {"SHA256SUMS"}


def test_the_archive_is_sorted_and_has_no_time(made: Path, released: Path) -> None:
    with tarfile.open(released / "json.tar.gz") as archive:
        members = archive.getmembers()
    assert [member.name for member in members] == sorted(f"json/{file.name}" for file in (made / "json").iterdir())
    assert {(member.mtime, member.uid, member.mode) for member in members} == {(0, 0, 0o644)}


def test_a_former_release_is_replaced_whole(rooms: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    first = contents(release(rooms, out).folder)
    (out / "plans" / "train.parquet").unlink()
    (out / "README.md").write_text("mine")
    assert contents(release(rooms, out).folder) == first
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "rooms"]


@pytest.mark.parametrize("name", ["notes.txt", "plans/mine.parquet", ".git/config"])
def test_a_former_release_with_other_files_is_left_alone(rooms: Path, tmp_path: Path, name: str) -> None:
    out = release(rooms, tmp_path / "out").folder
    (out / name).parent.mkdir(exist_ok=True)
    (out / name).write_text("mine")
    before = contents(out)
    with pytest.raises(ConfigError, match=f"holds '{name}'"):
        release(rooms, out)
    assert contents(out) == before


def test_other_folders_files_and_links_are_left_alone(rooms: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="expected an empty folder or a former release"):
        release(rooms, rooms)
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("mine")
    link.symlink_to(rooms)
    for target, what in ((file, "a file"), (link, "a link")):
        with pytest.raises(ConfigError, match=f"found {what}"):
            release(rooms, target)


def test_a_fault_leaves_a_former_release_as_it_was(
    rooms: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = release(rooms, tmp_path / "out").folder
    before = contents(out)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(write_release, "write_checksums", full)
    for target in (out, tmp_path / "new"):
        with pytest.raises(OSError, match="No space left"):
            release(rooms, target)
    assert contents(out) == before
    assert not (tmp_path / "new").exists()
    assert not list(tmp_path.glob(".*"))
