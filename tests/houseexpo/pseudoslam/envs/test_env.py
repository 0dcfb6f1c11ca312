from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import NoiseConfig, ObservationConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.tasks import Navigation

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


def test_a_dict_has_the_map_the_whole_map_the_pose_and_the_ranges() -> None:
    config = replace(SMALL, start=StartConfig(random=False, x_m=2.0, y_m=1.5))
    env = make(config, observation="dict")
    env.reset(seed=0, options={"plan_id": "small"})
    observation, *_, info = env.step(0)
    assert np.array_equal(observation["map"], env.unwrapped.state.view[None])
    assert observation["pose"] == pytest.approx((0.3, 0.0, 0.0), abs=1e-6)
    assert info["pose"] == pytest.approx((2.3, 1.5, 0.0))
    ranges = observation["ranges"]  # from the right of the heading to the left
    assert ranges[0] == pytest.approx(1.5, abs=1e-3)
    assert ranges[len(ranges) // 2] == pytest.approx(4.8 - 2.3, abs=0.02)  # the wall lies on whole cells
    overview = observation["global_map"][0]
    assert overview.shape == (128, 128)
    cell_m = 32 / 128
    assert (overview == 0).mean() > 0.9
    assert overview[64, 64 + int(1.0 / cell_m)] == 127  # a metre to the right of the start
    assert overview[64, 64 + int(2.9 / cell_m)] == 255  # the wall


def test_actions_can_be_shares_of_a_step() -> None:
    config = replace(SMALL, start=StartConfig(random=False, x_m=2.0, y_m=1.5))
    env = make(config, actions="continuous")
    env.reset(seed=0, options={"plan_id": "small"})
    *_, info = env.step(np.array([-0.5, 1.0], np.float32))  # a turn left, then backward
    angle = np.radians(10)
    assert info["pose"] == pytest.approx((2.0 - 0.15 * np.cos(angle), 1.5 - 0.15 * np.sin(angle), angle))
    for strange in ([2.0, 0.0], [np.nan, 0.0]):
        with pytest.raises(ConfigError, match=r"action: expected \(linear, angular\), numbers from -1 to 1, found"):
            env.unwrapped.step(np.array(strange))


def test_a_known_map_is_on_the_whole_map_from_the_start() -> None:
    env = gymnasium.make("PseudoSLAM/Navigation-v0", dataset=PLANS, observation="dict")
    observation, _ = env.reset(seed=0, options={"plan_id": "large"})
    area = (observation["global_map"] == 127).sum() * (32 / 128) ** 2
    assert area == pytest.approx(6.0 * 9.6, rel=0.1)
    assert observation["goal"].shape == (2,)


def test_a_known_map_is_the_true_one_again_after_a_noisy_episode() -> None:
    """In the same house, whose arrays are used again."""
    config = replace(Navigation.default, noise=NoiseConfig(registration_m=0.3), max_steps=500)
    used, new = (gymnasium.make("PseudoSLAM/Navigation-v0", dataset=PLANS[2], config=config) for _ in range(2))
    for seed in range(3):
        _, info = used.reset(seed=seed)
        assert info["explored_m2"] > 0
        before = used.unwrapped.state.known.copy()
        for step in range(40):
            used.step([0, 0, 1][step % 3])
        assert (used.unwrapped.state.known != before).sum() > 100
        used.reset(seed=9)
        new.reset(seed=9)
        assert used.unwrapped.state.known.tobytes() == new.unwrapped.state.known.tobytes()


def test_the_seed_of_a_reset_decides_everything() -> None:
    """The published simulator seeds numpy's global state with 0, and ``seed`` does nothing."""
    config = replace(SMALL, noise=NoiseConfig(0.02, 0.02, 0.5))
    env = make(config)
    first = played(env, 5)
    assert played(env, 5) == first
    assert played(make(config), 5) == first
    assert played(env, 6) != first


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


def test_a_render_mode_that_is_no_text_is_refused_in_words() -> None:
    for given in (5, ["human"]):
        with pytest.raises(ConfigError, match=r"render_mode: expected one of \['rgb_array', 'human'\], found"):
            make(render_mode=given)
        with pytest.raises(ConfigError, match="render_mode: expected 'rgb_array' or None, found"):
            gymnasium.make_vec(ID, 1, render_mode=given, dataset=PLANS)


def test_after_a_start_that_fails_there_is_no_episode_until_another_starts() -> None:
    """The old one would go on under the new house's name."""
    env = make(render_mode="rgb_array")
    env.reset(seed=0, options={"plan_id": "large"})
    with pytest.raises(ConfigError, match=r"does not fit at \(4, 4\) m in plan 'small'"):
        env.reset(options={"plan_id": "small", "pose": (4.0, 4.0, 0.0)})
    for call in (env.unwrapped.render, lambda: env.unwrapped.step(0), lambda: env.unwrapped.simulator):
        with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\)"):
            call()
    _, info = env.reset(options={"plan_id": "small"})
    assert (info["plan_id"], env.step(0)[4]["plan_id"]) == ("small", "small")
