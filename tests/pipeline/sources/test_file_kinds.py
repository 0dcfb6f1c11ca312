"""Files under another format's name: their first bytes say what they are, and the plan says so."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from houseexpo.exports.formats import export
from houseexpo.file_kinds import format_note, format_suffix, xml_root
from houseexpo.floorplan import load_plan
from houseexpo.grids.robot_map import read_map
from pipeline.sources.meshes.formats import SUFFIXES
from tests.builders.batch import run_build
from tests.builders.houses import levels_of
from tests.builders.meshes import one_level, write
from tests.builders.plan_files import house
from tests.builders.tries import slow_but

NAMES = ("house.ply", "house.obj", "house.glb", "house.gltf", "house.stl", "house.off", "house.dae", "house.ifc",
         "house.dxf", "house.bak", "house", "house.json", "house.txt", "house.usdc", "house.png")  # fmt: skip


@pytest.mark.parametrize("suffix", [each for each in SUFFIXES if each not in {".dae", ".gltf"}])
@pytest.mark.parametrize("name", slow_but(NAMES, "house.ply", "house.json", "house"))
def test_a_mesh_is_read_as_what_it_is(tmp_path: Path, suffix: str, name: str) -> None:
    true = write(one_level(), tmp_path / f"true{suffix}")
    (expected,) = levels_of(true)
    (tmp_path / "folder").mkdir()
    path = (tmp_path / "folder" / name).absolute()
    path.write_bytes(true.read_bytes())
    assert format_suffix(path) == suffix
    for source in (path, path.parent):
        (found,) = levels_of(source)
        assert np.array_equal(found.walls.vertices, expected.walls.vertices)
        assert (found.frame, found.ceiling_m) == (expected.frame, expected.ceiling_m)
    assert bool(format_note(path)) == (not name.endswith(suffix))


def test_the_plan_says_so(tmp_path: Path) -> None:
    path = tmp_path / "house.stl"
    path.write_bytes(write(one_level(), tmp_path / "true.glb").read_bytes())
    (name,) = run_build([path], tmp_path / "out").ids
    told = load_plan(tmp_path / "out" / "json" / f"{name}.json").provenance or {}
    assert told["format"] == "house.stl is read as .glb, by its content"


@pytest.mark.parametrize(("form", "name"), [("dxf", "plan.txt"), ("svg", "plan.xml"), ("geojson", "plan.json")])
def test_a_drawing_is_read_as_what_it_is(tmp_path: Path, form: str, name: str) -> None:
    (true,) = export(house("a"), form, tmp_path / "true")
    path = tmp_path / name
    path.write_bytes(true.read_bytes())
    assert len(levels_of(path)) == 1


def test_a_picture_is_a_picture_whatever_its_suffix(tmp_path: Path) -> None:
    cells = np.full((40, 40), 254, np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = 0
    path = tmp_path / "map.pgm"
    Image.fromarray(cells).save(path, "png")
    (tmp_path / "map.yaml").write_text("image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n")
    assert format_suffix(path) == ".pgm"
    assert read_map(tmp_path / "map.yaml").free.sum() == 38 * 38
    np.save(tmp_path / "array.npy", cells == 0)
    array = (tmp_path / "array.npy").rename(tmp_path / "array.png")
    assert read_map(array, resolution=0.1).free.sum() == 38 * 38


@pytest.mark.parametrize(
    "data",
    [b"", b"\0" * 200, b"OFFICE 3", b"solid ground", b"v", b"<", b"<!--", b"{", b"P5", b"ply", b"oak 1 2 3\nv 1"],
)
def test_what_says_nothing_is_what_its_name_says(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "some.thing"
    path.write_bytes(data)
    assert format_suffix(path) == ".thing"
    assert not format_note(path)


def test_json_of_others_is_no_gltf(tmp_path: Path) -> None:
    path = tmp_path / "house.json"
    path.write_text(json.dumps({"walls": [], "assetId": "a", "asset": {"name": "x"}, "version": "2.0"}))
    assert format_suffix(path) == ".json"


def test_comments_before_the_root_are_no_root_however_they_end() -> None:
    assert xml_root(b"<?xml version='1.0'?><!-- <svg> --><!-- <sdf> -->\n<ns:mujoco a='1'>") == (b"ns", b"mujoco")
    assert xml_root(b"<!-- <svg>") == (b"", b"")
    assert xml_root(b"<?xml?>" + b"<!--" * (1 << 14) + b"<svg>") == (b"", b"")  # 6 s, once, by a search per comment
