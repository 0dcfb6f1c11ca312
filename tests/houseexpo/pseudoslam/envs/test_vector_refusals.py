"""What a vector environment refuses, and what it is like afterwards."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils import seeding

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import StartConfig
from houseexpo.pseudoslam.envs import episode_batch
from tests.builders.simulations import GIVEN, HUTS, SMALL, assert_same, explorers


@pytest.mark.parametrize(
    ("given", "actions", "text"),
    [
        ({}, [0, 3], r"action: expected 0 \(forward\), 1 \(left\) or 2 \(right\), found .*3"),
        ({}, [-1, 0], r"found .*-1"),
        ({}, [0.0, 1.0], r"found .*0.0"),
        ({}, [True, False], r"found .*True"),
        ({}, ["left", "right"], r"found .*left"),
        ({}, [0], r"action: expected an array of shape \(2,\), found .*\(1,\)"),
        ({}, [[0, 1]], r"found .*\(1, 2\)"),
        ({}, [[0], [1, 2]], r"action: expected an array of shape \(2,\), found \[\[0\], \[1, 2\]\]"),
        ({"actions": "continuous"}, [[0, 0], [0, 1.01]], r"action: expected \(linear, angular\), numbers .*"),
        ({"actions": "continuous"}, [[0, 0], [float("nan"), 0]], "found .*nan"),
        ({"actions": "continuous"}, [[0, 0], [0, -float("inf")]], "found .*-inf"),
        ({"actions": "continuous"}, [0, 1], r"action: expected an array of shape \(2, 2\), found .*\(2,\)"),
        ({"actions": "continuous"}, [[None, 0], [0, 0]], "found None"),
    ],
)
def test_wrong_actions_are_refused_and_change_nothing(given: dict[str, Any], actions: Any, text: str) -> None:
    env = explorers(2, **given)
    env.reset(seed=0)
    before = env.unwrapped.state(0).pose_px.copy()
    with pytest.raises(ConfigError, match=text):
        env.step(actions)
    assert np.array_equal(env.unwrapped.state(0).pose_px, before)
    assert not env.unwrapped.state(0).counts[0]


@pytest.mark.parametrize(
    ("given", "actions", "text"),
    [
        ({}, [0], r"action: expected a single number, found .*\(1,\)"),
        ({}, None, "action: expected 0 .* found None"),
        ({"actions": "continuous"}, 0.5, r"action: expected an array of shape \(2,\), found a single number"),
        ({"actions": "continuous"}, [0.5], r"found .*\(1,\)"),
        ({"actions": "continuous"}, [0.5, float("nan")], "found .*nan"),
    ],
)
def test_wrong_actions_of_one_are_refused(given: dict[str, Any], actions: Any, text: str) -> None:
    env = gymnasium.make("PseudoSLAM/Exploration-v0", **GIVEN, **given).unwrapped
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=text):
        env.step(actions)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"num_envs": 0}, "num_envs: expected a whole number of at least 1, found 0"),
        ({"num_envs": 1 << 20}, "num_envs: expected a whole number of at most 1048575"),
        ({"threads": 0}, "threads: expected a whole number of at least 1, found 0"),
        ({"threads": 1.5}, "threads: expected a whole number of at least 1, found 1.5"),
        ({"autoreset_mode": "Never"}, "autoreset_mode: expected one of NextStep, SameStep, Disabled; found 'Never'"),
        ({"render_mode": "human"}, "render_mode: expected 'rgb_array' or None, found 'human'"),
        ({"actions": "both"}, "actions: expected one of discrete, continuous, frontier; found"),
        ({"observation": "image"}, "observation: expected one of map, dict, scales; found 'image'"),
        ({"config": {"max_steps": 3}}, "config: expected a SimulatorConfig, one of paper, .*, or None"),
    ],
)
def test_wrong_arguments_are_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        gymnasium.make_vec("PseudoSLAM/Exploration-v0", **{"num_envs": 2, **GIVEN, **given})


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"seed": [1]}, r"seed: expected a whole number, a list of 2 of them or None, found \[1\]"),
        ({"seed": 1.5}, "found 1.5"),
        ({"seed": "12"}, "found '12'"),
        ({"options": [1]}, r"options: expected a dictionary or None, found \[1\]"),
        ({"options": {"plan": 3}}, "options: unknown key 'plan'; known: 'plan_id'"),
        ({"options": {"plan_id": "tiny"}}, "plan_id: none of the 3 plans has the id 'tiny'"),
        ({"options": {"plan_id": ["small", "tiny"]}}, "plan_id: none of the 3 plans has the id 'tiny'"),
        ({"options": {"plan_id": ["small"]}}, r"a list of 2 ids or None \(a random plan\), found \['small'\]"),
        ({"options": {"plan_id": 3}}, "found 3"),
        ({"options": {"reset_mask": [True, False]}}, r"options\['reset_mask'\]: expected a boolean array of shape"),
        ({"options": {"reset_mask": np.zeros(2, bool)}}, "not all False"),
        ({"options": {"reset_mask": np.ones(3, bool)}}, r"shape \(2,\)"),
        ({"options": {"reset_mask": np.ones(2)}}, "a boolean array"),
    ],
)
def test_wrong_resets_are_refused(given: dict[str, Any], text: str) -> None:
    env = explorers(2)
    with pytest.raises(ConfigError, match=text):
        env.reset(**given)


@pytest.mark.slow
def test_planners_have_no_choices_before_they_are_reset() -> None:
    planners = explorers(2, actions="frontier").unwrapped
    for which in ({}, {"i": 1}):
        with pytest.raises(gymnasium.error.ResetNeeded, match=r"environments \[0, 1\]: call reset"):
            planners.action_masks(**which)


def test_nothing_steps_before_it_is_reset() -> None:
    env = explorers(2, "Disabled", config=replace(SMALL, max_steps=3))
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"environments \[0, 1\]: call reset"):
        env.step(np.zeros(2, np.int64))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.unwrapped.state(1)
    with pytest.raises(gymnasium.error.ResetNeeded):
        explorers(2, render_mode="rgb_array").render()
    _, info = env.reset(seed=0, options={"reset_mask": np.array([True, False])})
    assert info["_coverage"].tolist() == [True, False]
    assert np.isfinite(info["coverage"]).all()
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"environments \[1\]: call reset"):
        env.step(np.zeros(2, np.int64))
    env.reset(seed=0)
    for _ in range(3):
        *_, truncated, _ = env.step(np.zeros(2, np.int64))
    assert truncated.all()
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"environments \[0, 1\]"):
        env.step(np.zeros(2, np.int64))


def test_a_reset_that_fails_leaves_nothing_half_begun() -> None:
    """The start lies outside the smallest hut."""
    drawn = {seed: int(seeding.np_random(seed)[0].integers(len(HUTS))) for seed in range(30)}
    outside, *_ = [seed for seed, hut in drawn.items() if hut == 0]
    first, second, third, fourth, *_ = [seed for seed, hut in drawn.items() if hut > 0]
    env = explorers(3, config=replace(SMALL, start=StartConfig(random=False, x_m=3.0, y_m=3.5)))
    env.reset(seed=[first, second, third])
    with pytest.raises(ConfigError, match="does not fit"):
        env.reset(seed=[fourth, outside, None], options={"reset_mask": np.array([True, True, False])})
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"environments \[0, 1\]"):
        env.step(np.zeros(3, np.int64))
    env.reset(seed=[first, second, third])
    env.step(np.zeros(3, np.int64))
    env.close()


def test_an_interrupted_reset_can_be_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """As by Ctrl-C while kernels are compiled for the first time."""
    env = explorers(2)
    with monkeypatch.context() as patched:
        patched.setattr(episode_batch.EpisodeBatch, "step", interrupted)
        with pytest.raises(KeyboardInterrupt):
            env.reset(seed=0)
    found, _ = env.reset(seed=0)
    expected, _ = explorers(2).reset(seed=0)
    np.testing.assert_array_equal(found, expected)
    env.step(np.zeros(2, np.int64))


@pytest.mark.parametrize("threads", [1, 2])
def test_nothing_steps_after_it_is_closed(threads: int) -> None:
    env = explorers(4, threads=threads)
    env.reset(seed=0)
    env.close()
    env.close()
    for call in (lambda: env.step(np.zeros(4, np.int64)), env.reset):
        with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="make new ones"):
            call()


def interrupted(*_: Any, **__: Any) -> None:
    raise KeyboardInterrupt


def test_infos_are_the_callers_own() -> None:
    envs = [explorers(3), explorers(3)]
    for env in envs:
        env.reset(seed=0)
    for k in range(30):
        (*_, one), (*_, other) = (env.step(np.full(3, k % 3)) for env in envs)
        assert_same(one, other)
        for value in other.values():
            value[:] = value.dtype.type(0) if value.dtype != object else None
