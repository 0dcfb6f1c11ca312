"""Journey 7: a first training that is killed, resumed and put into a row, which somebody else verifies."""

from __future__ import annotations

import csv
import json
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from houseexpo.pseudoslam.benchmark.result import read_result
from tests.builders.needs import need
from tests.builders.training import write_split_huts, write_tiny
from tests.journeys.pages import commands

PAGE = "docs/pseudoslam/training.md"


def start(command: str, folder: Path) -> subprocess.Popen[str]:
    """Start a command of the page in a folder."""
    words = [sys.executable, "-m", *shlex.split(command)]
    return subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def run(command: str, folder: Path, code: int = 0) -> str:
    """Run a command to its end, which must have this exit code, and return what it said."""
    process = start(command, folder)
    said, _ = process.communicate(timeout=600)
    assert process.returncode == code, said
    return said


def steps_done(file: Path) -> list[int]:
    with file.open() as stream:
        return [int(row["steps_done"]) for row in csv.DictReader(stream)]


@pytest.mark.slow
def test_a_row_of_a_training_that_was_killed_is_verified_by_somebody_else(tmp_path: Path) -> None:
    need(modules=["torch", "stable_baselines3", "sb3_contrib", "tensorboard"], how="make learn")
    mine, theirs = tmp_path / "mine", tmp_path / "theirs"
    huts = write_split_huts(tmp_path)
    for folder in (mine, theirs):
        folder.mkdir()
        shutil.copytree(huts, folder / "huts")
    quick = write_tiny(mine, steps=1280).rename(mine / "quick.toml")
    quick.write_text(quick.read_text().replace("pixels_per_metre = 10.0\n", ""))  # as on the track
    here = [command.replace("plans/demo", "huts") for command in commands(PAGE, "first-run")]
    split, train, resume, measure, verify, compare = here

    run(f"{split} --replace", mine)
    shutil.copytree(mine / "huts" / "splits", theirs / "huts" / "splits", dirs_exist_ok=True)
    training = start(train, mine)
    while training.poll() is None and not list((mine / "first-run").glob("checkpoints/[0-9]*.zip")):
        time.sleep(0.01)
    training.kill()
    training.wait()
    assert not (mine / "first-run" / "policy.pt").exists()
    assert "continues from" in run(resume, mine)
    assert steps_done(mine / "first-run" / "learning.csv") == list(range(64, 1281, 64))
    assert steps_done(mine / "first-run" / "evaluation.csv") == list(range(128, 1281, 128))

    run(measure, mine)
    shutil.copy(mine / "mine.json", theirs)
    assert " no " in run(compare, theirs)
    run(verify, theirs)
    assert " yes " in run(compare, theirs)

    forged = json.loads((theirs / "mine.json").read_text())
    for key in ("area_800_steps", "coverage"):
        forged["episodes"][key] = [0.999 for _ in forged["episodes"][key]]
        if key in forged["summary"]:
            forged["summary"][key] |= dict.fromkeys(("mean", "low", "high"), 0.999)
    (theirs / "mine.json").write_text(json.dumps(forged))
    read_result(theirs / "mine.json")  # nothing in it contradicts itself
    assert "its actions do not give its values" in run(verify, theirs, code=2)
    assert " no " in run(compare, theirs)
