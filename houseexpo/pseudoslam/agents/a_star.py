"""Follow the shortest path to the goal on the robot's own map, on which unknown cells count as free."""

from __future__ import annotations

from typing import Any

import numpy as np

from houseexpo.pseudoslam.agents.greedy import Greedy
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot
from houseexpo.pseudoslam.agents.walking import Walker
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, UNKNOWN


class AStar:
    """A policy that plans the path again after each step; if its map shows no path, it heads straight for the goal.

    The paths are exact, like those of A*. The search starts at the goal, so that one search serves all headings.
    """

    interface = Interface(tasks=("navigation",))

    def __init__(self, robot: Robot, seed: int) -> None:
        self._walker, self._lost = Walker(robot), Greedy(robot, seed)
        self._path_m = -1.0
        self.decided = False

    def __call__(self, observation: Any, info: Knowledge) -> int:
        """Return the action forward, left or right."""
        known = info["map"]
        hoped = np.where(known == UNKNOWN, FREE, known)
        hoped[[0, -1]] = hoped[:, [0, -1]] = OBSTACLE
        self.decided = info["path_m"] != self._path_m or info["collided"]
        if self.decided:
            self._path_m = info["path_m"]
            self._walker.aim(hoped, *info["goal_px"].tolist())
        action = self._walker.next(hoped, info["pose_px"])
        return self._lost(observation, info) if action is None else action
