"""Pursuits: PettingZoo's own tests, and people who are seen and caught where the geometry says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import PeopleConfig, SimulatorConfig, parallel_env

pytest.importorskip("pettingzoo")

TWO_ROOMS = FloorPlan(  # a wall of 0.4 m between two rooms, with a door at the top
    "two rooms", [(0, 0), (0, 4), (8, 4), (8, 0), (4.4, 0), (4.4, 3), (4, 3), (4, 0)], 1, {}
)


@pytest.mark.slow
def test_pettingzoo_accepts_it() -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(parallel_env("pursuit", robots=2, dataset=TWO_ROOMS, radio="always"), num_cycles=60)
    parallel_seed_test(lambda: parallel_env("pursuit", robots=2, dataset=TWO_ROOMS, reward="sight"), 30)


def test_people_are_seen_and_caught_where_the_geometry_says() -> None:
    config = SimulatorConfig(known_map=True, people=PeopleConfig(2, least=2), max_steps=150)
    env = parallel_env("pursuit", robots=2, dataset=TWO_ROOMS, capture_m=1.0, reward="sight", config=config)
    rng, total = np.random.default_rng(0), {"robot_0": 0.0, "robot_1": 0.0}
    observed, infos = env.reset(seed=4, options={"pose": [(1.0, 1.0, 0.0), (7.0, 1.0, math.pi)]})
    caught, detected, steps = _check(env, observed, np.zeros(2, bool), None, 0)
    assert not caught.any()
    sights = np.zeros(2)
    while env.agents:
        free = ~caught
        observed, rewards, ends, _, infos = env.step({a: rng.choice([0, 0, 0, 1]) for a in env.agents})
        steps += 1
        was = caught.sum()
        caught, detected, steps = _check(env, observed, caught, detected, steps)
        for k, (agent, reward) in enumerate(rewards.items()):
            sees = (observed[agent]["people"][:, 0] > 0) & free  # no radio: what it sees itself
            sights[k] += sees.any()
            assert reward == pytest.approx((caught.sum() - was) / 2 + sees.any() / 150)
            total[agent] += reward
        assert all(ends.values()) == caught.all()
    team = infos["robot_0"]["team"]
    assert team["caught"] == caught.mean()
    assert team["steps_to_detect"] == detected
    assert team["steps_to_capture"] == (steps if caught.all() else None)
    assert total["robot_0"] == pytest.approx(caught.mean() + sights[0] / 150)


def _check(env, observed, caught, detected, steps):
    """Compare an observation with the truth; return who is caught now and when the first person was seen."""
    team, ppm = env.team, env.team.ppm
    people = team.states[0].episode.bodies.people
    for k, agent in enumerate(env.possible_agents):
        x, y, heading = team.states[k].pose_px
        for p, row in enumerate(observed[agent]["people"]):
            right, up = (people["x"][p] - x) / ppm, (y - people["y"][p]) / ppm
            ahead = right * math.cos(heading) + up * math.sin(heading)
            left = up * math.cos(heading) - right * math.sin(heading)
            free = _free(team.walls, x, y, people["x"][p], people["y"][p])
            sees = ahead >= 0 and math.hypot(ahead, left) <= 5.0 and free
            assert row[0] == sees
            assert row[1:3] == pytest.approx((ahead, left) if sees else (0.0, 0.0), abs=1e-5)
            if sees and detected is None:
                detected = steps
            if math.hypot(ahead, left) <= 1.0 and free:
                caught = caught | (np.arange(len(people)) == p)
                detected = steps if detected is None else detected
    for agent in env.possible_agents:
        assert np.array_equal(observed[agent]["people"][:, 3] > 0, caught)
    return caught, detected, steps


def _free(walls, x, y, to_x, to_y) -> bool:
    """Return whether points of a line, 0.001 px apart, are all free."""
    share = np.linspace(0, 1, int(math.hypot(to_x - x, to_y - y) * 1000) + 2)
    return not walls[(y + share * (to_y - y)).astype(int), (x + share * (to_x - x)).astype(int)].any()


def test_a_robot_is_told_of_people_whom_those_that_it_hears_see() -> None:
    starts = {"pose": [(1.0, 1.0, math.pi), (7.0, 1.0, math.pi)]}
    seen = {}
    for radio in ("none", "always"):
        env = parallel_env("pursuit", robots=2, dataset=TWO_ROOMS, radio=radio, capture_m=0.001)  # nobody is caught
        env.reset(seed=4, options=starts)
        rows = []
        for _ in range(40):
            observed, *_ = env.step(dict.fromkeys(env.agents, 1))
            rows.append([observed[agent]["people"][0, 0] for agent in env.possible_agents])
        seen[radio] = np.array(rows)
    assert np.array_equal(seen["always"][:, 0], seen["none"].max(axis=1))
    assert np.array_equal(seen["always"][:, 0], seen["always"][:, 1])
    assert seen["none"].any()


def test_a_configuration_without_people_gets_one() -> None:
    env = parallel_env("pursuit", robots=1, dataset=TWO_ROOMS, config=SimulatorConfig())
    assert env.config.people.number == 1
    assert env.observation_space("robot_0")["people"].shape == (1, 4)
    with pytest.raises(ConfigError, match="capture_m"):
        parallel_env("pursuit", robots=1, dataset=TWO_ROOMS, capture_m=-1)
