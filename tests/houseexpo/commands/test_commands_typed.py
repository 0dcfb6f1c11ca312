"""Commands as people type them, in folders as people have them."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from houseexpo import FloorPlan, encode
from houseexpo.commands import app
from houseexpo.commands.app import EXAMPLES, make_app
from houseexpo.commands.arguments import parse_ids
from houseexpo.commands.split import _shares
from houseexpo.dataset import open_dataset
from houseexpo.plan import Quality
from tests.builders.batch import one_room
from tests.builders.commands import call
from tests.builders.plan_files import hexed, house, houses, pack

# Commands whose output nobody reads to its end: they go on, and end with their own exit code.


ROOT = Path(__file__).parents[3]


def shell(script: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHON": sys.executable}
    command = ["bash", "-c", f"set -o pipefail; {script}"]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=environment, check=False)


@pytest.fixture
def data(tmp_path):
    return pack(tmp_path, "zip", houses(6))


def test_show_takes_a_data_set_as_info_does(data, tmp_path):
    def plans_in(*words: str | Path) -> int:
        call("show", data, "--out", tmp_path / "sheet.svg", "--size", "100", *words)
        return (tmp_path / "sheet.svg").read_text().count("<svg ") - 1

    assert plans_in() == 6
    assert plans_in("--limit", "2") == 2
    assert plans_in("--sample", "4") == 4
    assert plans_in("--sample", "4", "--limit", "3") == 3
    assert plans_in("--ids", f"{hexed(1)},{hexed(3)}") == 2


def test_ids_are_given_alike_in_every_command(data, tmp_path):
    (tmp_path / "ids.txt").write_text(f"{hexed(0)}\n{hexed(2)}\n")
    assert parse_ids([f"a,b.json, {hexed(0)}", f"@{tmp_path / 'ids.txt'}"]) == ["a", "b", hexed(0), hexed(2)]
    (tmp_path / "bad.txt").write_text("# of stats --list-bad\nHouse 12\tinvalid ring\n" + hexed(2) + " a note\n")
    assert parse_ids([f"@{tmp_path / 'bad.txt'}"]) == ["House 12", hexed(2)]
    for words in ([f"@{tmp_path / 'ids.txt'}"], [f"{hexed(0)},{hexed(2)}"], [hexed(0), hexed(2)]):
        call("show", *words, "--data", data, "--size", "100", "--out", tmp_path / "sheet.svg")
        assert (tmp_path / "sheet.svg").read_text().count("<svg ") == 3
    assert "2 plans, 2 files" in call(
        "export", data, "--to", "json", "--ids", f"@{tmp_path / 'ids.txt'}", "--out", tmp_path
    )
    for words in ([data, "--ids", f"@{tmp_path / 'ids.txt'}"], [f"{hexed(0)},{hexed(2)}", "--data", data]):
        assert [plan["plan"] for plan in json.loads(call("info", *words, "--json"))] == [hexed(0), hexed(2)]
        assert call("info", *words).count("robot 0.20 m") == 2
    said = call("show", "@nowhere.txt", "--data", data, "--out", tmp_path / "a.svg", code=2)
    assert "one id a line; it cannot be read (No such file or directory); check the path" in said
    assert "Errno" not in said


def test_info_and_validate_answer_programs(data, two_rooms, tmp_path, monkeypatch):
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))  # another test may know rooms of the same plans
    told = json.loads(call("info", data, "--json"))
    assert told["plans"] == 6
    assert told["rooms"] == {}
    assert told["source_rooms"] == {"count": 6, "min": 1, "max": 6, "median": 3.5, "mean": 3.5, "sum": 21}
    (tmp_path / "plan.json").write_bytes(encode(two_rooms))
    assert json.loads(call("info", tmp_path / "plan.json", "--json"))["robot 0.20 m"]["pieces"] == 1
    open_dataset(data).head(2).column("rooms")
    assert json.loads(call("info", data, "--json"))["rooms"]["count"] == 2
    assert "in all; known of 2 of 6 plans" in call("info", data)
    bad = pack(tmp_path, "jsonl", {"a": encode(house("a"))})
    found = json.loads(call("validate", bad, "--json", "--workers", "1", code=1))
    assert found["plans"] == 1
    assert found["findings"][0]["rule"] == "identity"
    assert found["rules"]["identity"] == {"findings": 1, "plans": 1}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, {"train": 0.7, "val": 0.1, "test": 0.2}),
        ({"train": 0.8, "test": 0.2}, {"train": 0.8, "test": 0.2}),
        ({"train": 0.8}, {"train": 0.8, "test": 0.2}),
        ({"test": 0.3, "val": 0.1}, {"train": 0.6, "val": 0.1, "test": 0.3}),
        ({"train": 0.7, "test": 0.2}, {"train": 0.7, "val": 0.1, "test": 0.2}),
        ({"train": 0.8, "val": 0.1, "test": 0.2}, {"train": 0.8, "val": 0.1, "test": 0.2}),
    ],
)
def test_a_split_infers_the_rest(given, expected):
    assert _shares({name: given.get(name) for name in ("train", "test", "val")}) == expected


def test_a_word_that_is_no_file_and_can_be_no_id_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    for words in (("info", "plan"), ("show", "plan", "--out", tmp_path / "sheet.svg")):
        assert "plan: no such file or folder, and no data set in which it could be an id" in call(*words, code=2)
    (tmp_path / "plans").mkdir()
    assert "a data set stands alone" in call("info", tmp_path / "plans", "plan", code=2)


def test_a_reader_who_has_seen_enough_is_no_error(data, tmp_path):
    done = shell(f'"$PYTHON" -m houseexpo info {data} | head -1', tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("data set")
    assert done.stderr == ""


def test_somebodys_own_pipeline_harms_nothing(tmp_path, data):
    """The folder's file is found first where Python is started with -m; it is not even run."""
    (tmp_path / "pipeline.py").write_text("raise SystemExit('a file of mine')")
    script = f'"$PYTHON" -m houseexpo --help && "$PYTHON" -m houseexpo info {data}'
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, cwd=tmp_path, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]), "PYTHON": sys.executable},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "build" in done.stdout
    assert "Cannot be loaded" in done.stdout
    assert "a file of mine" not in done.stdout + done.stderr


