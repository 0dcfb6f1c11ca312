"""A robot on show does what a browser asks for, and what is saved is what ``houseexpo play`` saves."""

from __future__ import annotations

import csv
import io
import zipfile
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.service.drive.messages import COLLIDED, ENDED, SUCCESS, StartDrive
from houseexpo.service.drive.robots import DrivenRobot, explorer_names
from tests.builders.browsing import frame_from, painted, two_rooms


def robot(**words: Any) -> DrivenRobot:
    return DrivenRobot(two_rooms(), StartDrive("two_rooms", **words))


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


def test_what_is_saved_is_what_play_saves() -> None:
    driven = robot(seed=3)
    for _ in range(5):
        driven.move(1.0, 0.5)
    data = driven.archive()
    archive = zipfile.ZipFile(io.BytesIO(data))
    assert archive.namelist() == ["map.pgm", "map.png", "map.yaml", "trajectory.csv"]
    rows = list(csv.DictReader(io.StringIO(archive.read("trajectory.csv").decode())))
    assert [row["action"] for row in rows] == ["", *["forward left"] * 5]
    again = robot(seed=3)
    for _ in range(5):
        again.move(1.0, 0.5)
    assert again.archive() == data


def test_a_wall_that_is_pushed_against_is_bumped_into_once() -> None:
    driven = robot(seed=3)
    flags, bumps, path_m = 0, 0, 0.0
    for _ in range(200):
        driven.move(1.0, 0.0)
        found = frame_from(driven.frame())
        flags, bumps, path_m = flags | found.flags, found.bumps, found.path_m
    assert flags & COLLIDED
    assert bumps == 1
    for _ in range(60):  # turning on the spot is still the same wall
        driven.move(0.0, 1.0)
    driven.move(1.0, 0.0)
    while not frame_from(driven.frame()).flags & COLLIDED:
        driven.move(1.0, 0.0)
    found = frame_from(driven.frame())
    assert found.bumps == 2
    assert found.path_m > path_m


def test_people_keep_their_numbers_and_walk_where_they_head() -> None:
    driven = robot(people=3, fov_deg=360, range_m=10, seed=2)
    before: dict[float, Any] = {}
    compared = 0
    for _ in range(60):
        driven.move(0.0, 0.0)
        for number, x, y, radius, across, down in frame_from(driven.frame()).bodies.tolist():
            assert radius == pytest.approx(0.2 * 25, abs=0.5)
            if number in before and np.hypot(across, down) > 10:
                way = np.array([x, y]) - before[number]
                assert np.dot(way, [across, down]) > 0
                compared += 1
            before[number] = np.array([x, y])
    assert compared > 20


def test_explorers_are_those_of_the_benchmark_and_explore() -> None:
    assert {"frontier", "information", "tour", "oracle", "wall", "random"} <= set(explorer_names())
    assert not {"a-star", "greedy"} & set(explorer_names())
    watched = robot(driver="frontier", seed=1)
    for _ in range(300):
        watched.advance()
    found = frame_from(watched.frame())
    assert found.flags & ENDED
    assert found.flags & SUCCESS
    assert found.coverage > 0.98
    assert not watched.advance()


@pytest.mark.parametrize("driver", ["os:system", "policy.py", "houseexpo.pseudoslam.agents.simple:Forward", ""])
def test_files_and_modules_are_no_explorers(driver: str) -> None:
    with pytest.raises(ConfigError, match="driver: expected you or one of"):
        robot(driver=driver)


def test_a_person_takes_over_from_an_explorer() -> None:
    watched = robot(driver="frontier", seed=1)
    for number in range(400):
        if 5 <= number < 12:
            assert watched.take_over(0.0, 1.0)
        elif not watched.advance():
            break
    assert watched.ended
    rows = watched._drive.rows
    assert [row.action for row in rows[6:13]] == ["1"] * 7
    assert not watched.take_over(1.0, 0.0)
    figures = watched.finish()
    assert figures["coverage"] > 0.98


@pytest.mark.slow
def test_a_policy_of_the_server_drives() -> None:
    start = StartDrive("two_rooms", driver="mine")
    watched = DrivenRobot(two_rooms(), start, policies={"mine": "tests.builders.policies:Continuous"})
    for _ in range(30):
        assert watched.advance()
    before_rad = watched._env.state.believed_px[2]
    assert watched.take_over(0.0, 1.0)
    assert watched._env.state.believed_px[2] != before_rad
    figures = watched.finish()
    assert figures["steps"] == 31
    with pytest.raises(ConfigError, match=r"driver: expected you or one of .*, mine; found 'other'"):
        DrivenRobot(two_rooms(), StartDrive("two_rooms", driver="other"), policies={"mine": "mine.py"})
    broken = DrivenRobot(two_rooms(), start, policies={"mine": "tests.builders.policies:raises"})
    broken.advance()
    with pytest.raises(PolicyError, match="policy 'mine' failed: KeyError"):
        broken.advance()
