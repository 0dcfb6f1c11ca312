"""A data set folder says how it was built, in words that build the same from any other folder."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from houseexpo.dataset.build_record import (
    FILE,
    BuildCommand,
    BuildRecord,
    is_own_build,
    read_build_record,
    write_build_record,
)
from houseexpo.dataset.manifest import manifest_path
from houseexpo.errors import ConfigError
from pipeline.cli_build import BuildRequest
from pipeline.cli_common import load_build_config

NOTHING: dict[str, Any] = {"sources": (), "limit": None, "seed": None, "furniture": None, "scale": None}
OUT = Path("/plans")


def work(given: dict[str, Any], config: Path | None = None, overrides: Path | None = None) -> BuildRequest:
    return BuildRequest(config, {**NOTHING, **given}, overrides, "plans", 1, "ray", "10.0.0.1:6379", rehash=False)


def test_options_that_were_given_are_given_again_but_not_where_the_work_is_done() -> None:
    found = work({"sources": ("procedural:3",), "limit": 1, "seed": 0, "scale": 1.0}).record(add=False)
    assert found == BuildRecord(BuildCommand(("procedural:3",), {"limit": "1", "scale": "1.0", "seed": "0"}))
    words = ["build", "--limit=1", "--scale=1.0", "--seed=0", "--out", "/plans", "--", "procedural:3"]
    assert found.commands(OUT) == [words]
    assert "--furniture" in work({"furniture": True}).record(add=True).commands(OUT)[0]
    assert "--add" in work({"furniture": True}).record(add=True).commands(OUT)[0]
    assert "--no-furniture" in work({"furniture": False}).record(add=False).commands(OUT)[0]


def test_paths_are_in_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "houses").mkdir()
    found = work({"sources": ("houses",)}, Path("homes.toml"), Path("mine.toml")).record(add=False).build
    assert found.sources == (str(tmp_path / "houses"),)
    assert found.options == {"config": str(tmp_path / "homes.toml"), "overrides": str(tmp_path / "mine.toml")}
    assert work({}, Path("homes.toml")).record(add=False).build.options == {"config": str(tmp_path / "homes.toml")}


def test_a_manifest_of_the_project_is_recorded_by_its_name() -> None:
    record = work({}, manifest_path("demo")).record(add=False)
    assert record == BuildRecord(BuildCommand((), {"config": "demo"}))
    assert record.build.words(OUT) == ["build", "--config=demo", "--out", str(OUT)]


def test_the_file_of_weights_is_in_full_and_given_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    record = work({"weights": Path("mine.toml")}).record(add=False)
    assert record.build.options == {"weights": str(tmp_path / "mine.toml")}
    assert f"--weights={tmp_path / 'mine.toml'}" in record.commands(OUT)[0]


def test_model_folders_are_in_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    full = f"{tmp_path / 'models'}{os.pathsep}{os.sep}far"
    given = {"model_path": f"models{os.pathsep}{os.sep}far"}
    assert work(given).record(add=False).build.options == {"model_path": full}
    with pytest.raises(ConfigError, match=f"model_path: expected a folder, found none at {tmp_path / 'models'}; check"):
        load_build_config(None, given)
    for folder in ("models", "far"):
        (tmp_path / folder).mkdir()
    given = {"model_path": f"models{os.pathsep}far"}
    assert load_build_config(None, given).build.model_path == f"{tmp_path / 'models'}{os.pathsep}{tmp_path / 'far'}"


def test_a_build_that_kept_the_plans_of_others_knows_how_these_were_made() -> None:
    a, b = BuildCommand(("a",), {"overrides": "/mine.toml"}), BuildCommand(("b",), {"add": "True"})
    added = BuildCommand(("a",), {"overrides": "/mine.toml", "add": "True"})
    first, second = BuildRecord(a), BuildRecord(b)
    assert second.with_earlier(None) == second
    both = second.with_earlier(first)
    assert both == BuildRecord(b, (added,))
    assert [words[-1] for words in both.commands(OUT)] == ["a", "b"]
    again = BuildRecord(added).with_earlier(both)
    assert again == BuildRecord(added, (b,))
    assert second.with_earlier(again) == both


def test_a_record_is_read_as_it_was_written_and_else_there_is_none(tmp_path: Path) -> None:
    (tmp_path / ".build").mkdir()
    assert read_build_record(tmp_path) is None
    record = BuildRecord(BuildCommand(("procedural:3",), {"seed": "2"}))
    write_build_record(tmp_path, record)
    assert read_build_record(tmp_path) == record
    file = tmp_path / FILE
    before = file.stat().st_mtime_ns
    write_build_record(tmp_path, record)
    assert file.stat().st_mtime_ns == before
    for other in (
        b'{"arguments": 3',
        b'{"arguments": ["houses"], "overrides": "/etc/x"}',
        b'{"build": {"sources": ["\\u0000"]}}',
    ):
        file.write_bytes(other)
        assert read_build_record(tmp_path) is None


def test_only_options_that_say_what_plans_are_like_are_taken_from_a_record() -> None:
    hostile = {
        "executor": "ray",
        "address": "10.0.0.1:6379",
        "out": "/home",
        "workers": "9",
        "seed": "1",
        "up": "--rehash",
    }
    found = BuildRecord(BuildCommand(("--verify", "houses"), hostile))
    assert found.commands(OUT) == [
        ["build", "--seed=1", "--up=--rehash", "--out", "/plans", "--", "--verify", "houses"]
    ]
    assert found.shell_lines(OUT) == ["houseexpo build --seed=1 --up=--rehash --out /plans -- --verify houses"]


def test_who_built_it_where_is_known_of_the_folder_alone(tmp_path: Path) -> None:
    plans, copy = tmp_path / "plans", tmp_path / "copy"
    (plans / ".build").mkdir(parents=True)
    record = BuildRecord(BuildCommand(("procedural:3",)))
    write_build_record(plans, record)
    shutil.copytree(plans, copy)
    assert is_own_build(plans, record)
    assert not is_own_build(copy, record)
    assert not is_own_build(plans, BuildRecord(BuildCommand(("procedural:4",))))
    (tmp_path / "link").symlink_to(plans)
    assert is_own_build(tmp_path / "link", record)
