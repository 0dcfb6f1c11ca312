"""A robot on show does what a browser asks for, and what is saved is what ``houseexpo play`` saves."""

from __future__ import annotations

import csv
import io
import zipfile
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import LaserConfig
from houseexpo.service.drive.frames import COLLIDED, ENDED, SUCCESS
from houseexpo.service.drive.messages import Start
from houseexpo.service.drive.robots import Robot, explorers
from tests.builders.driving import frame_from, painted, two_rooms


def robot(**words: Any) -> Robot:
    return Robot(two_rooms(), Start("two_rooms", **words))


def test_frames_show_the_robots_own_map() -> None:
    driven = robot()
    shown = np.zeros((driven.hello()["rows"], driven.hello()["cols"]), np.uint8)
    painted(shown, frame_from(driven.frame()))
    for _ in range(30):
        assert driven.move(0.0, 1.0)
    painted(shown, frame_from(driven.frame()))  # of all thirty at once
    assert np.array_equal(shown, driven._env.state.known)
    assert (shown == 127).sum() > 1000


def test_a_second_ahead_is_as_far_as_the_speed_says() -> None:
    driven = robot(speed="slow")
    driven.move(0.0, 1.0)
    before = frame_from(driven.frame())
    while not frame_from(driven.frame()).flags & COLLIDED:
        driven.move(1.0, 0.0)
        if frame_from(driven.frame()).path_m >= 0.5:
            break
    after = frame_from(driven.frame())
    steps = len(driven._drive.rows) - 2
    assert after.path_m - before.path_m == pytest.approx(0.75 / 30 * steps, abs=0.03)


def test_at_rest_time_stands_still_unless_there_are_people() -> None:
    assert not robot().move(0.0, 0.0)
    assert robot(people=2).move(0.0, 0.0)


def test_what_is_saved_is_what_play_saves() -> None:
    driven = robot(seed=3)
    for _ in range(5):
        driven.move(1.0, 0.5)
    data = driven.saved()
    archive = zipfile.ZipFile(io.BytesIO(data))
    assert archive.namelist() == ["map.pgm", "map.png", "map.yaml", "trajectory.csv"]
    rows = list(csv.DictReader(io.StringIO(archive.read("trajectory.csv").decode())))
    assert [row["action"] for row in rows] == ["", *["forward left"] * 5]
    again = robot(seed=3)
    for _ in range(5):
        again.move(1.0, 0.5)
    assert again.saved() == data


def test_options_are_simulated() -> None:
    config = Start("p", range_m=10, fov_deg=360, noise="much", people=3, obstacles=4).config
    assert config.laser == LaserConfig(range_m=10, fov_deg=360)
    assert config.noise.any
    assert config.people.number == 3
    assert config.obstacles.random is not None
    assert config.obstacles.random.number == (4, 4)


def test_explorers_are_those_of_the_benchmark_and_explore() -> None:
    assert {"frontier", "information", "tour", "oracle", "wall", "random"} <= set(explorers())
    assert not {"a-star", "greedy"} & set(explorers())
    watched = robot(driver="frontier", seed=1)
    for _ in range(300):
        watched.explore()
    found = frame_from(watched.frame())
    assert found.flags & ENDED
    assert found.flags & SUCCESS
    assert found.coverage > 0.98
    assert not watched.explore()


@pytest.mark.parametrize("driver", ["os:system", "policy.py", "houseexpo.pseudoslam.agents.forward:Forward", ""])
def test_files_and_modules_are_no_explorers(driver: str) -> None:
    with pytest.raises(ConfigError, match="driver: expected you or one of"):
        robot(driver=driver)
