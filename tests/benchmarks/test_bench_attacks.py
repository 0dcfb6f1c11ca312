"""What a build does under attack: damaged inputs, kills of the whole group and of single workers.

Every line counts builds and how many of them did not come to what a calm build comes to: that number should be 0. Disks
that fill up have a test of their own, ``tests/pipeline/batch/test_full_disk.py``.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
import pytest
from rich.console import Console

from tests.builders.batch import contents, one_room
from tests.builders.damage import build_damaged

HOUSES, REPEATED, GROUPS, LATE, STRIDE, WORKERS = 300, 20, 50, 14, 7, 60
DAMAGED, LIMIT_S = 2000, 10
OWN_FAULTS = {"internal", "out_of_memory"}


@dataclass(frozen=True)
class Calm:
    """A calm build: its data set, how long it takes, when its workers came, and when all was planned and packed."""

    houses: Path
    contents: dict[str, bytes]
    seconds: float
    started: float
    planned: float
    packed: float

    def start(self, out: Path) -> psutil.Popen:
        """Begin the same build in a group of its own."""
        return psutil.Popen(command(self.houses, out), start_new_session=True, stdout=-3, stderr=-3)


def command(houses: Path, out: Path) -> list[str]:
    """Return the build that is attacked."""
    return [sys.executable, "-m", "houseexpo", "build", str(houses), "--out", str(out)]


def rooms(folder: Path) -> Path:
    """Write houses of one room, 280 of different sizes and 20 again: they cost little, so that many builds can be."""
    sizes = [(3.0 + 0.25 * a, 3.0 + 0.25 * b) for b in range(26) for a in range(b + 1)][: HOUSES - REPEATED]
    for number, (width, depth) in enumerate([*sizes, *sizes[:REPEATED]]):
        one_room(folder / f"house_{number:03d}.ply", width, depth)
    return folder


def done(out: Path) -> int:
    """Return of how many houses it is known what came of them."""
    with contextlib.suppress(OSError):
        return (out / ".build" / "journal.jsonl").read_bytes().count(b"\n")
    return 0


def said(text: str) -> None:
    """Print a line that shows how far it is."""
    Console().print(f"{time.strftime('%H:%M:%S')} {text}", style="dim", highlight=False)


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
def calm(tmp_path_factory: pytest.TempPathFactory) -> Calm:
    folder = tmp_path_factory.mktemp("calm")
    houses, out = rooms(folder / "houses"), folder / "out"
    subprocess.run(command(houses, folder / "first"), check=True, capture_output=True)  # compiles
    start, started, planned, packed = time.monotonic(), 0.0, 0.0, 0.0
    build = psutil.Popen(command(houses, out), stdout=-3, stderr=-3)
    while build.poll() is None:
        time.sleep(0.02)
        now = time.monotonic() - start
        started = started or (now if workers_of(build) else 0.0)
        planned = planned or (now if done(out) >= HOUSES else 0.0)
        packed = packed or (now if (out / "manifest.json").exists() else 0.0)
    assert build.returncode == 0
    return Calm(houses, contents(out), time.monotonic() - start, started, planned, packed)


def test_builds_that_are_killed_as_a_whole(calm: Calm, tmp_path: Path) -> None:
    wrong, struck = [], Counter[str]()
    for k in range(GROUPS):
        number = k * STRIDE % GROUPS  # those that are done when it is interrupted are spread, too
        out, late = tmp_path / str(number), number >= GROUPS - LATE
        build = calm.start(out)
        if late:  # in dedupe or packing, whenever the machine comes to that
            while build.poll() is None and done(out) < HOUSES:
                time.sleep(0.02)
            moment = (calm.packed - calm.planned) * (number - GROUPS + LATE + 0.5) / LATE
        else:
            moment = calm.seconds * (number + 0.5) / (GROUPS - LATE)
        time.sleep(moment)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(build.pid, signal.SIGKILL)
        ended = build.wait() == 0
        known, finished = done(out), (out / "manifest.json").exists()
        where = "drawing or ended" if finished or ended else "packing" if known >= HOUSES else "planning"
        struck[where if known else "starting"] += 1
        again = subprocess.run(command(calm.houses, out), capture_output=True, check=False)
        same = again.returncode == 0 and contents(out) == calm.contents
        if not same or done(out) < HOUSES:
            wrong.append(round(moment, 2))
        place = f"{moment:.1f} s{' of packing' if late else ''}, {known} houses known"
        said(f"killed {k + 1} of {GROUPS} at {place}: {'same bytes' if same else 'WRONG'}")
        shutil.rmtree(out, ignore_errors=True)
    said(f"{GROUPS} builds of {HOUSES} houses killed, of {calm.seconds:.0f} s each: {len(wrong)} wrong; {dict(struck)}")
    assert not wrong
    assert struck["packing"] >= 10


def test_builds_of_which_a_worker_is_killed(calm: Calm, tmp_path: Path) -> None:
    """In every other build the worker dies within its first second: before its first house, or at it."""
    rng, wrong, struck = np.random.default_rng(8), [], 0
    for number in range(WORKERS):
        out = tmp_path / str(number)
        build = calm.start(out)
        while not (workers := workers_of(build)) and build.poll() is None:
            time.sleep(0.01)
        moment = float(rng.uniform(0, 1.0 if number % 2 else calm.planned - calm.started))
        time.sleep(moment)
        if workers := workers_of(build) or workers:
            with contextlib.suppress(psutil.NoSuchProcess):
                workers[int(rng.integers(len(workers)))].kill()
                struck += 1
        if build.wait() or contents(out) != calm.contents:
            wrong.append(round(moment, 2))
        said(f"killed {struck} workers in {number + 1} of {WORKERS} builds, {len(wrong)} wrong")
        shutil.rmtree(out, ignore_errors=True)
    said(f"{WORKERS} builds of {HOUSES} houses, a worker killed in {struck}: {len(wrong)} wrong {wrong}")
    assert not wrong
    assert struck >= WORKERS // 2  # some builds are at their end already


def workers_of(build: psutil.Popen) -> list[psutil.Process]:
    """Return a build's workers: the children of its child, from which they are forked."""
    with contextlib.suppress(psutil.NoSuchProcess):
        return [child for child in build.children(recursive=True) if child.ppid() != build.pid]
    return []
