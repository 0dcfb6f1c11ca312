"""A file is written whole, and only where a file belongs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from houseexpo.files import write_whole


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
