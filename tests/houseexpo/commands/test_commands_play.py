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
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from houseexpo.pseudoslam.agents.driving import DriveSession, drive_by_keys
from houseexpo.pseudoslam.config import SimulatorConfig, StartConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.render.canvas import Image as Picture
from houseexpo.pseudoslam.render.terminal import Terminal, half_blocks
from houseexpo.pseudoslam.tasks import ROOM
from tests.builders.commands import call

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
    result = call("play", "--task", "avoidance", code=2)
    assert "play: expected a terminal for input and output, found none; run it in a terminal" in result


def test_without_houses_it_says_where_to_get_some(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("houseexpo.pseudoslam.render.terminal.Terminal", lambda: None)
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path))
    for task in ("exploration", "navigation"):
        result = call("play", "--task", task, code=2)
        assert f"{task}: which houses?" in result
        assert "make dataset" in result
        assert "houseexpo fetch" in result


# What keys do, what is shown and what is saved.


CONFIG = SimulatorConfig(pixels_per_metre=20.0, start=StartConfig(random=False, x_m=1.0, y_m=1.0), max_steps=30)


class Script:
    """A screen that types: some keys at a time."""

    most_px = (80, 60)

    def __init__(self, *keys: list[str]) -> None:
        self.left, self.shown = list(keys), list[tuple[Picture, str]]()

    def show(self, image: Picture, caption: str = "") -> None:
        self.shown.append((image, caption))

    def keys(self, wait_s: float) -> list[str]:  # noqa: ARG002
        if not self.left:
            raise KeyboardInterrupt
        return self.left.pop(0)


def session(config: SimulatorConfig = CONFIG) -> DriveSession:
    return DriveSession(ExplorationEnv(ROOM, config), 0)


def test_keys_do_what_they_say() -> None:
    driven = session()
    screen = Script(["up", "left"], [], ["t"], ["d", "?"], ["r"], ["w", "q", "w"])
    drive_by_keys(driven, screen)
    assert [row.action for row in driven.rows] == ["", "forward"]  # "r" began anew; nothing counts after "q"
    assert "step 0:" in screen.shown[0][1]
    assert "step 2:" in screen.shown[1][1]
    assert len(screen.shown) == 5  # none where no key was pressed
    assert not np.array_equal(screen.shown[1][0], screen.shown[2][0])  # the truth below the map
    assert driven.rows[1].reward == pytest.approx(driven.rows[1].explored_m2 - driven.rows[0].explored_m2)


@pytest.mark.slow
def test_keys_are_commands_of_a_drive() -> None:
    driven = DriveSession(ExplorationEnv(ROOM, CONFIG, motion="differential"), 0)
    drive_by_keys(driven, Script(["up", "left", "s", "?", "d"]))
    assert [row.action for row in driven.rows] == ["", "forward", "left", "backward", "right"]
    assert driven.rows[1].x_m > driven.rows[0].x_m + 0.1 or driven.rows[1].y_m != driven.rows[0].y_m
    assert driven.rows[2].heading_rad != driven.rows[1].heading_rad
    car = DriveSession(ExplorationEnv(ROOM, CONFIG, motion="ackermann"), 0)
    drive_by_keys(car, Script(["left"]))
    assert car.rows[1].action == "left"
    assert car.rows[1].heading_rad != car.rows[0].heading_rad  # it moves, or it could not turn


def test_it_says_bumps_and_ends() -> None:
    driven = session(replace(CONFIG, max_steps=20))
    for _ in range(19):
        driven.press("up")
    assert "bump!" in driven.caption
    driven.press("a")
    assert driven.caption.startswith(("over: ", "done: "))
    driven.press("a")
    assert driven.rows[-1].step == 20
    driven.press("r")
    assert driven.rows[-1].step == 0
    assert "bump!" not in driven.caption


def test_the_saved_map_is_what_ros_reads(tmp_path: Path) -> None:
    driven = session()
    driven.press("up")
    driven.save(tmp_path)
    state, world = driven._env.state, driven._env.simulator.world
    shades = np.asarray(Image.open(tmp_path / "map.pgm"))
    for known, shade in ((0, 205), (127, 254), (255, 0)):
        assert np.array_equal(shades == shade, state.known == known)
    lines = (tmp_path / "map.yaml").read_text().splitlines()
    assert lines[0] == 'image: "map.pgm"'
    assert "resolution: 0.05" in lines
    assert f"origin: [{world.frame.origin_m[0]:g}, {world.frame.origin_m[1]:g}, 0.0]" in lines
    assert Image.open(tmp_path / "map.png").mode == "RGB"


def test_half_blocks_are_two_pixels_a_character() -> None:
    image = np.zeros((3, 2, 3), np.uint8)
    image[0, 0], image[1, 0], image[0, 1], image[1, 1] = (255, 0, 0), (0, 0, 255), (255, 0, 0), (0, 0, 255)
    image[2] = 255
    first, second = half_blocks(image, many=True)
    assert first == "\x1b[38;2;255;0;0;48;2;0;0;255m▀▀\x1b[0m"
    assert second == "\x1b[38;2;255;255;255;48;2;0;0;0m▀▀\x1b[0m"  # an odd last row has nothing below
    assert half_blocks(image, many=False)[0] == "\x1b[38;5;196;48;5;21m▀▀\x1b[0m"
    assert half_blocks(np.full((2, 1, 3), 128, np.uint8), many=False) == ["\x1b[38;5;244;48;5;244m▀\x1b[0m"]
