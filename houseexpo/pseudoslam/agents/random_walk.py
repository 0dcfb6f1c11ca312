"""Random actions."""

from __future__ import annotations

from typing import Any

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot


class RandomWalk:
    """A policy that draws actions from the environment's action space."""

    def __init__(self, robot: Robot, seed: int) -> None:
        if robot.action_space is None:
            raise ConfigError("policy 'random': expected a space of actions to draw from, found none")
        self._space = robot.action_space
        self._space.seed(seed)

    def __call__(self, _: Any, __: Knowledge) -> Any:
        """Return a random action."""
        return self._space.sample()
