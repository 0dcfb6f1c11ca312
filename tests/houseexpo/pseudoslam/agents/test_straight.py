"""The explorer that goes straight: its ways are lines between corners, and it looks round after each step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.learned import straight
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import PolicyFactory, make_knowledge, make_robot, read_interface
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from tests.houseexpo.pseudoslam.agents.test_look_around import HALL

CONFIG = SimulatorConfig(pixels_per_metre=12.5)
BARN = FloorPlan("barn", [(0, 0), (0, 9), (30, 9), (30, 0)], 1, {})
"""A room without corners in which its robot sees 5 m far."""
TURNS = FloorPlan(
    "turns", [(0, 0), (0, 6), (6, 6), (6, 2), (8, 2), (8, 9), (14, 9), (14, 7.2), (10, 7.2), (10, 0)], 1, {}
)


def walk(
    factory: PolicyFactory, house: FloorPlan, seed: int, config: SimulatorConfig = CONFIG
) -> tuple[np.ndarray, ExplorationEnv]:
    """Return the robot's places (n, 2), pixels, after each step on which it moved, and the environment in the end."""
    interface = read_interface(factory)
    env = ExplorationEnv(house, config, success_coverage=1.0, actions=interface.actions)
    env.reset(seed=seed)
    policy = factory(make_robot(env, interface), 0)
    places = [env.state.pose_px[:2].copy()]
    for _ in range(1500):
        action = policy(None, make_knowledge(env.simulator, env.state))
        if action is None:
            break
        env.step(action)
        if not np.array_equal(env.state.pose_px[:2], places[-1]):
            places.append(env.state.pose_px[:2].copy())
    return np.array(places), env


@pytest.mark.parametrize("house", [HALL, BARN], ids=["hall", "barn"])
def test_it_sees_all_and_touches_nothing(house: FloorPlan) -> None:
    for seed in range(3):
        _, env = walk(straight, house, seed)
        assert env.simulator.coverage(env.state) > 0.99
        assert env.state.counts.collisions == 0


def test_it_goes_on_where_it_touches_a_corner_of_a_coarse_map() -> None:
    coarse = SimulatorConfig(pixels_per_metre=5.0)  # the robot's radius is one cell
    for seed in range(8):
        _, env = walk(straight, TURNS, seed, coarse)
        assert env.simulator.coverage(env.state) > 0.99


def test_where_nothing_is_in_between_its_way_is_a_straight_line() -> None:
    places, _ = walk(straight, BARN, 0)
    steps = np.diff(places, axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    bends = np.abs(np.angle(np.exp(1j * np.diff(headings))))
    assert np.mean(bends < math.radians(2)) > 0.5  # most steps go on as the last one did
    assert not np.allclose(np.degrees(headings) % 10, np.degrees(headings[0]) % 10, atol=0.1)  # not in turns of 10


def test_it_has_the_weights_of_look_around_and_a_row_of_its_own() -> None:
    policy = load_policy("straight")
    assert policy.training.family == "straight"  # type: ignore[union-attr]
    assert policy.sha256 == load_policy("look-around").sha256
