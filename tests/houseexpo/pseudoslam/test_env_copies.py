"""Environments can be copied and pickled in the middle of an episode, as vector wrappers and checkpoints do."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam.envs.single import ExplorationEnv
from tests.builders.datasets import house

ACTIONS = (0, 1, 0, 2, 0, 0, 1, 0)


def _pickled(env: ExplorationEnv) -> ExplorationEnv:
    found: ExplorationEnv = pickle.loads(pickle.dumps(env))  # noqa: S301 - it was made here
    return found


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
