"""Follow the wall, which stays on the right.

R1  Far from all known obstacles, the robot goes straight on. If it has just left one, it first goes in a circle to the
    right, to find it again.
R2  Near an obstacle, it takes the first heading in which it can go a step, turning left from the nearest obstacle.
R3  Unknown cells do not stop it.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from houseexpo.pseudoslam.agents.forward import FORWARD, LEFT, RIGHT
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.kernels.mapping.merge import OBSTACLE
from houseexpo.pseudoslam.kernels.motion.disc import clearance, free_way

_NEAR_M: Final = 0.4
"""Largest distance between the robot's rim and the wall that it follows."""
_EPS_PX: Final = 1e-6
_ARC_RAD: Final = math.pi / 6
"""The angle between two steps of the circle."""


class WallFollower:
    """A policy that keeps a wall on its right."""

    def __init__(self, robot: Robot, _: int) -> None:
        body, metre = robot.config.robot, robot.config.pixels_per_metre
        self._turn = math.radians(body.turn_deg)
        self._step_px, self._radius_px = body.step_m * metre, body.radius_m * metre
        self._near_px = _NEAR_M * metre
        self._reach = math.ceil(self._step_px + self._radius_px + self._near_px) + 2
        self._turns, self._goes = 0, False
        self._arcs = 0

    def __call__(self, _: Any, info: Knowledge) -> int:
        """Return the action forward, left or right."""
        if not self._goes:
            self._turns, self._goes = self._best_turns(info), True
        if not self._turns:
            self._goes = False
            return FORWARD
        side = 1 if self._turns > 0 else -1
        self._turns -= side
        return LEFT if side > 0 else RIGHT

    def _best_turns(self, info: Knowledge) -> int:
        """Return the number of turns before the next step, positive to the left."""
        x, y, heading = info["pose_px"].tolist()
        left, top = max(int(x) - self._reach, 0), max(int(y) - self._reach, 0)
        near = info["map"][top : int(y) + self._reach + 1, left : int(x) + self._reach + 1]
        walls, x, y = (near == OBSTACLE).view(np.uint8), x - left, y - top
        if clearance(walls, x, y, self._radius_px, self._radius_px + self._near_px) > self._near_px - _EPS_PX:  # R1
            self._arcs -= self._arcs > 0
            return -max(round(_ARC_RAD / self._turn), 1) if self._arcs else 0
        self._arcs = round(2 * math.pi / _ARC_RAD)
        rows, cols = np.nonzero(walls)
        right, down = cols + 0.5 - x, rows + 0.5 - y
        nearest = int(np.hypot(right, down).argmin())
        towards = math.atan2(-down[nearest], right[nearest])
        first = math.ceil(math.remainder(towards - heading, 2 * math.pi) / self._turn)
        once_round = round(2 * math.pi / self._turn)
        for turns in range(first, first + once_round):  # R2
            angle = heading + turns * self._turn
            if (
                free_way(walls, x, y, math.cos(angle), -math.sin(angle), self._step_px, self._radius_px)
                == self._step_px
            ):
                return turns - once_round if turns > once_round // 2 else turns
        return once_round // 2
