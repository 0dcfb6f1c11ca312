"""Bad input through the command: each ends as one line that says why and what to do, and the batch goes on."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from pipeline.sources.procedural import write_house
from tests.builders.batch import contents, lines, one_room

RUN = CliRunner()


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
    result = RUN.invoke(make_app(), ["build", str(folder), "--out", str(data_set)])
    assert result.exit_code == 0, result.output
    assert "Traceback" not in result.output
    return data_set


def test_the_good_house_is_a_plan(out: Path) -> None:
    assert "json/good.json" in contents(out)


def test_every_bad_one_is_a_line_that_says_what_to_do(folder: Path, out: Path) -> None:
    rejected = {line["id"]: line for line in lines(out / "rejected.jsonl")}
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
    result = RUN.invoke(make_app(), ["build", str(root), "--out", str(tmp_path / "out")])
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


def test_a_data_set_inside_its_source_is_no_source(tmp_path: Path) -> None:
    one_room(tmp_path / "house.ply")
    command = ["build", str(tmp_path), "--workers", "1", "--out", str(tmp_path / "plans")]
    for _ in range(2):
        assert RUN.invoke(make_app(), command).exit_code == 0
        assert not lines(tmp_path / "plans" / "rejected.jsonl")
