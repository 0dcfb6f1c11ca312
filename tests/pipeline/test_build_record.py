"""A data set folder says how it was built, in words that build the same from any other folder."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from houseexpo.dataset.build_record import BuildRecord, record_build, recorded_build
from houseexpo.dataset.manifest import manifest_path
from pipeline.cli_build import Work
from pipeline.cli_parts import settings_of

NOTHING: dict[str, Any] = {"sources": (), "limit": None, "seed": None, "furniture": None, "scale": None}


def work(given: dict[str, Any], config: Path | None = None, overrides: Path | None = None) -> Work:
    return Work(config, {**NOTHING, **given}, overrides, "plans", 1, "local", None, rehash=False)


def test_options_that_were_given_are_given_again() -> None:
    found = work({"sources": ("procedural:3",), "limit": 1, "seed": 0, "scale": 1.0}).record(add=False)
    assert found == BuildRecord(("procedural:3", "--limit", "1", "--scale", "1.0", "--seed", "0"))
    assert work({"furniture": True}).record(add=True).arguments == ("--furniture", "--add")
    assert work({"furniture": False}).record(add=False).arguments == ("--no-furniture",)


def test_paths_are_in_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "houses").mkdir()
    found = work({"sources": ("houses",)}, Path("homes.toml")).record(add=False)
    assert found.arguments == (str(tmp_path / "houses"), "--config", str(tmp_path / "homes.toml"))
    assert found.overrides == str(tmp_path / "overrides.toml")
    (tmp_path / "homes.overrides.toml").touch()
    found = work({}, Path("homes.toml")).record(add=False)
    assert found.overrides == str(tmp_path / "homes.overrides.toml")
    assert work({}, Path("homes.toml"), Path("mine.toml")).record(add=False).overrides == str(tmp_path / "mine.toml")


def test_a_manifest_of_the_project_is_recorded_by_its_name_and_keeps_no_decisions(tmp_path: Path) -> None:
    found = work({}, manifest_path("demo"))
    assert found.record(add=False) == BuildRecord(("--config", "demo"))
    own = work({}, manifest_path("free35k")).record(add=False).overrides
    assert own == str(manifest_path("free35k").with_name("free35k.overrides.toml"))
    found = replace(found, out=str(tmp_path))
    assert found.own_overrides() is None
    (tmp_path / "overrides.toml").touch()  # a review's decisions lie in the data set
    assert found.own_overrides() == tmp_path / "overrides.toml"


def test_model_folders_are_in_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    full = f"{tmp_path / 'models'}{os.pathsep}{os.sep}far"
    given = {"model_path": f"models{os.pathsep}{os.sep}far"}
    assert work(given).record(add=False).arguments == ("--model-path", full)
    assert settings_of(None, given).build.model_path == full


def test_a_build_that_kept_the_plans_of_others_knows_how_these_were_made() -> None:
    first, second = BuildRecord(("a",)), BuildRecord(("b", "--add"))
    assert second.beside(None) == second
    both = second.beside(first)
    assert both.commands() == (("a", "--add"), ("b", "--add"))
    again = BuildRecord(("a", "--add")).beside(both)
    assert again.commands() == (("b", "--add"), ("a", "--add"))
    assert second.beside(again) == both


def test_earlier_builds_keep_the_file_that_corrected_them() -> None:
    first = BuildRecord(("a",), "/mine.toml")
    assert BuildRecord(("b", "--add")).beside(first) == BuildRecord(("b", "--add"), "/mine.toml", (("a", "--add"),))
    other = BuildRecord(("b", "--add"), "/other.toml")
    assert other.beside(first) == other


def test_a_record_is_read_as_it_was_written_and_else_there_is_none(tmp_path: Path) -> None:
    (tmp_path / ".build").mkdir()
    assert recorded_build(tmp_path) is None
    record = BuildRecord(("procedural:3",), "/somewhere/overrides.toml")
    record_build(tmp_path, record)
    assert recorded_build(tmp_path) == record
    file = tmp_path / ".build" / "command.json"
    before = file.stat().st_mtime_ns
    record_build(tmp_path, record)
    assert file.stat().st_mtime_ns == before
    file.write_bytes(b'{"arguments": 3')
    assert recorded_build(tmp_path) is None
