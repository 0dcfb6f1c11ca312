"""Disks that fill up: a build says so, ends with 3, loses nothing, and goes on to the same bytes when there is room."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from codecs import BOM_UTF8
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest
import typer

from houseexpo.errors import NOT_DONE
from pipeline.cli_common import end_cleanly
from tests.builders.batch import contents, lines, one_room
from tests.builders.clusters import Disk, disks

EXAMPLES = Path(str(files("pipeline"))) / "examples"
HOUSES = 24


@pytest.fixture
def disk() -> Iterator[Disk]:
    with disks() as mount:
        yield mount


def build(source: str, out: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "houseexpo", "build", source, "--out", str(out), "--workers", "2"]
    return subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **environment})


@pytest.fixture
def street(tmp_path: Path) -> Path:
    for number in range(HOUSES):
        one_room(tmp_path / "street" / f"house_{number:02d}.ply", 4.0 + 0.3 * number, 4.0)
    return tmp_path / "street"


@pytest.mark.slow
@pytest.mark.parametrize("size", ["60k", "150k", "250k"])
def test_a_build_on_a_disk_that_fills_up_goes_on_when_there_is_room(
    size: str, street: Path, disk: Disk, tmp_path: Path
) -> None:
    out = disk("disk", size) / "out"
    full = build(str(street), out)
    assert full.returncode == NOT_DONE, full.stderr
    assert "stopped: No space left on device" in full.stderr or "not done yet: " in full.stdout
    assert "Traceback" not in full.stdout + full.stderr
    disk("disk", "20m")
    assert build(str(street), out).returncode == 0
    build(str(street), tmp_path / "calm")
    assert contents(out) == contents(tmp_path / "calm")


@pytest.mark.slow
def test_houses_that_the_temporary_folder_has_no_room_for_are_done_later(disk: Disk, tmp_path: Path) -> None:
    out, scratch, houses = tmp_path / "out", disk("scratch", "64k"), tmp_path / "houses"
    houses.mkdir()
    for number in range(4):  # a file with a byte order mark is read from a copy of it
        text = BOM_UTF8 + (EXAMPLES / "house.ifc").read_bytes().replace(b"ENDSEC;", b"ENDSEC;\n" * (number + 1), 1)
        (houses / f"house_{number}.ifc").write_bytes(text)
    full = build(str(houses), out, TMPDIR=str(scratch))
    assert full.returncode == NOT_DONE, full.stderr
    assert "not done yet: 4" in full.stdout
    assert {line["reason"] for line in lines(out / "rejected.jsonl")} == {"not_yet"}
    assert {line["detail"] for line in lines(out / "rejected.jsonl")} == {"No space left on device"}
    disk("scratch", "50m")
    assert build(str(houses), out, TMPDIR=str(scratch)).returncode == 0
    build(str(houses), tmp_path / "calm")
    assert contents(out) == contents(tmp_path / "calm")


def test_a_command_that_a_full_disk_ends_says_how_to_go_on(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit) as end, end_cleanly():
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "plans/index.parquet")
    assert end.value.exit_code == NOT_DONE
    said = capsys.readouterr().err
    assert said.startswith("stopped: No space left on device (plans/index.parquet); when that has passed: ")
    assert "goes on with the rest" in said


def test_a_folder_that_may_not_be_written_is_no_fault_of_the_moment() -> None:
    with pytest.raises(PermissionError), end_cleanly():
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), "plans")
