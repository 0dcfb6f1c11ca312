from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import houseexpo.pseudoslam  # registers the environments
from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import NoiseConfig, ObservationConfig, SimulatorConfig

ID = "PseudoSLAM/Exploration-v0"
SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(4.0), max_steps=40)


def hut(plan_id: str, side: float) -> FloorPlan:
    return FloorPlan(plan_id, [(0, 0), (0, side), (1.6 * side, side), (1.6 * side, 0)], 1, {})


PLANS = [hut("small", 3.0), hut("middle", 4.5), hut("large", 6.0)]


def make(config: SimulatorConfig = SMALL, **other: Any) -> gymnasium.Env:
    return gymnasium.make(ID, dataset=PLANS, config=config, **other)


def played(env: gymnasium.Env, seed: int) -> list[bytes]:
    """Two episodes, the second without a seed, as bytes."""
    found = []
    moves = np.random.default_rng(3)
    for this in (seed, None):
        observation, info = env.reset(seed=this)
        found += [info["plan_id"].encode(), observation.tobytes()]
        for _ in range(30):
            observation, reward, *_, info = env.step(moves.integers(3))
            found += [observation.tobytes(), np.float64(reward).tobytes(), info["pose"].tobytes()]
    return found


def test_gymnasium_finds_nothing_wrong() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(render_mode="rgb_array").unwrapped)


def test_the_seed_of_a_reset_decides_everything() -> None:
    """The published simulator seeds numpy's global state with 0, and ``seed`` does nothing."""
    config = replace(SMALL, noise=NoiseConfig(0.02, 0.02, 0.5))
    env = make(config)
    first = played(env, 5)
    assert played(env, 5) == first
    assert played(make(config), 5) == first
    assert played(env, 6) != first


def test_rewards_add_up_to_the_area_that_became_known() -> None:
    env = make(success_coverage=None)
    _, info = env.reset(seed=1)
    before, total = info["explored_m2"], 0.0
    for step in range(40):
        _, reward, terminated, truncated, info = env.step([0, 0, 1][step % 3])
        assert reward >= 0
        total += reward
        assert (terminated, truncated) == (False, step == 39)
    assert total == pytest.approx(info["explored_m2"] - before)


def test_an_episode_can_end_well() -> None:
    """The published simulator asks for cells that cannot be seen."""
    env = make(success_coverage=1.0)
    env.reset(seed=2, options={"plan_id": "small"})
    for _ in range(36):
        _, _, terminated, _, info = env.step(1)
        if terminated:
            break
    assert terminated
    assert info["is_success"]
    assert info["coverage"] == 1


def test_observations_are_copies_and_the_robot_is_not_on_them() -> None:
    env = make()
    first, _ = env.reset(seed=3)
    kept = first.copy()
    second, *_ = env.step(1)
    assert np.array_equal(first, kept)
    assert not np.array_equal(first, second)
    assert set(np.unique(second).tolist()) <= {0, 127, 255}
    assert second.shape == (1, 64, 64)


def test_a_collision_is_told_and_counted() -> None:
    env = make(replace(SMALL, max_steps=200))
    env.reset(seed=4, options={"plan_id": "small"})
    told = []
    for _ in range(25):
        *_, info = env.step(0)
        told.append(info["collided"])
    assert info["collisions"] == sum(told) > 0
    *_, info = env.step(1)
    assert not info["collided"]


def test_it_never_runs_out_of_plans() -> None:
    env = make()
    seen = [env.reset(seed=0)[1]["plan_id"], *(env.reset()[1]["plan_id"] for _ in range(30))]
    assert set(seen) == {"small", "middle", "large"}


def test_what_cannot_be_is_refused() -> None:
    env = make().unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(0)
    env.reset(seed=0)
    for action in (3, -1, 0.5):
        with pytest.raises(ConfigError, match=r"action: expected 0 \(forward\), 1 \(left\) or 2 \(right\)"):
            env.step(action)
    with pytest.raises(ConfigError, match="options: unknown key 'plan'; known: 'plan_id'"):
        env.reset(options={"plan": "small"})
    with pytest.raises(ConfigError, match="plan_id: none of the 3 plans has the id 'tiny'"):
        env.reset(options={"plan_id": "tiny"})
    with pytest.raises(ConfigError, match="success_coverage: expected more than 0, at most 1, found 95"):
        make(success_coverage=95)
    with pytest.raises(ConfigError, match="dataset: expected at least one plan"):
        gymnasium.make(ID, dataset=[])
    assert houseexpo.pseudoslam.SimulatorConfig is SimulatorConfig
