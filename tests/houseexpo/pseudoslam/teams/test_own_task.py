"""A task of the user's own, robots that meet: PettingZoo's own tests, and meetings whose truth is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import parallel_env
from houseexpo.pseudoslam.metrics import Bools, Floats, Metrics
from houseexpo.pseudoslam.teams.tasks import TeamEpisode, TeamExploration
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House
from tests.builders.meeting_task import Rendezvous

pytest.importorskip("pettingzoo")

ROOM = FloorPlan("room", [(0, 0), (0, 3), (6, 3), (6, 0)], 1, {})
TWO_ROOMS = FloorPlan(  # a wall of 0.4 m between two rooms, with a door at the top
    "two rooms", [(0, 0), (0, 4), (8, 4), (8, 0), (4.4, 0), (4.4, 3), (4, 3), (4, 0)], 1, {}
)


@pytest.mark.slow
def test_pettingzoo_accepts_it() -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(parallel_env(Rendezvous(), robots=3, dataset=TWO_ROOMS), num_cycles=150)
    parallel_seed_test(lambda: parallel_env(Rendezvous(reward="nearer"), robots=3, dataset=TWO_ROOMS), 60)


def test_two_robots_meet_where_the_distance_says() -> None:
    env = parallel_env(Rendezvous(meet_m=1.5, reward="nearer"), robots=2, dataset=ROOM)
    _, infos = env.reset(seed=0, options={"pose": [(1.0, 1.5, 0.0), (5.0, 1.5, math.pi)]})
    assert infos["robot_0"]["team"]["spread_m"] == pytest.approx(4.0)
    assert infos["robot_0"]["team"]["steps_to_meet"] is None
    steps = 0
    while env.agents:
        observed, rewards, ends, _, infos = env.step(dict.fromkeys(env.agents, 0))
        steps += 1
        apart = 4.0 - 0.6 * steps  # each goes 0.3 m
        assert observed["robot_0"]["robots"] == pytest.approx(np.array([[1.0, apart, 0.0]]), abs=1e-5)
        assert rewards["robot_1"] == pytest.approx(0.6 + float(apart <= 1.5))
        assert all(ends.values()) == (apart <= 1.5)
    team = infos["robot_1"]["team"]
    assert steps == team["steps_to_meet"] == 5  # 4.0 - 5 * 0.6 = 1.0, and 4 steps leave 1.6
    assert team["metres_to_meet"] == pytest.approx(3.0)
    assert infos["robot_0"]["is_success"]


def test_a_wall_keeps_robots_from_meeting_and_from_seeing_each_other() -> None:
    env = parallel_env(Rendezvous(meet_m=2.0), robots=2, dataset=TWO_ROOMS)
    observed, infos = env.reset(seed=0, options={"pose": [(3.5, 1.0, 0.0), (4.9, 1.0, math.pi)]})
    assert not observed["robot_0"]["robots"].any()
    assert infos["robot_0"]["team"]["pairs_in_sight"] == 0.0
    _, rewards, ends, _, infos = env.step(dict.fromkeys(env.agents, 1))
    assert not any(ends.values())
    assert not any(rewards.values())
    # through the door at the top, they see each other; a robot that looks away does not see
    observed, infos = env.reset(options={"pose": [(3.5, 3.5, 0.0), (4.9, 3.5, 0.0)]})
    assert infos["robot_0"]["is_success"]
    assert observed["robot_0"]["robots"] == pytest.approx(np.array([[1.0, 1.4, 0.0]]), abs=1e-6)
    assert not observed["robot_1"]["robots"].any()


def test_one_robot_has_met_and_three_have_only_if_all_have() -> None:
    env = parallel_env(Rendezvous(), robots=1, dataset=ROOM)
    observed, infos = env.reset(seed=0)
    assert infos["robot_0"]["is_success"]
    assert isinstance(observed["robot_0"], np.ndarray)
    env = parallel_env(Rendezvous(meet_m=1.0), robots=3, dataset=ROOM)
    _, infos = env.reset(seed=0, options={"pose": [(1.0, 1.5, 0.0), (1.6, 1.5, 0.0), (2.2, 1.5, 0.0)]})
    assert not infos["robot_0"]["is_success"]  # the first and the last are 1.2 m apart
    _, infos = env.reset(seed=0, options={"pose": [(1.0, 1.5, 0.0), (1.5, 1.5, 0.0), (2.0, 1.5, 0.0)]})
    assert infos["robot_0"]["is_success"]


def test_other_tasks_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"task: expected 'exploration' or a TeamTask, found 'rendezvous'"):
        parallel_env("rendezvous", robots=2, dataset=ROOM)
    with pytest.raises(TypeError, match=r"unexpected keyword argument 'until'"):
        parallel_env(Rendezvous(), robots=2, dataset=ROOM, until="team")


class _Lucky(TeamEpisode):
    """An episode whose steps are worth 7, and that ends at once."""

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:  # noqa: ARG002
        return np.full(len(self.team), 7.0)

    def success(self, now: Metrics) -> bool:  # noqa: ARG002
        return True


class _LuckyExploration(TeamExploration):
    def begin(self, team: Team, house: House | None) -> TeamEpisode:  # noqa: ARG002
        return _Lucky(team)


def test_exploration_with_an_episode_of_its_own_is_asked_what_a_step_is_worth() -> None:
    env = parallel_env(_LuckyExploration(), robots=2, dataset=ROOM)
    env.reset(seed=0)
    _, rewards, ends, _, _ = env.step({"robot_0": 0, "robot_1": 0})
    assert rewards == {"robot_0": 7.0, "robot_1": 7.0}
    assert all(ends.values())
