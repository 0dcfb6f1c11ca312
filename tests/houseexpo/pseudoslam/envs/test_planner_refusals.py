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
    ("action", "words"),
    [
        (16, "the number of a frontier, 0 to 15"),
        (-1, "the number of a frontier"),
        (0.0, "the number of a frontier"),
        ([0, 1], "shape"),
    ],
)
def test_what_is_no_action_is_refused(action: Any, words: str) -> None:
    env = env_of("frontier").unwrapped
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=words):
        env.step(np.array(action))


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"ObstacleAvoidance .* do not add up"):
        env_of("frontier", "ObstacleAvoidance")
    with pytest.raises(ConfigError, match="planning: expected actions='frontier'"):
        env_of("discrete", planning=PlanningConfig())
    with pytest.raises(ConfigError, match="expected a PlanningConfig"):
        env_of("frontier", planning=3)
    for name, value in (
        ("frontiers", 0),
        ("max_steps", 0),
        ("large_m", -1.0),
        ("settled_m", math.nan),
    ):
        with pytest.raises(ConfigError, match=f"planning.{name}"):
            PlanningConfig(**{name: value})