def test_a_command_that_cannot_be_loaded_says_why(monkeypatch):
    entries = {"broken": EntryPoint("broken", "no_such_module_here:run", app.GROUP)}
    monkeypatch.setattr(app, "_entries", lambda: entries)
    assert "Cannot be loaded" in call("--help")
    assert "no_such_module_here" in call("broken", "--any", "thing", code=2)


def test_completion_is_offered():
    assert "--install-completion" in call("--help")
    asked = {"_HOUSEEXPO_COMPLETE": "complete_bash", "COMP_WORDS": "houseexpo va", "COMP_CWORD": "1"}
    done = CliRunner().invoke(app.make_app(), prog_name="houseexpo", env=asked)
    assert done.output.split() == ["validate"]


def test_python_m_says_the_command_that_it_is(tmp_path):
    for package, command in (("stats", "stats"), ("pipeline", "build")):
        assert f"Usage: houseexpo {command}" in shell(f'"$PYTHON" -m {package} --help', tmp_path).stdout


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["export", "DATA", "--to", "json", "--out", ""], "--out"),
        (["export", "DATA", "--to", "json", "--out="], "--out"),
        (["info", ""], "what"),
        (["show", "DATA", "", "--out", "sheet.svg"], "what"),
        (["build", "", "--out", "plans"], "SOURCE"),
        (["build", "procedural:1", "--out", ""], "--out"),
        (["benchmark", "run", "--policy", "spin", "--out", ""], "--out"),
        (["ros", "DATA", "--config", ""], "--config"),
    ],
)
def test_an_empty_word_is_no_path(data, tmp_path, monkeypatch, words, named):
    monkeypatch.chdir(tmp_path)
    before = set(tmp_path.iterdir())
    said = call(*(data if word == "DATA" else word for word in words), code=2)
    assert f"'{named}': expected a value, found an empty word" in " ".join(said.split())
    assert set(tmp_path.iterdir()) == before


# The examples in the commands' help name commands and options that there are.


GROUP: Any = typer.main.get_command(make_app())


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_examples_name_options_that_there_are(name: str) -> None:
    command = GROUP.get_command(None, name)
    known = {option for parameter in command.params for option in parameter.opts}
    for example in EXAMPLES[name]:
        first, *words = example.split()
        assert first == name
        assert {word for word in words if word.startswith("--")} <= known


def unread(*words: str | Path) -> tuple[int, str]:
    """Run a command whose standard output is closed at its other end; return its exit code and its errors."""
    reading, writing = os.pipe()
    os.close(reading)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "houseexpo", *map(str, words)]
    done = subprocess.run(
        command, stdout=writing, stderr=subprocess.PIPE, text=True, env=environment, cwd=ROOT, check=False
    )
    os.close(writing)
    return done.returncode, done.stderr


def test_a_list_without_an_id_is_refused_and_means_not_all(data: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.txt").write_text("# nothing is bad\n")
    for words in (["--ids", f"@{tmp_path / 'bad.txt'}"], ["--ids", ","]):
        for command in (["export", data, "--to", "json", "--out", tmp_path / "out"], ["info", data]):
            assert "expected one id or more, found none" in " ".join(call(*command, *words, code=2).split())
    assert not (tmp_path / "out").exists()


def test_findings_are_told_by_the_exit_code(tmp_path: Path) -> None:
    assert unread("validate", pack(tmp_path, "zip", houses(6)), "--workers", "1") == (0, "")
    other_name = pack(tmp_path, "folder", {"b": encode(house("a"))})
    assert unread("validate", other_name, "--list", "--workers", "1") == (1, "")


@pytest.mark.slow
@pytest.mark.parametrize(("command", "last"), [("build", "manifest.json"), ("inspect", "stages.png")])
def test_a_house_is_read_to_its_end(command: str, last: str, tmp_path: Path) -> None:
    code, errors = unread(command, one_room(tmp_path / "in" / "villa.ply"), "--out", tmp_path / "out")
    assert code == 0, errors
    assert (tmp_path / "out" / last).is_file()


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
