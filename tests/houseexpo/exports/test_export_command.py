"""``houseexpo export`` and ``houseexpo.exports.export``: options, ids, bad input, and the picture in a browser."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from houseexpo import save_plan
from houseexpo.commands import export as command
from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError, PlanError
from houseexpo.exports import FORMATS, export, svg


@pytest.fixture
def folder(flat, tmp_path, monkeypatch):
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    (tmp_path / "plans").mkdir()
    for name in ("villa", "studio", "cabin"):
        save_plan(replace(flat, id=name), tmp_path / "plans" / f"{name}.json")
    return tmp_path / "plans"


def run(*words):
    done = CliRunner().invoke(make_app(), ["export", *map(str, words)])
    return done.exit_code, " ".join(done.output.split())


def names(folder):
    return sorted(file.name for file in folder.rglob("*") if file.is_file())


def test_the_help_names_every_format():
    assert command._NAMES.split(", ") == list(FORMATS)
    assert list(FORMATS) == sorted(FORMATS)


def test_all_some_and_one_plan(folder, tmp_path):
    assert run(folder, "--to", "ros", "--out", tmp_path / "all")[0] == 0
    assert names(tmp_path / "all") == sorted(f"{n}.{e}" for n in ("villa", "studio", "cabin") for e in ("pgm", "yaml"))
    (tmp_path / "list.txt").write_text("villa\ncabin\n")
    assert (
        run(
            folder,
            "--to",
            "pol",
            "--ids",
            f"@{tmp_path / 'list.txt'}",
            "--ids",
            "studio,villa",
            "--out",
            tmp_path / "b",
        )[0]
        == 0
    )
    assert names(tmp_path / "b") == ["cabin.pol", "studio.pol", "villa.pol"]
    code, said = run(folder / "villa.json", "--to", "gltf", "--door-height", "2", "--out", tmp_path / "one")
    assert (code, names(tmp_path / "one")) == (0, ["villa.glb"])
    assert said.startswith("1 plan, 1 file ")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--to", "ros", "--ids", "vila"), "no 'vila'; the nearest is 'villa'"),
        (("--to", "ros", "--ids", "../villa"), "no '../villa'; the nearest is 'villa'"),
        (("--to", "rose"), "expected one of coco, "),
        (("--to", "svg", "--resolution", "0.1"), "svg takes wall_thickness, orientation, frame; found resolution"),
        (("--to", "png", "--resolution", "0"), "expected a resolution of more than 0"),
        (("--to", "ros", "--wall-thickness", "-1", "--resolution", "-1"), "expected a resolution of more than 0"),
        (("--to", "sdf", "--wall-thickness", "0"), "expected a thickness of more than 0 m"),
    ],
)
def test_bad_words_are_explained_and_nothing_is_written(folder, tmp_path, words, said):
    code, output = run(folder, *words, "--out", tmp_path / "out")
    assert code == 2
    assert said in output
    assert not (tmp_path / "out").exists()


def test_an_id_never_leaves_the_folder(folder, tmp_path):
    evil = (folder / "villa.json").read_text().replace('"villa"', '"../../villa"')
    (tmp_path / "evil.json").write_text(evil)
    code, said = run(tmp_path / "evil.json", "--to", "png", "--out", tmp_path / "deep" / "out")
    assert code == 2
    assert "safe as a file name" in said
    assert not (tmp_path / "deep").exists()


def test_rooms_are_found_when_asked_for(folder, flat, tmp_path):
    bare = replace(flat, id="bare", rooms=(), doors=(), frame=None)
    save_plan(bare, tmp_path / "bare.json")
    assert run(tmp_path / "bare.json", "--to", "geojson", "--find-rooms", "--out", tmp_path / "out")[0] == 0
    assert (tmp_path / "out" / "bare.geojson").read_text().count('"kind":"room"') == 3


def test_two_plans_of_one_id_and_several_pieces_are_refused(flat, published, tmp_path):
    with pytest.raises(PlanError, match="found this one twice"):
        export([flat, flat], "png", tmp_path)
    with pytest.raises(ConfigError, match="found colour"):
        export(flat, "png", tmp_path, colour="red")
    with pytest.raises(PlanError, match=r"free space in one piece, as \.pol holds, found [2-9] pieces"):
        export(published[-1], "pol", tmp_path)


def test_what_a_format_cannot_hold_is_named_and_left_out_of_many(folder, published, tmp_path):
    pieces = replace(published[-1], id="pieces")
    save_plan(pieces, folder / "pieces.json")
    code, said = run(folder, "--to", "pol", "--out", tmp_path / "out")
    assert (code, names(tmp_path / "out")) == (1, ["cabin.pol", "studio.pol", "villa.pol"])
    assert "3 plans, 3 files in" in said
    assert "left out: plan 'pieces': verts: expected a free space in one piece" in said
    code, said = run(folder / "pieces.json", "--to", "pol", "--out", tmp_path / "none")
    assert (code, (tmp_path / "none").exists()) == (2, False)
    assert "plan 'pieces': verts: expected a free space in one piece" in said


@pytest.mark.browser
def test_svg_in_a_browser(flat, tmp_path):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no headless Chromium")
    bare = replace(flat, rooms=(), doors=())
    text = svg(bare)[f"{flat.id}.svg"].decode()
    wide, high = (int(float(re.search(rf'{side}="([^"]+)"', text)[1])) for side in ("width", "height"))
    page, shot = tmp_path / "page.html", tmp_path / "shot.png"
    page.write_text(f'<body style="margin:0;background:#f0f">{text}</body>')
    flags = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--window-size={wide},{high}")
    subprocess.run(
        [browser, *flags, f"--screenshot={shot}", page.as_uri()], capture_output=True, timeout=60, check=True
    )
    pixels = np.asarray(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")).astype(int)
    white = (np.abs(pixels - 255).max(axis=2) < 40).sum()
    assert white / 50**2 == pytest.approx(flat.area, rel=0.01)
