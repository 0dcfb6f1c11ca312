"""``houseexpo play``: in a pseudo-terminal as a person would, and its parts."""

from __future__ import annotations

import csv
import fcntl
import io
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.pseudoslam.render.terminal import Terminal

TIMEOUT_S = 60.0  # the first one compiles


class Person:
    """A program in a pseudo-terminal of 80 x 24, and who sits there."""

    def __init__(self, *words: str | Path) -> None:
        self.ours, self.theirs = pty.openpty()
        fcntl.ioctl(self.theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        self.before = termios.tcgetattr(self.theirs)
        self.seen = b""
        command = [sys.executable, "-m", "houseexpo", "play", *map(str, words)]
        environment = {**os.environ, "TERM": "xterm-256color", "COLORTERM": ""}
        self.program = subprocess.Popen(
            command, stdin=self.theirs, stdout=self.theirs, stderr=self.theirs, env=environment, start_new_session=True
        )

    def wait_for(self, words: bytes) -> None:
        """Read on until these words come."""
        start, end = len(self.seen), time.monotonic() + TIMEOUT_S
        while words not in self.seen[start:]:
            assert time.monotonic() < end, self.seen[-2000:]
            assert self.program.poll() is None, self.seen[-2000:]
            if select.select([self.ours], [], [], 0.2)[0]:
                self.seen += os.read(self.ours, 65536)

    def type(self, keys: bytes) -> None:
        os.write(self.ours, keys)

    def leaves(self) -> int:
        """Return the exit status; the terminal must be as it was."""
        end = time.monotonic() + TIMEOUT_S
        while self.program.poll() is None:
            assert time.monotonic() < end
            if select.select([self.ours], [], [], 0.1)[0]:
                self.seen += os.read(self.ours, 65536)
        while select.select([self.ours], [], [], 0)[0]:
            self.seen += os.read(self.ours, 65536)
        assert termios.tcgetattr(self.theirs) == self.before
        assert self.seen.rfind(b"\x1b[?1049l") > self.seen.rfind(b"\x1b[?1049h") > 0
        assert self.seen.rfind(b"\x1b[?25h") > self.seen.rfind(b"\x1b[?25l") > 0
        return self.program.returncode


@contextmanager
def at_a_terminal(*words: str | Path) -> Iterator[Person]:
    person = Person(*words)
    try:
        yield person
    finally:
        if person.program.poll() is None:
            person.program.kill()
            person.program.wait()
        os.close(person.ours)
        os.close(person.theirs)


def test_a_person_drives_quits_and_finds_the_files(tmp_path: Path) -> None:
    with at_a_terminal("--task", "avoidance", "--seed", "3", "--out", tmp_path / "run") as person:
        person.wait_for(b"step 0:")
        person.type(b"\x1b[D\x1b[D")
        person.wait_for(b"step 2:")
        person.type(b"w\x1bOC")  # the other kind of arrow
        person.wait_for(b"step 4:")
        person.type(b"xq")
        assert person.leaves() == 0
    assert "▀".encode() in person.seen
    assert b"\x1b[38;5;" in person.seen  # 256 colours
    assert b"trajectory.csv" in person.seen
    with (tmp_path / "run" / "trajectory.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == ["step", "action", "x_m", "y_m", "heading_rad", "reward", "explored_m2"]
    assert [row["action"] for row in rows] == ["", "left", "left", "forward", "right"]
    assert [row["step"] for row in rows] == list("01234")
    headings = [float(row["heading_rad"]) for row in rows]
    turns = np.rad2deg([headings[1] - headings[0], headings[2] - headings[1], headings[4] - headings[3]])
    assert ((turns + 180) % 360 - 180).tolist() == pytest.approx([10, 10, -10])
    assert {file.name for file in (tmp_path / "run").iterdir()} == {"map.pgm", "map.yaml", "map.png", "trajectory.csv"}


@pytest.mark.slow
@pytest.mark.parametrize("ending", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_the_terminal_is_given_back_whatever_happens(ending: signal.Signals) -> None:
    with at_a_terminal("--task", "avoidance") as person:
        person.wait_for(b"step 0:")
        person.program.send_signal(ending)
        assert person.leaves() == (0 if ending == signal.SIGINT else 128 + ending)


def test_a_signal_that_a_finaliser_swallows_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    class Swallows:
        def __del__(self) -> None:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)

    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "r+b", buffering=0) as raw, io.TextIOWrapper(raw, write_through=True) as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setattr(sys, "unraisablehook", lambda _: None)
        with Terminal() as terminal:
            Swallows()
            with pytest.raises(KeyboardInterrupt):
                terminal.keys(0.0)
    os.close(ours)


def test_without_a_terminal_it_says_so() -> None:
    result = CliRunner().invoke(make_app(), ["play", "--task", "avoidance"])
    assert result.exit_code == 2
    assert (
        "play: expected a terminal for input and output, found none; run it in a terminal, or with --window"
        in result.output
    )


def test_a_folder_that_cannot_be_is_refused_before_the_drive(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    result = CliRunner().invoke(make_app(), ["play", "--task", "avoidance", "--out", str(tmp_path / "taken")])
    assert result.exit_code == 2
    assert "expected a folder or nothing, found the file" in result.output


def test_without_houses_it_says_where_to_get_some(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path))
    for task in ("exploration", "navigation"):
        result = CliRunner().invoke(make_app(), ["play", "--window", "--task", task])
        assert result.exit_code == 2
        assert f"{task}: which houses?" in result.output
        assert "make dataset" in result.output
        assert "houseexpo fetch" in result.output
