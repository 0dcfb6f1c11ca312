"""A file is written whole, and only where a file belongs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from houseexpo.files import make_folder, write_whole


def test_what_is_no_file_is_left_alone(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name, what in {"pipe": "a device or a pipe", "folder": "a folder"}.items():
        with pytest.raises(ConfigError, match=f"{name}: expected a regular file or a new one, found {what}"):
            write_whole(tmp_path / name, b"x")
    with pytest.raises(ConfigError, match="/dev/null"):
        write_whole(Path("/dev/null"), b"x")
    assert (tmp_path / "pipe").is_fifo()


def test_a_file_is_replaced_by_a_whole_one(tmp_path: Path) -> None:
    for data in (b"first", b"second"):
        write_whole(tmp_path / "a.json", data)
        assert (tmp_path / "a.json").read_bytes() == data
    assert list(tmp_path.iterdir()) == [tmp_path / "a.json"]


def test_a_folder_is_made_where_no_file_lies(tmp_path: Path) -> None:
    assert make_folder(make_folder(tmp_path / "new" / "one")).is_dir()
    (tmp_path / "taken").write_text("mine")
    for name in ("taken", "taken/inner/most"):
        with pytest.raises(ConfigError, match=r"expected a folder or nothing, found the file .*/taken; name another"):
            make_folder(tmp_path / name)
    assert (tmp_path / "taken").read_text() == "mine"
