"""What environments whose actions are travels refuse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from tests.builders.simulations import env_of

pytestmark = pytest.mark.slow  # the kernels of planners' actions take half a minute to compile


@pytest.mark.parametrize(
    ("actions", "action", "words"),
    [
        ("frontier", 16, "the number of a frontier, 0 to 15"),
        ("frontier", -1, "the number of a frontier"),
        ("frontier", 0.0, "the number of a frontier"),
        ("frontier", [0, 1], "shape"),
        ("neighbour", 8, "the number of a neighbour, 0 to 7"),
        ("waypoint", [math.nan, 0.0], r"waypoint .* found .*nan"),
        ("waypoint", [0.0, 1.1], "numbers from -1 to 1"),
        ("waypoint", ["a", "b"], "numbers from -1 to 1"),
        ("waypoint", 0.5, "shape"),
    ],
)
def test_what_is_no_action_is_refused(actions: str, action: Any, words: str) -> None:
    env = env_of(actions, observation="graph").unwrapped
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=words):
        env.step(np.array(action))


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"ObstacleAvoidance .* do not add up"):
        env_of("frontier", "ObstacleAvoidance")
    with pytest.raises(ConfigError, match="planning: expected actions to be one of"):
        env_of("discrete", planning=PlanningConfig())
    with pytest.raises(ConfigError, match="expected a PlanningConfig"):
        env_of("frontier", planning=3)
    for name, value in (
        ("frontiers", 0),
        ("max_steps", 0),
        ("reach_m", 0.0),
        ("large_m", -1.0),
        ("nodes", 0),
        ("neighbours", 25),
        ("spacing_m", 0.0),
        ("settled_m", math.nan),
    ):
        with pytest.raises(ConfigError, match=f"planning.{name}"):
            PlanningConfig(**{name: value})
    with pytest.raises(ConfigError, match="observation='graph': expected actions to be one of"):
        env_of("continuous", observation="graph")
    with pytest.raises(ConfigError, match="expected observation='graph'"):
        env_of("neighbour", observation="dict")
    env = env_of("waypoint").unwrapped
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="action_masks"):
        env.action_masks()
