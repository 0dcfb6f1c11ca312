"""The commands build, inspect and demo, and what they refuse."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.dataset import open_dataset
from pipeline.sources.files import id_from_file_name
from pipeline.terminal_report import describe_oddity
from tests.builders.batch import contents, lines, one_room
from tests.builders.commands import call
from tests.builders.formats import published_plans as published
from tests.builders.suncg_houses import write_house

runner = CliRunner()


@pytest.fixture
def houses(tmp_path: Path) -> Path:
    one_room(tmp_path / "houses" / "a.ply")
    one_room(tmp_path / "houses" / "b.ply", 4.0, 5.0)
    one_room(tmp_path / "houses" / "c.off", 7.0, 5.0)
    return tmp_path / "houses"


def shell(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *map(str, words)], capture_output=True, text=True, check=False)


def test_help_loads_nothing_heavy() -> None:
    heavy = "{'numpy', 'cv2', 'shapely', 'trimesh', 'pyarrow', 'numba', 'scipy', 'matplotlib', 'jinja2', 'networkx'}"
    code = (
        "import sys; from houseexpo.commands.app import make_app; make_app(); "
        f"print(sorted({heavy} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_to_list_and_read_a_drawing_loads_no_library_of_meshes(tmp_path):
    file = tmp_path / "model.svg"
    file.write_text(published.cubicasa(), encoding="utf-8")
    code = (
        "import sys; from pipeline.batch import build; from pipeline.sources import find, reader; "
        f"(item,) = find({str(file)!r}); list(reader(item.reader).read(item)); "
        "print(sorted({'trimesh', 'scipy', 'networkx', 'numba'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_build_shows_outcomes_and_writes_a_data_set(houses: Path, tmp_path: Path) -> None:
    (houses / "broken.obj").write_bytes(b"\x00\xff" * 50)
    done = shell("houseexpo", "build", houses, "--out", tmp_path / "out", "--workers", "1")
    assert done.returncode == 0, done.stderr
    out = str(tmp_path / "out")
    assert done.stdout.startswith("2 plans from 4 houses (2 doubtful, 1 duplicate, 1 rejected)")
    assert "rejected houses/broken.obj" in done.stdout
    assert re.search(r"^ *a +houses/a.ply +1 +\d+ +\d+ m²", done.stdout, re.MULTILINE)
    assert f"houseexpo serve {out}" in done.stdout.splitlines()[-2]
    for telemetry in ("Longest", "Outcomes", "planning"):
        assert telemetry not in done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert {"json/a.json", "json/c.json", "manifest.json"} <= set(contents(tmp_path / "out"))
    build = tmp_path / "out" / ".build"
    assert {"report.html", "journal.jsonl"} <= {file.name for file in build.iterdir()}
    assert {"a.svg", "b.png", "c.svg", "sheet.svg"} == {file.name for file in (build / "pictures").iterdir()}


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
        (["build", "HOUSES", "--out", "HOUSES"], "which is read and never written into"),
        (["build", "HOUSES", "--out", "OTHERS"], "expected an empty folder or an earlier build"),
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
    named = {"OUT": str(tmp_path / "out"), "OTHERS": str(tmp_path), "HOUSES": str(houses), "BAD": str(bad)}
    result = runner.invoke(make_app(), [named.get(word, word) for word in words])
    assert result.exit_code == 2
    assert said in " ".join(result.output.replace("│", " ").split())
    assert "Traceback" not in result.output
    assert not (tmp_path / "out").exists()


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


# ``houseexpo demo``: what it writes can be built, and what is there already stays.


def demo(*words: str | Path) -> tuple[int, str]:
    done = CliRunner().invoke(make_app(), ["demo", *map(str, words), "--workers", "1"])
    return done.exit_code, done.output


def test_it_writes_houses_and_plans_and_names_the_next_command(tmp_path: Path) -> None:
    code, said = demo(tmp_path / "try", "--plans", "2")
    assert code == 0, said
    assert {file.name for file in (tmp_path / "try").iterdir()} == {
        *("house.glb", "house.ifc", "houses", "houses.toml", "corrections.toml", "plans"),
    }
    assert len(open_dataset(tmp_path / "try" / "plans" / "demo")) == 2
    assert f"cd {tmp_path / 'try'} && houseexpo build house.glb --out plans/house" in said
    assert demo(tmp_path / "try", "--plans", "2")[0] == 0  # again: nothing is built or asked


def test_files_of_others_stay(tmp_path: Path) -> None:
    (tmp_path / "house.glb").write_text("mine")
    code, said = demo(tmp_path, "--plans", "0")
    assert code == 2
    assert "house.glb: a file is there already" in said.replace("\n", "")
    assert [file.name for file in tmp_path.iterdir()] == ["house.glb"]
    assert demo(tmp_path, "--plans", "0", "--replace")[0] == 0
    assert (tmp_path / "house.glb").read_bytes() != b"mine"


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


def test_what_the_reader_rejects_is_shown_from_above(tmp_path: Path) -> None:
    trimesh.creation.box((9.0, 6.0, 0.2)).export(tmp_path / "plate.ply")
    code, said, names = inspect(tmp_path / "plate.ply", tmp_path / "out")
    assert (code, names) == (1, ["rejected.png"])
    assert "rejected source" in " ".join(said.split())


@pytest.mark.slow
def test_corrections_of_other_houses_only_are_said_to_be_so(tmp_path: Path) -> None:
    file, words = one_room(tmp_path / "street" / "villa.ply"), tmp_path / "overrides.toml"
    words.write_text("[barn]\nno_room = [1.0, 1.0]\n")
    said = inspect(file, tmp_path / "out", "--overrides", str(words))[1]
    assert "no correction by hand is of this house" in said
    assert "'barn'" in said
    words.write_text("[villa]\nno_room = [1.0, 1.0]\n")
    said = inspect(file, tmp_path / "out", "--overrides", str(words))[1]
    assert "no correction by hand" not in said
    said = inspect(file.parent, tmp_path / "out", "--id", "villa", "--overrides", str(words))[1]
    assert "no correction by hand" not in said


def test_a_person_s_word_counts_as_in_a_build(tmp_path: Path) -> None:
    manifest = tmp_path / "manifest.toml"
    manifest.write_text("")
    path = one_room(tmp_path / "villa.ply")
    assert inspect(path, tmp_path / "before", "--config", str(manifest))[0] == 0
    (tmp_path / "overrides.toml").write_text(f"[{id_from_file_name(f'{tmp_path.name}/villa.ply')}]\nscale = 20.0\n")
    assert inspect(path, tmp_path / "after", "--config", str(manifest))[0] == 1  # a hall of 100 m, 54 m high


def test_a_level_that_is_not_there_is_a_usage_error(tmp_path: Path) -> None:
    code, said, names = inspect(one_room(tmp_path / "villa.ply"), tmp_path / "out", "--level", "3")
    assert (code, names) == (2, [])
    assert "level 3 asked for, found 1" in " ".join(said.split())


# Bad input through the command: each ends as one line that says why and what to do, and the batch goes on.


def scaled(path: Path, factor: float) -> None:
    mesh = trimesh.load(one_room(path), force="mesh")
    mesh.apply_scale([factor, factor, factor if factor < 1 else 1.0])
    mesh.export(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("bad") / "houses"
    one_room(root / "good.ply")
    whole = one_room(root / "truncated.ply").read_bytes()
    (root / "truncated.ply").write_bytes(whole[: len(whole) // 2])
    for suffix in ("ply", "obj", "glb", "gltf", "stl", "dae", "off", "ifc"):
        (root / f"empty_{suffix}.{suffix}").touch()
        (root / f"garbage_{suffix}.{suffix}").write_bytes(np.random.default_rng(1).bytes(500))
    (root / "no_faces.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\n")
    good = trimesh.load(one_room(root / "nan.off"), force="mesh")
    for name, value in (("nan", np.nan), ("infinite", np.inf)):
        vertices = good.vertices.copy()
        vertices[0, 0] = value
        rows = [" ".join(map(str, v)) for v in vertices] + [" ".join(map(str, [3, *f])) for f in good.faces]
        (root / f"{name}.off").write_text("\n".join(["OFF", f"{len(vertices)} {len(good.faces)} 0", *rows]))
    scaled(root / "long.ply", 250.0)
    return root


@pytest.fixture(scope="module")
def out(folder: Path) -> Path:
    data_set = folder.parent / "out"
    result = RUN.invoke(make_app(), ["build", str(folder), "--out", str(data_set), "--workers", "1"])
    assert result.exit_code == 0, result.output
    assert "Traceback" not in result.output
    return data_set


def test_every_bad_one_is_a_line_that_says_what_to_do(folder: Path, out: Path) -> None:
    rejected = {line["id"]: line for line in lines(out / "rejected.jsonl")}
    assert "json/good.json" in contents(out)
    bad = {file.stem for file in folder.iterdir()} - {"good"}
    assert set(rejected) == bad
    assert not [line for line in rejected.values() if line["reason"] == "internal" or not line["advice"]]
    expected = {
        **{name: "empty" for name in bad if name.startswith("empty")},
        "nan": "not_finite",
        "infinite": "not_finite",
        "no_faces": "empty",
    }
    assert {name: rejected[name]["reason"] for name in expected} == expected
    assert rejected["long"]["reason"] in {"too_large", "bad_units"}


def test_millimetres_taken_for_metres_are_rejected_and_left_alone_are_understood(tmp_path: Path) -> None:
    mesh = trimesh.load(one_room(tmp_path / "house.ply"), force="mesh")
    mesh.apply_scale(1000.0)
    mesh.export(tmp_path / "house.ply")
    command = ["build", str(tmp_path / "house.ply"), "--workers", "1", "--out"]
    assert RUN.invoke(make_app(), [*command, str(tmp_path / "forced"), "--units", "m"]).exit_code == 4
    [line] = lines(tmp_path / "forced" / "rejected.jsonl")
    assert line["reason"] in {"bad_units", "too_large"}
    assert "--units" in line["advice"] or "unit" in line["detail"]
    assert RUN.invoke(make_app(), [*command, str(tmp_path / "found")]).exit_code == 0
    assert not lines(tmp_path / "found" / "rejected.jsonl")


def test_a_suncg_root_with_broken_scenes(tmp_path: Path) -> None:
    root = tmp_path / "suncg"
    for index in range(4):
        write_house(root, index, 11)
    shutil.rmtree(root / "truth")
    scenes = sorted(folder.name for folder in (root / "house").iterdir())
    next((root / "room" / scenes[0]).glob("*w.obj")).unlink()
    (root / "house" / scenes[1] / "house.json").write_text('{"levels": [')
    (root / "house" / scenes[2] / "house.json").unlink()
    result = RUN.invoke(make_app(), ["build", str(root), "--out", str(tmp_path / "out"), "--workers", "1"])
    assert result.exit_code == 0, result.output
    reasons = {line["id"]: line["reason"] for line in lines(tmp_path / "out" / "rejected.jsonl")}
    assert reasons[scenes[1]] == "unreadable"
    assert {reasons[scenes[0]], reasons[scenes[2]]} == {"missing_file"}
    assert "internal" not in reasons.values()


@pytest.mark.parametrize("option", [("--units", "furlong"), ("--scale", "nan"), ("--storey-height", "-1")])
def test_an_impossible_size_is_refused_for_every_source(tmp_path: Path, option: tuple[str, str]) -> None:
    result = RUN.invoke(make_app(), ["build", "procedural:2", *option, "--out", str(tmp_path / "plans")])
    assert result.exit_code == 2
    assert "expected a number above 0" in result.stderr
    assert not (tmp_path / "plans").exists()


@pytest.mark.parametrize("other", [("--units", "mm"), ("--scale", "20")])
def test_two_options_that_say_how_large_a_house_is_are_refused(tmp_path: Path, other: tuple[str, str]) -> None:
    command = ["build", "procedural:2", "--storey-height", "2.6", *other, "--out", str(tmp_path / "plans")]
    result = RUN.invoke(make_app(), command)
    assert result.exit_code == 2
    assert f"expected one of storey_height and {other[0][2:]}, found both" in " ".join(result.stderr.split())
    assert not (tmp_path / "plans").exists()


def test_a_data_set_inside_its_source_is_no_source(tmp_path: Path) -> None:
    one_room(tmp_path / "in" / "house.ply")
    for source, out in (("in/house.ply", "in/plans"), ("in", "out"), ("in", "out")):
        command = ["build", str(tmp_path / source), "--workers", "1", "--out", str(tmp_path / out)]
        assert RUN.invoke(make_app(), command).exit_code == 0
        assert not lines(tmp_path / out / "rejected.jsonl")


# ``build`` and ``inspect`` as people type them.


@pytest.fixture
def street(tmp_path: Path) -> Path:
    one_room(tmp_path / "street" / "annexe.ply")
    one_room(tmp_path / "street" / "villa.ply", 7.0, 5.0)
    return tmp_path / "street"


def built(out: Path) -> list[str]:
    return [name for name in contents(out) if name.startswith("json/")]


@pytest.mark.parametrize(
    ("text", "said"), [("[vila]\ndrop = true\n", "did you mean 'villa'?"), (None, "cannot be read")]
)
def test_overrides_that_cannot_be_meant_are_refused(street: Path, tmp_path: Path, text: str | None, said: str) -> None:
    if text is not None:
        (tmp_path / "mine.toml").write_text(text)
    assert said in call("build", street, "--out", tmp_path / "out", "--overrides", tmp_path / "mine.toml", code=2)


def test_inspect_takes_the_house_of_an_id(street: Path, tmp_path: Path) -> None:
    assert "villa: the only level; house 2 of 2: villa" in call(
        "inspect", street, "--id", "villa", "--out", tmp_path / "out"
    )
    assert "the nearest is 'villa'" in call("inspect", street, "--id", "vila", "--out", tmp_path / "out", code=2)


def test_a_quiet_build_says_nothing_and_a_verbose_one_what_came_of_each_house(street: Path, tmp_path: Path) -> None:
    (street / "broken.obj").write_bytes(b"no mesh")

    command = ["build", street, "--workers", "1", "--out"]
    assert call(*command, tmp_path / "quiet", "-q") == ""
    loud = call(*command, tmp_path / "loud", "-v")
    assert "INFO pipeline: villa: street/villa.ply: plan, " in loud
    assert "INFO pipeline: broken: street/broken.obj: source: unreadable: " in loud
    assert "DEBUG" not in loud
    assert all(word in loud for word in ("Longest", "Outcomes", "duplicates"))


@pytest.mark.parametrize(
    ("rooms", "area_m2", "said"),
    [
        (1, 11990.0, "1 room of 11,990 m²"),
        (4, 2800.0, "4 rooms of 700 m² on average"),
        (5, 6.0, "5 rooms of 1.2 m² on average"),
        (0, 900.0, "1 room of 900 m²"),
        (1, 400.0, ""),
        (9, 90.0, ""),
    ],
)
def test_what_no_house_has_is_implausible(rooms: int, area_m2: float, said: str) -> None:
    assert describe_oddity(rooms, area_m2) == said


@pytest.mark.slow
def test_an_implausible_plan_is_warned_of(tmp_path: Path) -> None:
    one_room(tmp_path / "hall.ply", 110.0, 109.0)
    said = call("build", tmp_path / "hall.ply", "--out", tmp_path / "out", "--workers", "1")
    assert ": 1 room of 11,990 m²; check --units" in said
    assert "implausible 1 room of 11,990 m²" in call("inspect", tmp_path / "hall.ply", "--out", tmp_path / "pictures")


def test_ctrl_c_says_the_command_for_every_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("houseexpo.dataset.open_dataset", interrupted)
    monkeypatch.setattr(sys, "argv", ["houseexpo", "info", str(tmp_path)])
    assert f"the same command again: houseexpo info {tmp_path}" in call("info", tmp_path, code=130)


# Ctrl-C at any moment: a clean end within seconds, no process left, exit code 130, and the command that goes on.


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["starting", "importing", "locked", "working"])
def test_ctrl_c_ends_a_build_and_the_same_command_goes_on(moment: str, tmp_path: Path) -> None:
    journal = tmp_path / "out" / ".build" / "journal.jsonl"
    reached = {
        "starting": lambda worked: worked > 0.6,
        "importing": lambda worked: worked > 1.2,
        "locked": lambda _: journal.exists(),
        "working": lambda _: journal.exists() and journal.stat().st_size > 0,
    }[moment]
    command = [sys.executable, "-m", "houseexpo", "build", "procedural:500", "--out", str(tmp_path / "out")]
    build = psutil.Popen(command, stderr=-1, stdout=-1, start_new_session=True, text=True)
    while not reached(build.cpu_times().user):  # of its own time: on a loaded machine Python itself takes a second
        time.sleep(0.01)
    family = build.children(recursive=True)
    os.killpg(build.pid, signal.SIGINT)
    said = build.communicate(timeout=30.0)[1]
    assert build.returncode == 130
    assert "Traceback" not in said
    assert moment in {"starting", "importing"} or "this goes on with the rest: " in said
    _, alive = psutil.wait_procs(family, timeout=30.0)
    assert not alive


@pytest.mark.slow
def test_ctrl_c_that_a_library_swallows_ends_the_build_all_the_same(tmp_path: Path) -> None:
    code = """
import os, signal, time
from pipeline.cli_common import handle_ctrl_c
with handle_ctrl_c("last words"):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)
    except KeyboardInterrupt:
        pass
    time.sleep(60)
"""
    done = psutil.Popen([sys.executable, "-c", code], stderr=-1, text=True)
    assert done.communicate(timeout=30.0)[1] == "last words\n"
    assert done.returncode == 130


def test_verify_says_what_is_damaged_and_ends_with_1(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    from houseexpo.commands.app import make_app

    house, out = str(one_room(tmp_path / "house.ply")), str(tmp_path / "out")
    run = CliRunner()
    assert run.invoke(make_app(), ["build", house, "--out", out]).exit_code == 0
    assert "nothing to do" in run.invoke(make_app(), ["build", house, "--out", out]).output
    before = contents(tmp_path / "out")
    assert run.invoke(make_app(), ["build", "--verify", out]).exit_code == 0
    [plan] = (tmp_path / "out" / "json").iterdir()
    plan.write_text("{}")
    found = run.invoke(make_app(), ["build", "--verify", out])
    assert (found.exit_code, plan.name in found.output) == (1, True)
    assert run.invoke(make_app(), ["build", house, "--out", out]).exit_code == 0
    assert contents(tmp_path / "out") == before
