"""Rewards that can be asked for: shares of a house, costs, and way gone."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig, StartConfig
from tests.builders.simulations import HUTS, native

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
SMALL = SimulatorConfig(pixels_per_metre=20.0, observation=ObservationConfig(3.0))
FORWARD, LEFT, RIGHT = range(3)


def exploring(**given: Any) -> Any:
    given = {"dataset": HUTS, "config": SMALL, "success_coverage": None, **given}
    return gymnasium.make("PseudoSLAM/Exploration-v0", **given).unwrapped


def avoiding(x_m: float, y_m: float, heading_deg: float, **given: Any) -> Any:
    config = replace(SMALL, start=StartConfig(random=False, x_m=x_m, y_m=y_m, heading_deg=heading_deg))
    env = gymnasium.make("PseudoSLAM/ObstacleAvoidance-v0", dataset=HALL, config=config, **given).unwrapped
    env.reset(seed=0)
    return env


def test_shares_of_what_can_be_seen_add_up_to_coverage() -> None:
    env = exploring(reward="coverage")
    _, info = env.reset(seed=1)
    first, total = info["coverage"], 0.0
    for step in range(60):
        before = info["coverage"]
        _, reward, _, _, info = env.step([FORWARD, FORWARD, LEFT][step % 3])
        assert reward == info["coverage"] - before
        total += reward
    assert total == pytest.approx(info["coverage"] - first)
    assert 0 < total <= 1


def test_a_metre_and_a_turn_cost_what_is_said() -> None:
    plain, costly = exploring(), exploring(cost_per_metre=0.5, cost_per_turn=3.0)
    for env in (plain, costly):
        env.reset(seed=2)
    moves = np.random.default_rng(0)
    gone = turned = 0.0
    for _ in range(80):
        action = int(moves.choice(3, p=[0.5, 0.3, 0.2]))
        way = plain.state.episode.readings[0].path_length
        found, paid = (env.step(action)[1] for env in (plain, costly))
        way = (plain.state.episode.readings[0].path_length - way) / 20
        turn = 0.0 if action == FORWARD else 10 / 360  # across the back, too
        assert paid == pytest.approx(found - 0.5 * way - 3.0 * turn)
        gone, turned = gone + way, turned + turn
    assert gone > 2
    assert turned > 1


def test_the_papers_reward_is_the_area_found_and_a_tenth_for_going_on() -> None:
    env = avoiding(2.0, 2.0, 0.0)
    known = env.step(LEFT)[-1]["explored_m2"]
    for action in [FORWARD, LEFT, FORWARD, RIGHT, RIGHT, FORWARD, FORWARD] * 2:
        _, reward, _, _, info = env.step(action)
        assert not info["collided"]
        assert reward == pytest.approx(0.9 * (info["explored_m2"] - known) + 0.1 * (action == FORWARD))
        known = info["explored_m2"]
    env = avoiding(7.7, 2.0, 0.0)
    assert env.step(FORWARD)[1] == -1.0  # whatever it found


def test_who_spins_gets_no_more_than_the_area_around_it() -> None:
    env = avoiding(4.0, 2.0, 0.0)
    known = int(env.state.counts.known)
    rewards = [env.step(LEFT)[1] for _ in range(72)]
    assert sum(rewards[:36]) == pytest.approx(0.9 * (int(env.state.counts.known) - known) / 20**2)
    assert not any(rewards[36:])
    way = avoiding(4.0, 2.0, 0.0, reward="way")
    assert not any(way.step(LEFT)[1] for _ in range(72))


def test_who_moves_gets_way_and_more_of_it_in_the_open() -> None:
    env = avoiding(1.0, 2.0, 0.0, reward="way")
    assert env.step(FORWARD)[1] == pytest.approx(1.0)
    env = avoiding(1.0, 0.45, 0.0, reward="way")  # 0.25 m from the wall on the right: half of what is safe
    assert env.step(FORWARD)[1] == pytest.approx(0.55)
    env = avoiding(1.0, 2.0, 0.0, reward="way", actions="continuous")
    assert env.step(np.array([0.5, 0.0], np.float32))[1] == pytest.approx(0.5)
    assert env.step(np.array([-1.0, 0.0], np.float32))[1] == 0.0  # backing is no way forward
    env = avoiding(7.7, 2.0, 0.0, reward="way")
    assert env.step(FORWARD)[1] == -1.0


def test_driving_beats_spinning_by_both_rewards() -> None:
    """In the paper's setting: a room of 5.5 x 3.2 m, 1 to 5 obstacles, a laser of 5 m, 200 steps."""
    for reward, spinning, driving in (("paper", (4.0, 8.0), 14.0), ("way", (0.0, 0.0), 30.0)):
        spun, drove = (returned(reward, turns) for turns in (True, False))
        assert spinning[0] <= spun <= spinning[1]
        assert drove > max(driving, 2 * spun)


def returned(reward: str, turns: bool) -> float:
    """The mean return of who only turns, or of who goes on where its map shows no obstacle and else turns left."""
    env = native("ObstacleAvoidance", 32, "Disabled", config="paper", reward=reward)
    env.reset(seed=0)
    total = np.zeros(32)
    for _ in range(200):
        on = env.action_masks()[:, FORWARD] & (not turns)
        _, rewards, _, truncated, infos = env.step(np.where(on, FORWARD, LEFT))
        total += rewards
    assert truncated.all()
    assert infos["collisions"].mean() < 0.5
    return float(total.mean())


@pytest.mark.parametrize(
    ("task", "given", "text"),
    [
        ("Exploration", {"reward": "way"}, "reward: expected one of area, coverage; found 'way'"),
        ("ObstacleAvoidance", {"reward": "area"}, "reward: expected one of paper, way; found 'area'"),
        ("Exploration", {"cost_per_turn": 1.0, "actions": "frontier"}, "the rewards of Exploration .* do not add up"),
        ("Exploration", {"cost_per_metre": -1.0}, "cost_per_metre: expected at least 0, found -1"),
        ("Exploration", {"cost_per_turn": math.inf}, "cost_per_turn: expected a finite number, found inf"),
    ],
)
def test_wrong_rewards_are_refused(task: str, given: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        gymnasium.make(f"PseudoSLAM/{task}-v0", dataset=HALL, **given)
