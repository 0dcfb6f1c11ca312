from __future__ import annotations

from pathlib import Path

import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from pipeline.sources.files import base_id
from tests.builders.batch import one_room

RUN = CliRunner()


def inspect(source: Path | str, out: Path, *more: str) -> tuple[int, str, list[str]]:
    result = RUN.invoke(make_app(), ["inspect", str(source), "--out", str(out), *more])
    assert "Traceback" not in result.output
    return result.exit_code, result.output, sorted(file.name for file in out.glob("*.png"))


def test_a_picture_for_each_stage_and_one_sheet(tmp_path: Path) -> None:
    code, said, names = inspect(one_room(tmp_path / "villa.ply"), tmp_path / "out")
    assert code == 0
    assert "plan" in said
    stages = ["evidence", "door_plane", "ground_plane", "layout", "doors", "contour", "cells", "isolated"]
    stages += ["connectivity", "refine"]
    assert names == [f"{i:02d}_{stage}.png" for i, stage in enumerate([*stages, "plan"])] + ["stages.png"]
    for name in names:
        with Image.open(tmp_path / "out" / name) as image:
            assert min(image.size) > 100


def test_a_rejected_house_keeps_the_pictures_it_earned(tmp_path: Path) -> None:
    giant = tmp_path / "giant.toml"
    giant.write_text("[connectivity]\nrobot_radius_m = 9.0\n")
    code, said, names = inspect(one_room(tmp_path / "villa.ply"), tmp_path / "out", "--config", str(giant))
    assert code == 1
    assert "rejected" in said
    assert "no_room_fits" in said
    assert "03_layout.png" in names
    assert "10_plan.png" not in names


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    (tmp_path / "broken.ply").write_bytes(b"no mesh")
    code, said, names = inspect(tmp_path / "broken.ply", tmp_path / "out")
    assert (code, names) == (1, [])
    assert "unreadable" in said


def test_what_the_reader_rejects_is_shown_from_above(tmp_path: Path) -> None:
    trimesh.creation.box((9.0, 6.0, 0.2)).export(tmp_path / "plate.ply")
    code, said, names = inspect(tmp_path / "plate.ply", tmp_path / "out")
    assert (code, names) == (1, ["rejected.png"])
    assert "rejected source" in " ".join(said.split())


def test_corrections_of_other_houses_only_are_said_to_be_so(tmp_path: Path) -> None:
    file, words = one_room(tmp_path / "street" / "villa.ply"), tmp_path / "overrides.toml"
    words.write_text("[villa]\nno_room = [1.0, 1.0]\n")
    said = inspect(file, tmp_path / "out", "--overrides", str(words))[1]
    assert "no correction by hand is of this house" in said
    assert "'villa'" in said
    said = inspect(file.parent, tmp_path / "out", "--id", "villa", "--overrides", str(words))[1]
    assert "no correction by hand" not in said


@pytest.mark.slow
def test_it_says_which_house_and_which_level_it_shows(tmp_path: Path) -> None:
    one_room(tmp_path / "street" / "villa.ply")
    code, said, _ = inspect(tmp_path / "street" / "villa.ply", tmp_path / "out")
    assert code == 0
    assert "street_villa: the only level" in said
    one_room(tmp_path / "street" / "annexe.ply")
    _, said, _ = inspect(tmp_path / "street", tmp_path / "out")
    assert "annexe: the only level; house 1 of 2: annexe" in said


def test_a_person_s_word_counts_as_in_a_build(tmp_path: Path) -> None:
    manifest = tmp_path / "manifest.toml"
    manifest.write_text("")
    path = one_room(tmp_path / "villa.ply")
    assert inspect(path, tmp_path / "before", "--config", str(manifest))[0] == 0
    (tmp_path / "overrides.toml").write_text(f"[{base_id(f'{tmp_path.name}/villa.ply')}]\nscale = 20.0\n")
    assert inspect(path, tmp_path / "after", "--config", str(manifest))[0] == 1  # a hall of 100 m, 54 m high


def test_a_level_that_is_not_there_is_a_usage_error(tmp_path: Path) -> None:
    code, said, names = inspect(one_room(tmp_path / "villa.ply"), tmp_path / "out", "--level", "3")
    assert (code, names) == (2, [])
    assert "level 3 asked for, found 1" in " ".join(said.split())
