from __future__ import annotations

from pathlib import Path

from PIL import Image
from typer.testing import CliRunner

from houseexpo.cli import make_app
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
    stages = ["door_plane", "ground_plane", "layout", "doors", "contour", "cells", "isolated", "connectivity", "refine"]
    assert names == [f"{i:02d}_{stage}.png" for i, stage in enumerate([*stages, "plan"])] + ["stages.png"]
    for name in names:
        with Image.open(tmp_path / "out" / name) as image:
            assert min(image.size) > 100


def test_a_rejected_house_keeps_the_pictures_it_earned(tmp_path: Path) -> None:
    giant = tmp_path / "giant.toml"
    giant.write_text("[connectivity]\nrobot_radius_m = 9.0\n")
    code, said, names = inspect(one_room(tmp_path / "villa.ply"), tmp_path / "out", "--config", str(giant))
    assert code == 0
    assert "rejected" in said
    assert "no_room_fits" in said
    assert "02_layout.png" in names
    assert "09_plan.png" not in names


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    (tmp_path / "broken.ply").write_bytes(b"no mesh")
    code, said, names = inspect(tmp_path / "broken.ply", tmp_path / "out")
    assert (code, names) == (0, [])
    assert "unreadable" in said


def test_a_level_that_is_not_there_is_a_usage_error(tmp_path: Path) -> None:
    code, said, names = inspect(one_room(tmp_path / "villa.ply"), tmp_path / "out", "--level", "3")
    assert (code, names) == (2, [])
    assert "level 3 asked for, found 1" in " ".join(said.split())
