"""Links in a folder of sources: those to files are followed, the others are named, and so are pipes."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from pipeline.terminal_report import notes_lines
from tests.builders.batch import one_room, run_build


def test_links_to_folders_and_to_nothing_are_named_and_links_to_files_are_followed(tmp_path: Path) -> None:
    one_room(tmp_path / "elsewhere" / "a.ply")
    one_room(tmp_path / "elsewhere" / "b.ply", 6.0)
    street = tmp_path / "street"
    street.mkdir()
    (street / "a.ply").symlink_to(tmp_path / "elsewhere" / "a.ply")
    (street / "gone.ply").symlink_to(tmp_path / "nowhere.ply")
    (street / "inner").mkdir()
    (street / "inner" / "all").symlink_to(tmp_path / "elsewhere")
    (street / "round").symlink_to(street)
    os.mkfifo(street / "pipe.ply")
    found = run_build([street], tmp_path / "out")
    assert len(found.ids) == 1
    (said,) = notes_lines(found)
    names = "gone.ply, inner/all, pipe.ply, round"
    assert said.startswith(f"links to folders or to nothing, pipes and devices are not read: {names}; name what")
    assert found.links == ("gone.ply", "inner/all", "pipe.ply", "round")


def test_a_folder_of_nothing_but_such_links_is_refused_with_their_names(tmp_path: Path) -> None:
    (tmp_path / "street").mkdir()
    (tmp_path / "street" / "gone.ply").symlink_to(tmp_path / "nowhere.ply")
    with pytest.raises(ConfigError, match=r"pipes and devices are not read: gone\.ply; name"):
        run_build([tmp_path / "street"], tmp_path / "out")
