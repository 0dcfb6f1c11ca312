"""Exploration on a SLAM's map: its pose and map replace the simulator's, and its errors are those that are counted."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.slam_env import SlamEnv, _compose_motion
from tests.builders.simulations import hut

NOISY = NoiseConfig(laser_m=0.02, odometry_way=0.05, odometry_turn=0.05, odometry_deg_per_m=2.0, drop_out=0.05)
CONFIG = SimulatorConfig(laser=LaserConfig(5.0, 180.0, 0.5), noise=NOISY, max_steps=200)
HOUSE = hut("hut", 5.0)
WALK = [1, 1, 0, 0, 1, 1, 1, 0, 0, 2, 2, 0, 0, 0, 1, 1, 1, 1, 0, 0] * 3


def walked(env: SlamEnv, seed: int = 4) -> list[dict[str, object]]:
    env.reset(seed=seed)
    return [env.step(action)[4] for action in WALK]


def test_the_observation_the_info_and_the_state_are_those_of_the_slams_map() -> None:
    env = SlamEnv([HOUSE], CONFIG, success_coverage=None)
    walked(env)
    observation, _, _, _, info = env.step(1)
    state = env.state
    known = np.empty_like(state.known)
    assert env._slam is not None
    env._slam.draw(known)
    assert np.array_equal(state.known, known)
    assert np.array_equal(observation[0], state.view)
    seen = np.count_nonzero((known != 0) & (state.episode.observable != 0))
    assert info["coverage"] == pytest.approx(seen / state.observable_cells)
    assert info["coverage"] > 0.5
    assert set(np.unique(known)) <= {0, 127, 255}


def test_the_slam_errs_less_than_its_odometry() -> None:
    env = SlamEnv([HOUSE], CONFIG, success_coverage=None)
    for seed in (4, 5):
        walked(env, seed)
        errors = env.errors()
        assert errors["ate_m"] < 0.08
        assert errors["odometry_ate_m"] > 1.5 * errors["ate_m"]
        assert errors["iou_seen_free"] > 0.95
        assert errors["iou_seen_walls"] > 0.4


def test_without_noise_the_pose_is_nearly_true_and_odometry_is_exact() -> None:
    env = SlamEnv([HOUSE], replace(CONFIG, noise=NoiseConfig()), success_coverage=None)
    walked(env)
    errors = env.errors()
    assert errors["odometry_ate_m"] == pytest.approx(0.0, abs=1e-9)
    assert errors["ate_m"] < 0.02
    assert errors["heading_deg"] < 0.5


def test_equal_seeds_are_equal_to_the_bit() -> None:
    one, other = SlamEnv([HOUSE], CONFIG), SlamEnv([HOUSE], CONFIG)
    walked(one), walked(other)
    assert np.array_equal(one.state.known, other.state.known)
    assert np.array_equal(one.state.poses_px, other.state.poses_px)
    walked(one)  # a second episode knows nothing of the first
    assert np.array_equal(one.state.known, other.state.known)


def test_a_motion_is_applied_relative_to_the_robot() -> None:
    """One cell ahead and a quarter turn to the left, from a robot that looks up the picture."""
    before, after = np.array([5.0, 5.0, 0.0]), np.array([6.0, 5.0, math.pi / 2])
    assert _compose_motion(np.array([2.0, 8.0, math.pi / 2]), before, after) == pytest.approx([2.0, 7.0, math.pi])


def test_planners_actions_and_other_observations_are_refused() -> None:
    with pytest.raises(ConfigError, match="a SLAM in the loop: expected actions 'discrete' or 'continuous'"):
        SlamEnv([HOUSE], CONFIG, actions="frontier")
    with pytest.raises(ConfigError, match="found 'discrete' and 'dict'"):
        SlamEnv([HOUSE], CONFIG, observation="dict")
