"""The command as a person uses it, in its own process where that matters."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from tests.builders.batch import contents, lines, one_room

runner = CliRunner()


@pytest.fixture
def houses(tmp_path: Path) -> Path:
    one_room(tmp_path / "houses" / "a.ply")
    one_room(tmp_path / "houses" / "b.ply", 4.0, 5.0)
    one_room(tmp_path / "houses" / "c.off", 7.0, 5.0)
    return tmp_path / "houses"


def shell(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *map(str, words)], capture_output=True, text=True, check=False)


def test_help_names_the_commands() -> None:
    done = shell("houseexpo", "--help")
    assert done.returncode == 0
    assert "build" in done.stdout
    assert "inspect" in done.stdout


def test_help_loads_nothing_heavy() -> None:
    heavy = "{'numpy', 'cv2', 'shapely', 'trimesh', 'pyarrow', 'numba', 'scipy'}"
    code = (
        "import sys; from houseexpo.commands.app import make_app; make_app(); "
        f"print(sorted({heavy} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_build_shows_outcomes_and_writes_a_data_set(houses: Path, tmp_path: Path) -> None:
    (houses / "broken.obj").write_bytes(b"\x00\xff" * 50)
    done = shell("houseexpo", "build", houses, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    out = str(tmp_path / "out")
    assert done.stdout.startswith("2 plans from 4 houses (2 doubtful, 1 duplicate, 1 rejected)")
    assert "rejected houses/broken.obj" in done.stdout
    assert re.search(r"^ *a +houses/a.ply +1 +\d+ +\d+ m2", done.stdout, re.MULTILINE)
    assert f"houseexpo serve {out}" in done.stdout.splitlines()[-2]
    for telemetry in ("Longest", "Outcomes", "planning"):
        assert telemetry not in done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert {"json/a.json", "json/c.json", "manifest.json"} <= set(contents(tmp_path / "out"))
    build = tmp_path / "out" / ".build"
    assert {"report.html", "journal.jsonl"} <= {file.name for file in build.iterdir()}
    assert {"a.png", "b.png", "c.png", "sheet.png"} == {file.name for file in (build / "pictures").iterdir()}


@pytest.mark.slow
def test_python_m_pipeline_is_the_same(houses: Path, tmp_path: Path) -> None:
    assert shell("houseexpo", "build", houses, "--out", tmp_path / "one").returncode == 0
    assert shell("pipeline", houses, "--out", tmp_path / "two", "--workers", "2").returncode == 0
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


@pytest.mark.slow
def test_a_manifest_says_it_all_and_the_command_line_wins(houses: Path, tmp_path: Path) -> None:
    manifest = tmp_path / "manifest.toml"
    manifest.write_text('[build]\nsources = ["houses"]\nlimit = 1\n')
    (tmp_path / "overrides.toml").write_text("[b]\nkeep = true\n")
    command = ["build", "--config", str(manifest), "--out", str(tmp_path / "out"), "--workers", "1"]
    assert runner.invoke(make_app(), command).exit_code == 0
    assert [line for line in contents(tmp_path / "out") if line.startswith("json")] == ["json/a.json"]
    assert runner.invoke(make_app(), [*command, "--limit", "3"]).exit_code == 0
    assert "json/b.json" in contents(tmp_path / "out")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["build", "nowhere", "--out", "OUT"], "'nowhere' does not exist"),
        (["build", "nowhere.glb", "--out", "OUT"], "'nowhere.glb' does not exist"),
        (["build", "--out", "OUT"], "no SOURCE"),
        (["build", "procedural:none", "--out", "OUT"], "procedural:COUNT"),
        (["build", "HOUSES", "--out", "HOUSES"], "expected an empty folder or an earlier build"),
        (["build", "HOUSES", "--out", "OUT", "--config", "BAD"], "did you mean 'planes.door_m'?"),
        (["build", "HOUSES", "--out", "OUT", "--config", "dmo"], "did you mean --config demo?"),
        (["build", "HOUSES"], "--out"),
        (["build", "HOUSES", "--out", "OUT", "--workers", "0"], "--workers"),
        (["build", "HOUSES", "--out", "OUT", "--up", "x"], "--up"),
        (["bild"], "bild"),
    ],
)
def test_a_usage_error_says_what_to_do_and_ends_with_2(
    houses: Path, tmp_path: Path, words: list[str], said: str
) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text("[planes]\ndor_m = 0.2\n")
    named = {"OUT": str(tmp_path / "out"), "HOUSES": str(houses), "BAD": str(bad)}
    result = runner.invoke(make_app(), [named.get(word, word) for word in words])
    assert result.exit_code == 2
    assert said in " ".join(result.output.replace("│", " ").split())
    assert "Traceback" not in result.output
    assert not (tmp_path / "out").exists()


def test_v_says_what_took_how_long_and_what_rules_did(houses: Path, tmp_path: Path) -> None:
    command = ["build", str(houses), "--out", str(tmp_path / "out"), "--workers", "1", "-v"]
    said = runner.invoke(make_app(), command).output
    assert all(word in said for word in ("Longest", "Outcomes", "duplicates", " s "))


def test_a_build_of_which_nothing_became_a_plan_ends_with_4(houses: Path, tmp_path: Path) -> None:
    (tmp_path / "none.ply").touch()
    command = ["build", str(tmp_path / "none.ply"), "--workers", "1", "--out", str(tmp_path / "out")]
    for _ in range(2):  # as often as it is asked
        result = runner.invoke(make_app(), command)
        assert result.exit_code == 4
        assert "no plan from 1 house (1 rejected)" in result.output
        assert "nothing became a plan" in result.stderr
        assert "houseexpo serve" not in result.output
    added = ["build", str(houses), "--workers", "1", "--out", str(tmp_path / "street")]
    assert runner.invoke(make_app(), added).exit_code == 0
    beside = ["build", str(tmp_path / "none.ply"), "--workers", "1", "--out", str(tmp_path / "street"), "--add"]
    assert runner.invoke(make_app(), beside).exit_code == 4
    [line] = lines(tmp_path / "out" / "rejected.jsonl")
    assert (line["stage"], line["reason"]) == ("source", "empty")
    assert "none.ply" in result.output


def test_a_second_source_is_refused_added_or_put_in_the_place_of_the_first(houses: Path, tmp_path: Path) -> None:
    def run(*words: str) -> tuple[int, set[str]]:
        command = ["build", *words, "--out", str(tmp_path / "out"), "--workers", "1"]
        plans = {name for name in contents(tmp_path / "out") if name.startswith("json/")}
        return runner.invoke(make_app(), command).exit_code, plans

    first, second = str(houses / "a.ply"), str(houses / "c.off")
    run(first)
    assert run(second)[0] == 2
    assert run(second, "--add", "--replace")[0] == 2
    assert run(second, "--add") == (0, {"json/houses_a.json"})
    assert run(second, "--replace") == (0, {"json/houses_a.json", "json/houses_c.json"})
    assert run(second) == (0, {"json/houses_c.json"})


def test_what_is_built_is_said_once(houses: Path, tmp_path: Path) -> None:
    said = runner.invoke(make_app(), ["build", str(houses), "--out", str(tmp_path / "out"), "--workers", "1"]).output
    assert said.count("on average") == 1
    assert "Labels" not in said  # those are the business of `houseexpo stats`


@pytest.mark.slow
def test_of_many_plans_the_first_are_named(tmp_path: Path) -> None:
    command = ["build", "procedural:13", "--out", str(tmp_path / "out"), "--workers", "1"]
    said = runner.invoke(make_app(), command).output
    ids = sorted(Path(name).stem for name in contents(tmp_path / "out") if name.startswith("json/"))
    assert [name for name in ids if name in said] == ids[:8]
    assert f"and {len(ids) - 8} more in" in said
