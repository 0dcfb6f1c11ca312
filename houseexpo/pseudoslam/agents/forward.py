"""Go straight on; when blocked, make some turns to one side."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.simulator import ACTIONS

FORWARD, LEFT, RIGHT = range(len(ACTIONS))
"""The discrete actions."""
_MAX_TURNS: Final = 18


class Forward:
    """A policy that goes straight on; when blocked, it makes 1 to 17 turns to a side, both chosen at random."""

    def __init__(self, _: Robot, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._turns, self._side = 0, LEFT

    def __call__(self, _: Any, info: Knowledge) -> int:
        """Return the action forward, left or right."""
        if info["collided"]:
            self._side = LEFT if self._rng.random() < 0.5 else RIGHT
            self._turns = int(self._rng.integers(1, _MAX_TURNS))
        if not self._turns:
            return FORWARD
        self._turns -= 1
        return self._side
