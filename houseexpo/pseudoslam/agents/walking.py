"""Go to a place on the robot's own map, by discrete actions."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.agents.forward import FORWARD, LEFT, RIGHT
from houseexpo.pseudoslam.agents.protocol import Robot
from houseexpo.pseudoslam.kernels.planning.descent import NO_TURN, best_turns
from houseexpo.pseudoslam.kernels.planning.known_ways import find_ways
from houseexpo.pseudoslam.kernels.types import KnownWays, known_ways_of
from houseexpo.pseudoslam.plan_rules import ENOUGH

Grid = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]


class Walker:
    """Follows decreasing distances to a goal; ``turns`` is the number of turns before the next step."""

    def __init__(self, robot: Robot) -> None:
        body, metre = robot.config.robot, robot.config.pixels_per_metre
        self.turns = 0
        self._turn = math.radians(body.turn_deg)
        self._step_px, self._radius_px = body.step_m * metre, body.radius_m * metre
        self._ways: KnownWays | None = None
        self._steps = False

    def memory(self, known: Grid) -> KnownWays:
        """Return working memory for distances on a map, which ``aim`` also uses."""
        if self._ways is None or len(self._ways.ways) < known.size:
            self._ways = known_ways_of(known.size)
        return self._ways

    def aim(self, known: Grid, goal_x: float, goal_y: float, until: int = -1) -> None:
        """Compute the distances to a goal in pixels, up to the cell ``until`` (a flat index) or for all cells."""
        find_ways(known, goal_x, goal_y, self._radius_px, until, self.memory(known))
        self.turns, self._steps = 0, False

    def next(self, known: Grid, pose: Floats) -> int | None:
        """Return the next action, None if no step brings the robot closer."""
        if not self._steps:
            x, y, heading = pose.tolist()
            turns = best_turns(
                known, x, y, heading, self._turn, self._step_px, self._radius_px, ENOUGH, self.memory(known)
            )
            if turns == NO_TURN:
                return None
            self.turns, self._steps = int(turns), True
        if self.turns:
            left = self.turns > 0
            self.turns -= 1 if left else -1
            return LEFT if left else RIGHT
        self._steps = False
        return FORWARD
