"""Commands whose output nobody reads to its end: they go on, and end with their own exit code."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from houseexpo import encode
from tests.builders.batch import one_room
from tests.builders.plan_files import house, houses, pack

ROOT = Path(__file__).parents[3]


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
