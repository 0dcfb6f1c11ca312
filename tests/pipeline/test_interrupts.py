"""Ctrl-C at any moment: a clean end within seconds, no process left, exit code 130, and the command that goes on."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import psutil
import pytest

from tests.builders.batch import contents, one_room


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["starting", "importing", "locked", "working"])
def test_ctrl_c_ends_a_build_and_the_same_command_goes_on(moment: str, tmp_path: Path) -> None:
    journal = tmp_path / "out" / ".build" / "journal.jsonl"
    reached = {
        "starting": lambda worked: worked > 0.6,
        "importing": lambda worked: worked > 1.2,
        "locked": lambda _: journal.exists(),
        "working": lambda _: journal.exists() and journal.stat().st_size > 0,
    }[moment]
    command = [sys.executable, "-m", "houseexpo", "build", "procedural:500", "--out", str(tmp_path / "out")]
    build = psutil.Popen(command, stderr=-1, stdout=-1, start_new_session=True, text=True)
    while not reached(build.cpu_times().user):  # of its own time: on a loaded machine Python itself takes a second
        time.sleep(0.01)
    family = build.children(recursive=True)
    os.killpg(build.pid, signal.SIGINT)
    said = build.communicate(timeout=30.0)[1]
    assert build.returncode == 130
    assert "Traceback" not in said
    assert moment in {"starting", "importing"} or "this goes on with the rest: " in said
    _, alive = psutil.wait_procs(family, timeout=30.0)
    assert not alive


@pytest.mark.slow
def test_ctrl_c_that_a_library_swallows_ends_the_build_all_the_same(tmp_path: Path) -> None:
    code = """
import os, signal, time
from pipeline.cli_common import handle_ctrl_c
with handle_ctrl_c("last words"):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)
    except KeyboardInterrupt:
        pass
    time.sleep(60)
"""
    done = psutil.Popen([sys.executable, "-c", code], stderr=-1, text=True)
    assert done.communicate(timeout=30.0)[1] == "last words\n"
    assert done.returncode == 130


def test_verify_says_what_is_damaged_and_ends_with_1(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    from houseexpo.commands.app import make_app

    house, out = str(one_room(tmp_path / "house.ply")), str(tmp_path / "out")
    run = CliRunner()
    assert run.invoke(make_app(), ["build", house, "--out", out]).exit_code == 0
    assert "nothing to do" in run.invoke(make_app(), ["build", house, "--out", out]).output
    before = contents(tmp_path / "out")
    assert run.invoke(make_app(), ["build", "--verify", out]).exit_code == 0
    [plan] = (tmp_path / "out" / "json").iterdir()
    plan.write_text("{}")
    found = run.invoke(make_app(), ["build", "--verify", out])
    assert (found.exit_code, plan.name in found.output) == (1, True)
    assert run.invoke(make_app(), ["build", house, "--out", out]).exit_code == 0
    assert contents(tmp_path / "out") == before
