"""Driving by hand: what keys do, what is shown and what is saved."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.pseudoslam.agents.driving import DriveSession, drive_by_keys
from houseexpo.pseudoslam.config import SimulatorConfig, StartConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.render.canvas import Image as Picture
from houseexpo.pseudoslam.render.terminal import half_blocks
from houseexpo.pseudoslam.tasks import ROOM

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


def test_the_keyboard_may_interrupt() -> None:
    driven = session()
    drive_by_keys(driven, Script(["up"]))
    assert len(driven.rows) == 2


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


def test_a_window_can_be_driven_in(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr("houseexpo.pseudoslam.render.window.Window.keys", _typed(pygame))
    words = ["play", "--window", "--task", "avoidance", "--seed", "1", "--out", str(tmp_path)]
    result = CliRunner().invoke(make_app(), words)
    assert result.exit_code == 0, result.output
    assert "step 2:" in result.output
    assert len((tmp_path / "trajectory.csv").read_text().splitlines()) == 4
    assert not pygame.display.get_init()


def _typed(pygame: object) -> object:
    """Make the window's keys come from the events of a keyboard that this test presses."""
    from houseexpo.pseudoslam.render.window import Window

    ask, presses = Window.keys, [[pygame.K_UP, pygame.K_a], [pygame.QUIT]]

    def keys(self: Window, wait_s: float) -> list[str]:
        for key in presses.pop(0):
            event = (
                pygame.event.Event(pygame.QUIT) if key == pygame.QUIT else pygame.event.Event(pygame.KEYDOWN, key=key)
            )
            pygame.event.post(event)
        return ask(self, wait_s)

    return keys
