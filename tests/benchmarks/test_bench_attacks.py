"""What a build does under attack: damaged inputs, kills of the whole group and of single workers, a disk that fills up.

Every row counts builds and how many of them did not come to what a calm build comes to: that number should be 0.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from rich.console import Console

from tests.builders.batch import contents
from tests.builders.damaged import build_damaged

HOUSES, GROUPS, WORKERS = 300, 50, 60
DAMAGED, LIMIT_S = 2000, 10
OWN_FAULTS = {"internal", "out_of_memory"}


def command(out: Path, houses: int = HOUSES) -> list[str]:
    """Return the build that is attacked."""
    return [sys.executable, "-m", "houseexpo", "build", f"procedural:{houses}", "--seed", "3", "--out", str(out)]


def test_damaged_inputs(tmp_path: Path) -> None:
    found = build_damaged(tmp_path, DAMAGED, seed=2026, limit_s=LIMIT_S)
    console = Console(width=150)
    reasons = dict(found.reasons.most_common())
    console.print(f"{found.inputs} damaged houses in {found.seconds:.0f} s: {reasons}", highlight=False)
    for each in found.refused:
        if each["reason"] in {*OWN_FAULTS, "timeout"}:
            console.print(each["id"], each["detail"], style="dim", markup=False)
    assert (found.code, found.inputs) == (0, DAMAGED)
    assert "Traceback" not in found.said + found.written
    assert str(tmp_path) not in found.written
    assert not OWN_FAULTS & found.reasons.keys()
    assert found.reasons["timeout"] <= DAMAGED // 100


@pytest.fixture(scope="module")
def calm(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], float]:
    """The data set of a build that nobody disturbs, and how long it takes."""
    out, start = tmp_path_factory.mktemp("calm") / "out", time.monotonic()
    subprocess.run(command(out), check=True, capture_output=True)
    return contents(out), time.monotonic() - start


def test_builds_that_are_killed_as_a_whole(calm: tuple[dict[str, bytes], float], tmp_path: Path) -> None:
    expected, seconds = calm
    wrong = []
    for number in range(GROUPS):
        out, moment = tmp_path / str(number), seconds * (number + 0.5) / GROUPS
        build = psutil.Popen(command(out), start_new_session=True, stdout=-3, stderr=-3)
        time.sleep(moment)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(build.pid, signal.SIGKILL)
        build.wait()
        done = subprocess.run(command(out), capture_output=True, check=False)
        if done.returncode or contents(out) != expected:
            wrong.append(round(moment, 2))
    Console().print(
        f"{GROUPS} builds of {HOUSES} houses killed within {seconds:.0f} s: {len(wrong)} went on wrongly {wrong}"
    )
    assert not wrong


def test_builds_of_which_a_worker_is_killed(calm: tuple[dict[str, bytes], float], tmp_path: Path) -> None:
    expected, seconds = calm
    rng, wrong = np.random.default_rng(8), []
    for number in range(WORKERS):
        out = tmp_path / str(number)
        moment = float(rng.uniform(0, 1.0 if number % 2 else seconds))
        build = psutil.Popen(command(out), stdout=-3, stderr=-3)
        time.sleep(moment)
        workers = [child for child in build.children(recursive=True) if child.ppid() != build.pid]
        if workers:
            with contextlib.suppress(psutil.NoSuchProcess):
                workers[int(rng.integers(len(workers)))].kill()
        if build.wait() or contents(out) != expected:
            wrong.append(round(moment, 2))
    Console().print(
        f"{WORKERS} builds of {HOUSES} houses with a worker killed: {len(wrong)} came to something else {wrong}"
    )
    assert not wrong
