"""What programs that train ask of a vector environment: a plan for each, gymnasium's wrappers, attributes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.wrappers.vector import NormalizeReward, RecordEpisodeStatistics

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from tests.builders.vectors import HUTS, native

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=4)


def explorers(number: int = 3, **given: Any) -> Any:
    return native("Exploration", number, **{"dataset": HUTS, "config": SMALL, "success_coverage": None, **given})


def test_each_environment_gets_the_plan_that_is_named_for_it() -> None:
    env = explorers()
    _, infos = env.reset(seed=0, options={"plan_id": ["large", "small", "middle"]})
    assert infos["plan_id"].tolist() == ["large", "small", "middle"]
    mask = np.array([False, True, True])
    _, infos = env.reset(options={"plan_id": [None, "middle", None], "reset_mask": mask})
    assert infos["plan_id"].tolist()[:2] == ["large", "middle"]


def test_a_random_plan_is_the_one_that_it_would_have_been_alone() -> None:
    named, plain = explorers(), explorers()
    named.reset(seed=5, options={"plan_id": [None, None, "small"]})
    plain.reset(seed=5)
    for i in range(2):
        assert np.array_equal(named.state(i).known, plain.state(i).known)


def test_episodes_are_counted_by_a_wrapper() -> None:
    env, plain = RecordEpisodeStatistics(explorers()), explorers()
    env.reset(seed=1)
    plain.reset(seed=1)
    total = np.zeros(3)
    for _ in range(4):
        *_, infos = env.step(np.zeros(3, np.int64))
        total += plain.step(np.zeros(3, np.int64))[1]
    assert infos["episode"]["l"].tolist() == [4, 4, 4]
    np.testing.assert_allclose(infos["episode"]["r"], total, rtol=1e-6)


def test_rewards_are_scaled_by_a_wrapper() -> None:
    env, plain = NormalizeReward(explorers()), explorers()
    env.reset(seed=1)
    plain.reset(seed=1)
    for _ in range(9):
        scaled, found = (one.step(np.zeros(3, np.int64))[1] for one in (env, plain))
        assert np.array_equal(scaled > 0, found > 0)


def test_attributes_are_those_of_all() -> None:
    env = explorers()
    env.reset(seed=0, options={"plan_id": "small"})
    assert env.get_attr("config") == (SMALL,) * 3
    assert env.call("render_mode") == (None,) * 3
    states = env.call("state")
    assert [np.array_equal(one.known, env.state(i).known) for i, one in enumerate(states)] == [True] * 3
    with pytest.raises(ConfigError, match="config: the environments are one, and made with what they are"):
        env.set_attr("config", [SMALL] * 3)
