"""Builds that are killed, the whole group at some moment or one worker, give what calm builds give."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from tests.builders.batch import contents
from tests.builders.suncg_houses import write_houses

pytestmark = pytest.mark.slow
HOUSES, KILLS = 16, 6


def command(houses: Path, out: Path) -> list[str]:
    return [
        sys.executable,
        "-m",
        "houseexpo",
        "build",
        str(houses),
        "--seed",
        "3",
        "--out",
        str(out),
    ]


@pytest.fixture(scope="module")
def houses(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Houses in SUNCG's layout."""
    folder = tmp_path_factory.mktemp("houses")
    write_houses(folder, HOUSES, 3)
    return folder


@pytest.fixture(scope="module")
def calm(houses: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], float]:
    """The data set of a build that nobody disturbs, and how long it takes."""
    out, start = tmp_path_factory.mktemp("calm") / "out", time.monotonic()
    subprocess.run(command(houses, out), check=True, capture_output=True)
    return contents(out), time.monotonic() - start


def kill_worker(build: psutil.Popen) -> None:
    """Kill the first process that the fork server has made."""
    for process in build.children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            if process.ppid() != build.pid:
                process.kill()
                return


@pytest.mark.parametrize("part", range(KILLS))
def test_a_build_killed_as_a_whole_goes_on_to_the_same_bytes(
    part: int, houses: Path, calm: tuple[dict[str, bytes], float], tmp_path: Path
) -> None:
    expected, seconds = calm
    build = psutil.Popen(
        command(houses, tmp_path / "out"), start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    time.sleep(seconds * (part + 0.5) / KILLS)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(build.pid, signal.SIGKILL)
    build.wait()
    subprocess.run(command(houses, tmp_path / "out"), check=True, capture_output=True)
    assert contents(tmp_path / "out") == expected


@pytest.mark.parametrize("part", range(KILLS))
def test_a_worker_that_is_killed_costs_nothing(
    part: int, houses: Path, calm: tuple[dict[str, bytes], float], tmp_path: Path
) -> None:
    expected, seconds = calm
    build = psutil.Popen(command(houses, tmp_path / "out"), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    time.sleep(seconds * part / KILLS)
    kill_worker(build)
    said = build.communicate()[1]
    assert build.returncode == 0, said
    assert contents(tmp_path / "out") == expected
