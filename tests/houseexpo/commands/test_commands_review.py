"""``houseexpo review``: what is built, what is opened, and what is said; the end to end test is in a browser."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("starlette")

from houseexpo.commands import review as command
from houseexpo.errors import ConfigError
from houseexpo.service.service import Service
from tests.builders.examples import FOLDER
from tests.builders.services import built, some_plans


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path / "cache"


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[Service]:
    """The services that would run."""
    found: list[Service] = []
    monkeypatch.setattr(command, "run_service", lambda service, _: found.append(service))
    return found


def run(*words: object) -> Any:
    app = typer.Typer()
    app.command()(command.review)
    return CliRunner().invoke(app, [*map(str, words)], catch_exceptions=False)


def test_a_data_set_is_opened_as_it_is(tmp_path: Path, started: list[Service]) -> None:
    folder = built(tmp_path / "homes", some_plans())
    before = sorted(folder.rglob("*"))
    result = run(folder)
    assert result.exit_code == 0
    assert "homes: 4 plans" in result.output
    assert f"decisions go to {folder / 'overrides.toml'}" in result.output
    settings = started[0].settings
    assert f"open http://127.0.0.1:{settings.port}/homes/review in a browser" in result.output
    assert settings.review
    assert sorted(folder.rglob("*")) == before


def test_weights_that_are_none_are_told_before_anything_is_built(tmp_path: Path, started: list[Service]) -> None:
    (tmp_path / "mine.toml").write_text("[door]\n")
    with pytest.raises(ConfigError, match=r"mine\.toml: door\.bias: expected a value"):
        run(FOLDER, "--weights", tmp_path / "mine.toml", "--out", tmp_path / "out")
    assert not started
    assert not (tmp_path / "out" / "manifest.json").exists()


def test_what_does_not_exist_is_said(tmp_path: Path, started: list[Service]) -> None:
    with pytest.raises(ConfigError, match=r"nothing\.ifc"):
        run(tmp_path / "nothing.ifc")
    assert not started


@pytest.mark.slow
def test_a_file_is_built_once_in_the_cache(tmp_path: Path, cache: Path, started: list[Service]) -> None:
    house = FOLDER / "house.ifc"
    first = run(house, "--workers", 1)
    assert first.exit_code == 0, first.output
    (folder,) = cache.glob("reviews/*/house")
    assert f"decisions go to {folder / 'overrides.toml'}" in first.output
    (plan,) = folder.glob("json/*.json")
    written = plan.stat().st_mtime_ns
    assert run(house, "--workers", 1).exit_code == 0
    assert plan.stat().st_mtime_ns == written
    assert [list(service.collections) for service in started] == [["house"], ["house"]]


@pytest.mark.slow
def test_a_folder_is_built_where_out_says(tmp_path: Path, cache: Path, started: list[Service]) -> None:
    houses = tmp_path / "houses"
    houses.mkdir()
    for name in ("house.ifc", "houses/home.sh3d"):
        shutil.copy(FOLDER / name, houses)
    result = run(houses, "--out", tmp_path / "plans", "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "plans: 2 plans" in result.output
    assert not list(cache.glob("reviews/*"))


@pytest.mark.slow
def test_a_house_that_gives_no_plan_is_said_with_the_reason_and_opened(tmp_path: Path, started: list[Service]) -> None:
    (tmp_path / "broken.glb").write_bytes(b"glTF" + b"\0" * 40)
    result = run(tmp_path / "broken.glb", "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "broken: unreadable" in result.output
    assert [list(service.collections) for service in started] == [["broken"]]


def test_the_browser_is_opened_where_there_is_one(
    tmp_path: Path, started: list[Service], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(command.webbrowser, "open", opened.append)
    folder = built(tmp_path / "homes", some_plans())
    run(folder)
    assert opened == []  # no window can be opened
    monkeypatch.setenv("DISPLAY", ":0")
    run(folder, "--no-open")
    assert opened == []
    run(folder)
    assert opened == [f"http://127.0.0.1:{started[-1].settings.port}/homes/review"]


@pytest.mark.parametrize(
    ("sources", "name"), [(["a/My house.ifc"], "My house"), (["procedural:3"], "procedural-3"), (["/"], "houses")]
)
def test_the_folder_is_named_after_the_house(sources: list[str], name: str) -> None:
    assert command.build_folder(sources).name == name
    assert command.build_folder(sources) != command.build_folder([*sources, "b.ifc"])
