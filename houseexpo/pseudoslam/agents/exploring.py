"""Base class of explorers, which look around, choose a frontier, go there by their map, and look at it.

R1  First the robot turns until it has looked in all directions.
R2  It chooses again when the frontier is known or given up.
R3  If it cannot get closer, it turns to the frontier; a frontier that is still unknown after that is given up. So is
    one on the way to which the robot is blocked repeatedly.
R4  It is done when no frontier is left.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.agents.forward import LEFT, RIGHT
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot
from houseexpo.pseudoslam.agents.walking import Walker
from houseexpo.pseudoslam.kernels.mapping.merge import UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.plan import FRONTIER
from houseexpo.pseudoslam.kernels.types import Rows
from houseexpo.pseudoslam.plan_rules import MAX_BUMPS, MAX_FRONTIERS, explorer_frontiers, first_looks
from houseexpo.pseudoslam.step_params import scratch_of, with_room

Grid = npt.NDArray[np.uint8]


class Explorer(ABC):
    """A policy that goes to one frontier after the other until there is none; subclasses choose the frontier."""

    interface = Interface(tasks=("exploration",))

    def __init__(self, robot: Robot, _: int) -> None:
        config = robot.config
        self.metre = config.pixels_per_metre
        self.range_px = config.laser.range_m * self.metre
        self.radius_px = config.robot.radius_m * self.metre
        self._walker = Walker(robot)
        self._turn = math.radians(config.robot.turn_deg)
        self._looks = first_looks(config)
        self._rules = explorer_frontiers(config)
        self.scratch = scratch_of(config)
        self._frontiers = np.zeros(MAX_FRONTIERS, FRONTIER)
        self._given_up: list[int] = []
        self._target = -1
        self._bumps = 0
        self.decided = False

    @abstractmethod
    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the index of the frontier to go to; ``scratch.ways`` are the distances from the robot.

        Parameters
        ----------
        known
            The map.
        frontiers
            (n,) ``FRONTIER``, at least one, in the order of ``find_frontiers``.
        info
            Other knowledge of the robot.
        """

    def __call__(self, _observation: Any, info: Knowledge) -> int | None:
        """Return the action forward, left or right, or None when there is nothing left to see."""
        known, pose = info["map"], info["pose_px"]
        self.decided = False
        if self._looks:  # R1
            self._looks -= 1
            return LEFT
        self._bumps += info["collided"]
        for _ in range(MAX_FRONTIERS):
            if not self._walker.turns and self._has_to_decide(known):
                self.decided = True
                if not self._decide(known, info):
                    return None  # R4
            action = self._walker.next(known, pose)
            if action is None:
                action = self._look(known, pose)
            if action is not None:
                return action
        return None

    def _has_to_decide(self, known: Grid) -> bool:
        """Return whether to choose again (R2); give up a frontier to which the robot is blocked (R3)."""
        if self._bumps > MAX_BUMPS:
            self._given_up.append(self._target)
            return True
        return self._target < 0 or bool(known.flat[self._target] != UNKNOWN)

    def _decide(self, known: Grid, info: Knowledge) -> bool:
        """Choose a frontier and aim at its goal; return whether there is one."""
        x, y = info["pose_px"][:2].tolist()
        scratch = self.scratch = with_room(self.scratch, known.size)
        given_up = np.array(self._given_up, np.int32)
        n = find_frontiers(known, x, y, self._rules, given_up, scratch, self._frontiers)
        if not n:
            self._target = -1
            return False
        chosen = self._frontiers[self.choose(known, self._frontiers[:n], info)]
        self._target, goal = int(chosen["middle"]), int(chosen["goal"])
        self._bumps = 0
        cols = known.shape[1]
        here = math.floor(y) * cols + math.floor(x)
        self._walker.aim(known, goal % cols + 0.5, goal // cols + 0.5, here if scratch.ways.ways[here] >= 0 else -1)
        return True

    def _look(self, known: Grid, pose: npt.NDArray[np.float64]) -> int | None:
        """Return the turn towards the frontier, None if the robot has looked at it (R3)."""
        row, col = divmod(self._target, known.shape[1])
        x, y, heading = pose.tolist()
        turns = round(math.remainder(math.atan2(y - row - 0.5, col + 0.5 - x) - heading, 2 * math.pi) / self._turn)
        if known.flat[self._target] == UNKNOWN and turns:
            return LEFT if turns > 0 else RIGHT
        if known.flat[self._target] == UNKNOWN:
            self._given_up.append(self._target)
        self._target = -1
        return None
