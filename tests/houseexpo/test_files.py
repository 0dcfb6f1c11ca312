"""A file is written whole, and only where a file belongs."""

from __future__ import annotations

import errno
import io
import os
import zipfile
from contextlib import suppress
from pathlib import Path

import pytest

import houseexpo
from houseexpo.errors import ConfigError, DatasetError, PlanError
from houseexpo.files import (
    atomic_folder,
    cache_folder,
    decode_yaml,
    make_folder,
    write_atomically,
    zip_bytes,
)


def test_what_is_no_file_is_left_alone(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name, what in {"pipe": "a device or a pipe", "folder": "a folder"}.items():
        with pytest.raises(ConfigError, match=f"{name}: expected a regular file or a new one, found {what}"):
            write_atomically(tmp_path / name, b"x")
    with pytest.raises(ConfigError, match="/dev/null"):
        write_atomically(Path("/dev/null"), b"x")
    assert (tmp_path / "pipe").is_fifo()


def test_reading_a_pipe_or_a_device_never_hangs(tmp_path: Path) -> None:
    pipe = tmp_path / "plan.json"
    os.mkfifo(pipe)
    what = "found a device or a pipe; save its content to a file"
    with pytest.raises(PlanError, match=what):
        houseexpo.load_plan(pipe)
    for place in (pipe, Path("/dev/zero")):
        with pytest.raises(DatasetError, match=what):
            houseexpo.open_dataset(place)
        with pytest.raises(ConfigError, match=what):
            houseexpo.build(place, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_file_is_replaced_by_a_whole_one(tmp_path: Path) -> None:
    for data in (b"first", b"second"):
        write_atomically(tmp_path / "a.json", data)
        assert (tmp_path / "a.json").read_bytes() == data
    assert list(tmp_path.iterdir()) == [tmp_path / "a.json"]


def test_a_folder_is_made_where_no_file_lies(tmp_path: Path) -> None:
    assert make_folder(make_folder(tmp_path / "new" / "one")).is_dir()
    (tmp_path / "taken").write_text("mine")
    for name in ("taken", "taken/inner/most"):
        with pytest.raises(ConfigError, match=r"expected a folder or nothing, found the file .*/taken; name another"):
            make_folder(tmp_path / name)
    assert (tmp_path / "taken").read_text() == "mine"
    (tmp_path / "link").symlink_to(tmp_path / "gone")
    with pytest.raises(ConfigError, match=r"found a link that leads nowhere, .*/link; name another"):
        make_folder(tmp_path / "link" / "inner")


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "above" / "made"
    with suppress(KeyboardInterrupt), atomic_folder(target) as folder:
        (folder / "a").write_text("x")
        raise KeyboardInterrupt
    assert list((tmp_path / "above").iterdir()) == []
    with atomic_folder(target) as folder:
        (folder / "a").write_text("x")
        assert not target.exists()
    assert [file.name for file in target.iterdir()] == ["a"]
    assert list((tmp_path / "above").iterdir()) == [target]


def test_the_folder_of_a_quicker_process_stays(tmp_path: Path) -> None:
    with atomic_folder(tmp_path / "made") as folder:
        (folder / "mine").write_text("x")
        (tmp_path / "made").mkdir()
        (tmp_path / "made" / "theirs").write_text("x")
    assert [file.name for file in (tmp_path / "made").iterdir()] == ["theirs"]
    assert list(tmp_path.iterdir()) == [tmp_path / "made"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: &x [1]\nb: *x\n", "alias"),
        ("[" * 102 + "]" * 102, "more than 100 deep"),
        ("'*': " + "[" * 102 + "]" * 102, "more than 100 deep"),
        ("a: [", "is no YAML"),
        ("--- 1\n--- 2\n", "is no YAML"),
    ],
)
def test_yaml_that_grows_or_is_deep_is_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        decode_yaml(text, 100)


def test_a_zip_archive_is_the_same_whenever_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"b.txt": b"b" * 1000, "a/c.txt": b"c"}
    first = zip_bytes(files)
    monkeypatch.setattr("time.localtime", lambda *_: (2030, 1, 1, 0, 0, 0, 0, 0, 0))
    assert zip_bytes(dict(reversed(files.items()))) == first
    assert len(first) < 500
    with zipfile.ZipFile(io.BytesIO(first)) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == files


def test_an_error_of_the_system_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fchmod", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*whole\.json'"):
        write_atomically(tmp_path / "whole.json", b"{}")
    assert not list(tmp_path.iterdir())


def test_an_empty_variable_sets_no_place_of_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.setenv("HOUSEEXPO_CACHE", "")
    assert cache_folder("houses") == tmp_path / "user" / "houseexpo" / "houses"
