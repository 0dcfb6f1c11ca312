"""The arguments of ``gymnasium.make`` and ``make_vec``, as libraries and people give them."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv
from houseexpo.pseudoslam.kernels.mapping import draw_overview
from houseexpo.pseudoslam.tasks import ROOM

EXPLORATION = "PseudoSLAM/Exploration-v0"


@pytest.mark.parametrize("name", ["frame_skip", "num_env", "task"])
@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_an_unknown_argument_is_refused_as_python_does_it(make: object, name: str) -> None:
    """Libraries that try arguments look for a TypeError with these words."""
    with pytest.raises(TypeError, match=f"unexpected keyword argument '{name}'.*; it takes .*plan_ids") as raised:
        make(EXPLORATION, dataset=ROOM, **{name: {}})  # type: ignore[operator]
    assert isinstance(raised.value, ConfigError)


def test_a_vector_environment_says_how_it_resets() -> None:
    env = gymnasium.make_vec(EXPLORATION, 2, dataset=ROOM, autoreset_mode="SameStep").unwrapped
    assert isinstance(env, PseudoSlamVectorEnv)
    assert env.metadata["autoreset_mode"] is env.autoreset_mode is AutoresetMode.SAME_STEP


@pytest.mark.slow  # a kernel that no other quick test needs
def test_the_overview_after_a_planners_action_is_that_of_the_whole_map() -> None:
    """It is drawn once an action, within reach of all scans on the way."""
    env = gymnasium.make_vec(EXPLORATION, 3, dataset=ROOM, actions="frontier", observation="dict").unwrapped
    assert isinstance(env, PseudoSlamVectorEnv)
    seen, _ = env.reset(seed=1)
    for _ in range(6):
        for i in range(3):
            state, wanted = env.state(i), np.zeros((128, 128), np.uint8)
            start, side_px = state.episode.readings[0], 32.0 / 128 * 25.0
            everything = np.array([0, state.known.shape[0], 0, state.known.shape[1]])
            draw_overview(state.known, start.start_x, start.start_y, side_px, everything, wanted)
            assert np.array_equal(seen["global_map"][i, 0], wanted)
        seen, *_ = env.step(np.zeros(3, np.int64))
