"""The README's recipes run as they stand, one after the other, in an empty folder."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from http import HTTPStatus
from pathlib import Path

import pytest

from pipeline.algorithm import plan_level
from tests.builders.batch import run_build

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()
SERVED = [
    line.partition(" #")[0].strip()
    for line in README.splitlines()
    if line.startswith(("houseexpo serve", "houseexpo review"))
]
INTERRUPTED = 130

pytestmark = pytest.mark.slow


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """An environment in which the command ``houseexpo`` is this checkout's."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, words in (("houseexpo", "-m houseexpo"), ("python", "")):
        (folder / name).write_text(f'#!/bin/sh\nexec {sys.executable} {words} "$@"\n')
        (folder / name).chmod(0o755)
    return {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}


def test_the_recipes_run_one_after_the_other(tmp_path: Path, environment: dict[str, str]) -> None:
    script = subprocess.run([ROOT / ".ci" / "recipes", ROOT / "README.md"], check=True, capture_output=True, text=True)
    (tmp_path / "here").mkdir()
    done = subprocess.run(
        ["bash", "-c", script.stdout],
        check=False, cwd=tmp_path / "here", env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    ran = {line.split()[2] for line in done.stdout.splitlines() if line.startswith("$ houseexpo ")}
    assert {"demo", "build", "inspect", "assemble", "info", "split", "export", "stats", "release"} <= ran
    assert [each.name for each in (tmp_path / "here").iterdir()] == ["try"]


@pytest.mark.parametrize("line", SERVED)
def test_a_service_starts_answers_and_ends(line: str, tmp_path: Path, environment: dict[str, str]) -> None:
    pytest.importorskip("starlette")
    run_build([Path("procedural:2")], tmp_path / "plans" / "demo", seed=3, plan=plan_level)
    with subprocess.Popen(
        f"{line} --port 0".split(), cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
    ) as service:
        try:
            assert service.stdout is not None
            (address,) = next(filter(None, (re.findall(r"http://\S+", said) for said in service.stdout)))
            with urllib.request.urlopen(address, timeout=30) as page:  # noqa: S310 - this machine's own
                assert page.status == HTTPStatus.OK
        finally:
            service.send_signal(signal.SIGINT)
            ended = service.wait(30)
    is_ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN  # these tests run as a job in the background
    assert ended == (0 if is_ignored else INTERRUPTED)
