"""``build`` and ``inspect`` as people type them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from houseexpo import progress
from houseexpo.commands.app import make_app
from houseexpo.plan import Frame
from pipeline.inspection import _number
from pipeline.report import implausible
from pipeline.values import Input, Level, Mesh
from tests.builders.batch import contents, one_room

FRAME = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)


def call(*words: str | Path, code: int = 0) -> str:
    done = CliRunner().invoke(make_app(), [str(word) for word in words], env={"COLUMNS": "200"})
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture
def street(tmp_path: Path) -> Path:
    one_room(tmp_path / "street" / "annexe.ply")
    one_room(tmp_path / "street" / "villa.ply", 7.0, 5.0)
    return tmp_path / "street"


def built(out: Path) -> list[str]:
    return [name for name in contents(out) if name.startswith("json/")]


def test_overrides_need_no_manifest(street: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("[villa]\ndrop = true\n")
    call("build", street, "--out", tmp_path / "out", "--workers", "1", "--overrides", tmp_path / "mine.toml")
    assert built(tmp_path / "out") == ["json/annexe.json"]


@pytest.mark.parametrize(
    ("text", "said"), [("[vila]\ndrop = true\n", "did you mean 'villa'?"), (None, "cannot be read")]
)
def test_overrides_that_cannot_be_meant_are_refused(street: Path, tmp_path: Path, text: str | None, said: str) -> None:
    if text is not None:
        (tmp_path / "mine.toml").write_text(text)
    assert said in call("build", street, "--out", tmp_path / "out", "--overrides", tmp_path / "mine.toml", code=2)


@pytest.mark.slow
def test_overrides_count_where_a_house_is_inspected(street: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("[annexe]\nscale = 20.0\n")
    call("inspect", street, "--out", tmp_path / "out", "--overrides", tmp_path / "mine.toml", code=1)
    call("inspect", street, "--out", tmp_path / "out")


def test_inspect_takes_the_house_of_an_id(street: Path, tmp_path: Path) -> None:
    assert "villa: the only level; house 2 of 2: villa" in call(
        "inspect", street, "--id", "villa", "--out", tmp_path / "out"
    )
    assert "the nearest is 'villa'" in call("inspect", street, "--id", "vila", "--out", tmp_path / "out", code=2)


@pytest.mark.parametrize(
    ("name", "number"), [("inn", 1), ("inn_L0", 0), ("inn_L2", 2), ("inn_B2_L2", 2), ("inn_B2", 1), (None, 1)]
)
def test_inspect_takes_the_level_of_an_id(name: str | None, number: int) -> None:
    levels = [Level(f"inn_L{i}", Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64)), 2.7, FRAME) for i in range(3)]
    assert _number(Input("inn", "mesh_file", "inn.glb"), levels, 1, name) == number


@pytest.mark.slow
def test_show_and_inspect_have_a_progress_bar(street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bars: list[str] = []

    def track(items: object, description: str, **_: object) -> object:
        bars.append(description)
        return items

    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=SimpleNamespace(isatty=lambda: True)))
    monkeypatch.setattr("rich.progress.track", track)
    call("inspect", street, "--out", tmp_path / "out")
    call("build", street, "--out", tmp_path / "plans", "--workers", "1")
    call("show", tmp_path / "plans", "--out", tmp_path / "sheet.png", "--size", "100")
    assert {"reading annexe", "planning annexe", "drawing"} <= set(bars)
    bars.clear()
    call("show", tmp_path / "plans", "--out", tmp_path / "sheet.png", "--size", "100", "-q")
    assert bars == []


def test_a_quiet_build_says_nothing_and_a_verbose_one_what_came_of_each_house(street: Path, tmp_path: Path) -> None:
    (street / "broken.obj").write_bytes(b"no mesh")

    command = ["build", street, "--workers", "1", "--out"]
    assert call(*command, tmp_path / "quiet", "-q") == ""
    loud = call(*command, tmp_path / "loud", "-v")
    assert "INFO pipeline: villa: street/villa.ply: plan, " in loud
    assert "INFO pipeline: broken: street/broken.obj: source: unreadable: " in loud
    assert "DEBUG" not in loud


@pytest.mark.parametrize(
    ("rooms", "area_m2", "said"),
    [
        (1, 11990.0, "1 room of 11,990 m2"),
        (4, 2800.0, "4 rooms of 700 m2 on average"),
        (5, 6.0, "5 rooms of 1.2 m2 on average"),
        (0, 900.0, "1 room of 900 m2"),
        (1, 400.0, ""),
        (9, 90.0, ""),
    ],
)
def test_what_no_house_has_is_implausible(rooms: int, area_m2: float, said: str) -> None:
    assert implausible(rooms, area_m2) == said


@pytest.mark.slow
def test_an_implausible_plan_is_warned_of(tmp_path: Path) -> None:
    one_room(tmp_path / "hall.ply", 110.0, 109.0)
    said = call("build", tmp_path / "hall.ply", "--out", tmp_path / "out", "--workers", "1")
    (name,) = (Path(file).stem for file in built(tmp_path / "out"))
    assert f"implausible: {name}: 1 room of 11,990 m2; check --units" in said
    assert "implausible 1 room of 11,990 m2" in call("inspect", tmp_path / "hall.ply", "--out", tmp_path / "pictures")
    one_room(tmp_path / "house.ply")
    assert "implausible:" not in call("build", tmp_path / "house.ply", "--out", tmp_path / "two", "--workers", "1")


def test_every_summary_has_the_id_beside_the_file(street: Path, tmp_path: Path) -> None:
    (street / "broken.obj").write_bytes(b"no mesh")
    said = call("build", street, "--out", tmp_path / "out", "--workers", "1")
    assert "rejected street/broken.obj (broken): " in said
    rows = [line.split() for line in said.splitlines()]
    assert ["villa", "street/villa.ply"] in [row[:2] for row in rows]


def test_usage_of_python_m_pipeline_is_that_of_the_command() -> None:
    done = subprocess.run([sys.executable, "-m", "pipeline", "--help"], capture_output=True, text=True, check=True)
    assert "Usage: houseexpo build [OPTIONS] [SOURCE]..." in done.stdout


def test_ctrl_c_says_the_command_for_every_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("houseexpo.dataset.open_dataset", interrupted)
    monkeypatch.setattr(sys, "argv", ["houseexpo", "info", str(tmp_path)])
    assert f"the same command again: houseexpo info {tmp_path}" in call("info", tmp_path, code=130)
