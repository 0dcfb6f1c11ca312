"""Environments can be copied and pickled in the middle of an episode, as vector wrappers and checkpoints do."""

from __future__ import annotations

import copy
import pickle
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.envs.vector import ExplorationVectorEnv
from tests.builders.plan_files import house

ACTIONS = (0, 1, 0, 2, 0, 0, 1, 0)


def _pickled(env: Any) -> Any:
    return pickle.loads(pickle.dumps(env))  # noqa: S301 - it was made here


@pytest.mark.parametrize("copied", [copy.deepcopy, _pickled])
def test_a_copy_goes_on_from_the_same_step_and_leaves_the_first_alone(
    copied: Callable[[ExplorationEnv], ExplorationEnv],
) -> None:
    env = ExplorationEnv([house("a", 6.0), house("b", 7.0)])
    env.reset(seed=5)
    for action in ACTIONS:
        env.step(action)
    other = copied(env)
    theirs = _walked(other)
    ours = _walked(env)
    for (seen, reward, _, _, info), (seen_too, reward_too, _, _, info_too) in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(seen, seen_too)
        assert reward == reward_too
        assert info["coverage"] == info_too["coverage"]
        np.testing.assert_array_equal(info["pose"], info_too["pose"])


def _walked(env: ExplorationEnv) -> list[Any]:
    """Walk on, and into the next episode: its plan and start are drawn alike."""
    steps = [env.step(action) for action in ACTIONS]
    env.reset()
    return [*steps, *(env.step(action) for action in ACTIONS)]


@pytest.mark.parametrize("copied", [copy.deepcopy, _pickled])
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_vector_environment_is_copied_with_its_episodes_and_those_to_come(
    copied: Callable[[ExplorationVectorEnv], ExplorationVectorEnv], mode: str
) -> None:
    config = SimulatorConfig(pixels_per_metre=16.0, max_steps=5)
    houses = [house(name, 6.0 + k) for k, name in enumerate("abc")]
    env = ExplorationVectorEnv(houses, config, num_envs=4, autoreset_mode=mode, threads=2)
    env.reset(seed=5)
    for action in ACTIONS:
        env.step(np.full(4, action))
    other = copied(env)
    for i in range(4):
        np.testing.assert_array_equal(other.state(i).view, env.state(i).view)
    for action in 3 * ACTIONS:  # through episodes that were made ready before the copy
        ours, theirs = env.step(np.full(4, action)), other.step(np.full(4, action))
        for one, too in zip(ours[:4], theirs[:4], strict=True):
            np.testing.assert_array_equal(one, too)
        assert (ours[4]["plan_id"] == theirs[4]["plan_id"]).all()
        np.testing.assert_array_equal(ours[4]["pose"], theirs[4]["pose"])


def test_a_vector_environment_can_be_copied_before_its_first_reset() -> None:
    env = ExplorationVectorEnv([house("a", 6.0)], num_envs=2)
    other = copy.deepcopy(env)
    np.testing.assert_array_equal(env.reset(seed=1)[0], other.reset(seed=1)[0])


def test_threads_that_step_one_vector_environment_wait_for_each_other() -> None:
    env = ExplorationVectorEnv([house("a", 6.0)], num_envs=4, threads=2)
    env.reset(seed=1)
    taken = []

    def steps() -> None:
        taken.extend(env.step(np.zeros(4, int))[0].shape for _ in range(40))

    threads = [threading.Thread(target=steps, daemon=True) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert not any(thread.is_alive() for thread in threads)
    assert len(taken) == 120
    assert env.state(0).counts[0] == 120
