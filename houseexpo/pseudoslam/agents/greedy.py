"""Go straight towards the goal, and around obstacles at random."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from houseexpo.pseudoslam.agents.forward import FORWARD, LEFT, RIGHT
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot

_MAX_AWAY: Final = 9
_MAX_STEPS: Final = 12


class Greedy:
    """A policy that goes straight to the goal; when blocked, it goes a random number of steps to a random side."""

    interface = Interface(tasks=("navigation",))

    def __init__(self, robot: Robot, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._turn = math.radians(robot.config.robot.turn_deg)
        self._waiting: list[int] = []

    def __call__(self, _: Any, info: Knowledge) -> int:
        """Return the action forward, left or right."""
        if info["collided"]:
            side = LEFT if self._rng.random() < 0.5 else RIGHT
            turns, steps = self._rng.integers(1, (_MAX_AWAY + 1, _MAX_STEPS + 1)).tolist()
            self._waiting = [FORWARD] * steps + [side] * turns
        if self._waiting:
            return self._waiting.pop()
        x, y, heading = info["pose_px"].tolist()
        goal_x, goal_y = info["goal_px"].tolist()
        turns = round(math.remainder(math.atan2(y - goal_y, goal_x - x) - heading, 2 * math.pi) / self._turn)
        if not turns:
            return FORWARD
        return LEFT if turns > 0 else RIGHT
