"""The library's commands, each run as a person runs it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from houseexpo import FloorPlan, encode
from houseexpo.commands.app import make_app
from houseexpo.plan import Quality
from tests.builders.plan_files import hexed, house, houses, pack

APP = make_app()


def call(*words: str | Path, code: int = 0) -> str:
    done = CliRunner().invoke(APP, [str(word) for word in words], env={"COLUMNS": "200"})
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture
def data(tmp_path):
    return pack(tmp_path, "zip", houses(6))


def test_validate(tmp_path, data):
    assert "6 plans, 0 findings" in call("validate", data, "--workers", "1")
    bad = pack(tmp_path, "jsonl", {"a": encode(house("a")), "b": b"{"})
    said = call("validate", bad, "--list", "--workers", "1", code=1)
    assert re.search(r"^a: identity: id: expected 32 hex digits", said, re.MULTILINE)
    assert "line 2: schema" in said
    assert "found nothing there" in call("validate", tmp_path / "none.zip", code=2)


def test_info_says_how_sure_the_plans_are(furnished, tmp_path):
    file = tmp_path / "plan.json"
    file.write_bytes(encode(furnished))
    said = call("info", file)
    assert re.search(r"^quality +0\.93, sure; 1 of \d+ grounds against it$", said, re.MULTILINE)
    assert re.search(r"^ +guessed_wall_share +0\.1$", said, re.MULTILINE)
    assert re.search(r"^object 0 +Kachelofen, 0\.90 m high, in room 0$", said, re.MULTILINE)
    plans = (house("a", quality=Quality(0.5)), house("b", quality=Quality(0.9)), house("c"))
    path = pack(tmp_path, "jsonl", {plan.id: encode(plan) for plan in plans})
    assert "0.5 to 0.9, median 0.7, mean 0.700, 1 doubtful (below 0.8)" in call("info", path)


def test_info_says_in_words_what_speaks_against_a_plan(tmp_path):
    file = tmp_path / "plan.json"
    file.write_bytes(encode(house("a", quality=Quality(0.5, {"cut_share": 0.5, "left_out": 0.0}))))
    said = call("info", file)
    assert re.search(r"^  cut_share +0\.5, doors that are cuts, not evidence$", said, re.MULTILINE)
    assert "left_out" not in said  # 0: nothing to say
    assert '"left_out": 0.0' in call("info", file, "--json")


def test_info(data, two_rooms, tmp_path):
    said = call("info", data)
    assert "quality" not in said
    assert "1 to 6, median 3.5, mean 3.500, 21 in all" in said
    assert "Kitchen 6" in said
    said = call("info", hexed(2), "--data", data)
    assert "16.00 m² of free space in 4.00 x 4.00 m" in said
    file = tmp_path / "plan.json"
    file.write_bytes(encode(two_rooms))
    said = call("info", file)
    assert "Living_Room, 11.84 m²" in said
    assert "1 piece, 100.0% in the largest, narrowest passage 0.80 m" in said
    assert "no '0'" in call("info", "0", "--data", data, code=2)


def test_show(data, two_rooms, tmp_path):
    file = tmp_path / "plan.json"
    file.write_bytes(encode(two_rooms))
    call("show", file, "--out", tmp_path / "one.png", "--size", "300")
    picture = np.asarray(Image.open(tmp_path / "one.png"))
    assert 250 < max(picture.shape) < 400
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10
    call("show", hexed(1), hexed(2), hexed(3), "--data", data, "--out", tmp_path / "sheet.png", "--size", "200")
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    assert sheet.shape[0] > 400
    call("show", hexed(1), hexed(2), "--data", data, "--out", tmp_path / "sheet.svg")
    text = (tmp_path / "sheet.svg").read_text()
    assert text.count("<svg ") == 3
    assert hexed(2) in text
    assert ".png or .svg" in call("show", file, "--out", tmp_path / "one.gif", code=2)


def test_split(data, tmp_path):
    said = call("split", data, "--out", tmp_path / "out", "--workers", "1", "--seed", "3")
    assert "train" in said
    lists = {file.stem: file.read_text().split() for file in (tmp_path / "out" / "splits").glob("*.txt")}
    assert sorted(name for ids in lists.values() for name in ids) == [hexed(i) for i in range(6)]
    assert "--out" in call("split", data, code=2)
    call("split", data, "--out", tmp_path / "paper", "--paper", "--workers", "1")
    assert {file.name for file in (tmp_path / "paper" / "splits").iterdir()} == {
        "splits.json",
        "test.txt",
        "train.txt",
    }


def test_no_data_set_is_said(monkeypatch, tmp_path):
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "empty"))
    assert "houseexpo fetch" in call("info", hexed(1), code=2)


def test_square_brackets_of_paths_ids_and_labels_are_printed_as_they_are(tmp_path):
    odd = FloorPlan(
        "a[red]b", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {"[/bold]": ((0.1, 0.1, 4.1, 4.1),)}
    )
    folder = tmp_path / "plans[old]"
    folder.mkdir()
    path = pack(folder, "jsonl", {"a": encode(odd)})
    assert f"{path}\n" in call("info", path)
    said = call("info", odd.id, "--dataset", path)
    assert "a[red]b" in said
    assert "[/bold] 1" in said
    assert f"1 plan, 1 file in {folder / 'svg'}" in call("export", path, "--to", "svg", "--out", folder / "svg")
    renamed = path.rename(folder / "x[dim].jsonl")
    assert "x[dim].jsonl: 1 plan" in call("validate", renamed, "--workers", "1", code=1)
    said = call("stats", renamed, "--out", folder / "r.json", "--workers", "1")
    assert "x[dim].jsonl: 1 plan" in said
    assert "[/bold]  1" in said
    assert f"written {folder / 'r.json'}" in said
