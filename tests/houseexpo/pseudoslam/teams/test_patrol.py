"""Patrols: PettingZoo's own tests, and idleness that is counted by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import map_house, parallel_env
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.teams.tasks.rasters import number_squares

pytest.importorskip("pettingzoo")

CORRIDOR = FloorPlan("corridor", [(0, 0), (0, 1), (4, 1), (4, 0)], 1, {})
TWO_ROOMS = FloorPlan(  # a wall of 0.4 m between two rooms, with a door at the top
    "two rooms", [(0, 0), (0, 4), (8, 4), (8, 0), (4.4, 0), (4.4, 3), (4, 3), (4, 0)], 1, {}
)


@pytest.mark.slow
def test_pettingzoo_accepts_it() -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(parallel_env("patrol", robots=3, dataset=TWO_ROOMS), num_cycles=100)
    parallel_seed_test(lambda: parallel_env("patrol", robots=2, dataset=TWO_ROOMS, places="rooms", layout="HWC"), 40)


def test_one_robot_that_walks_along_squares_leaves_the_idleness_that_is_counted_by_hand() -> None:
    config = SimulatorConfig(known_map=True, max_steps=100)
    env = parallel_env("patrol", robots=1, dataset=CORRIDOR, config=config, square_m=2.0)
    observed, infos = env.reset(seed=0, options={"pose": (0.6, 0.5, 0.0)})
    assert int(env.episode.labels.max()) == 2  # squares of 2 m: x up to 2, and from 2 on
    assert infos["robot_0"]["team"]["visited"] == 0.5
    idle, worst, means, rewards = np.zeros(2), 0.0, [], []
    for step in range(1, 12):  # at 0.6 m and 0.3 m a step: in the second square from step 5 on
        observed, reward, ends, _, infos = env.step({"robot_0": 0})
        here = int(step >= 5)
        idle += 1
        removed = idle[here]
        idle[here] = 0
        means.append(idle.mean())
        worst = max(worst, idle.max())
        rewards.append(removed / 2)
        assert reward["robot_0"] == pytest.approx(rewards[-1])
        assert not ends["robot_0"]
        assert set(np.unique(observed["robot_0"]["idleness"])) <= {0, 1, 255}
    team = infos["robot_0"]["team"]
    assert team["mean_idleness"] == pytest.approx(np.mean(means))
    assert team["worst_idleness"] == worst
    assert team["idleness_now"] == idle.mean()
    arrived = next(k for k, reward in enumerate(rewards) if reward > 0.5)
    assert team["visit_idleness"] == rewards[arrived] * 2  # one arrival, in the second square
    assert team["visited"] == 1.0


def test_two_robots_in_a_place_share_what_they_remove_and_idleness_is_a_shared_cost() -> None:
    starts = {"pose": [(0.5, 0.5, 0.0), (1.2, 0.5, math.pi)]}
    env = parallel_env("patrol", robots=2, dataset=CORRIDOR, square_m=2.0)
    env.reset(seed=0, options=starts)
    _, rewards, *_ = env.step({"robot_0": 1, "robot_1": 1})
    assert rewards == {"robot_0": 0.25, "robot_1": 0.25}  # 1 step, two robots, two places
    env = parallel_env("patrol", robots=2, dataset=CORRIDOR, square_m=2.0, reward="idleness")
    env.reset(seed=0, options=starts)
    for k in (1, 2):
        _, rewards, *_ = env.step({"robot_0": 1, "robot_1": 1})
        assert rewards == {"robot_0": -k / 2, "robot_1": -k / 2}


def test_rooms_are_places() -> None:
    env = parallel_env("patrol", robots=1, dataset=TWO_ROOMS, places="rooms")
    env.reset(seed=0, options={"pose": (1.0, 1.0, 0.0)})
    labels = env.episode.labels
    assert int(labels.max()) == len(TWO_ROOMS.divided.rooms) == 2
    _, _, _, _, infos = env.step({"robot_0": 1})
    assert infos["robot_0"]["team"]["idleness_now"] == 0.5


def test_squares_are_divided_by_walls_and_slivers_do_not_count() -> None:
    standing = np.ones((4, 10), np.uint8)
    standing[:, 2] = 0  # two columns to the left, one to the right, of a square of four
    labels = number_squares(standing, 4.0)
    assert labels.max() == 4  # the last square is two wide: half of one
    assert (labels[:, :2] == 1).all()
    assert (labels[:, 3] == 2).all()
    assert (labels[:, 4:8] == 3).all()
    assert (labels[:, 8:] == 4).all()
    standing[1:, 3] = 0  # one cell is less than a quarter
    assert number_squares(standing, 4.0)[0, 3] == 0


def test_a_map_has_no_rooms() -> None:
    house = map_house(np.pad(np.zeros((40, 60), np.int8), 1, constant_values=100), resolution=0.1)
    env = parallel_env("patrol", robots=1, dataset=house, places="rooms")
    with pytest.raises(ConfigError, match="places: expected plans with rooms"):
        env.reset(seed=0)
    env = parallel_env("patrol", robots=1, dataset=house)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="square_m"):
        parallel_env("patrol", robots=1, dataset=house, square_m=-1)
