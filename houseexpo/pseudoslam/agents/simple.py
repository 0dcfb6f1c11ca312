"""Choose actions by simple rules, as baselines: random, turning, straight on, along a wall, or to the goal."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import GoalWalker
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot, check_goal
from houseexpo.pseudoslam.kernels.collision import clearance, free_distance
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.tolerances import ARC_RAD, FOLLOWED_M, WALL_EPS_PX
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


class Spin:
    """A policy that turns left on the spot, which touches nothing and goes nowhere."""

    def __init__(self, _: Robot, __: int) -> None:
        pass

    def __call__(self, _: Any, __: Knowledge) -> int:
        """Return the action left."""
        return LEFT


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


class WallFollower:
    """A policy that keeps a wall on its right.

    R1  Far from all known obstacles, the robot goes straight on. If it has just left one, it first goes in a circle to
        the right, to find it again.
    R2  Near an obstacle, it takes the first heading in which it can go a step, turning left from the nearest obstacle.
    R3  Unknown cells do not stop it.
    """

    def __init__(self, robot: Robot, _: int) -> None:
        body, metre = robot.config.robot, robot.config.pixels_per_metre
        self._turn = math.radians(body.turn_deg)
        self._step_px, self._radius_px = body.step_m * metre, body.radius_m * metre
        self._near_px = FOLLOWED_M * metre
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
        if clearance(walls, x, y, self._radius_px, self._radius_px + self._near_px) > self._near_px - WALL_EPS_PX:  # R1
            self._arcs -= self._arcs > 0
            return -max(round(ARC_RAD / self._turn), 1) if self._arcs else 0
        self._arcs = round(2 * math.pi / ARC_RAD)
        rows, cols = np.nonzero(walls)
        right, down = cols + 0.5 - x, rows + 0.5 - y
        nearest = int(np.hypot(right, down).argmin())
        towards = math.atan2(-down[nearest], right[nearest])
        first = math.ceil(math.remainder(towards - heading, 2 * math.pi) / self._turn)
        once_round = round(2 * math.pi / self._turn)
        for turns in range(first, first + once_round):  # R2
            angle = heading + turns * self._turn
            if (
                free_distance(walls, x, y, math.cos(angle), -math.sin(angle), self._step_px, self._radius_px)
                == self._step_px
            ):
                return turns - once_round if turns > once_round // 2 else turns
        return once_round // 2


_MAX_AWAY: Final = 9
_MAX_STEPS: Final = 12


class Greedy:
    """A policy that goes straight to the goal; when blocked, it goes a random number of steps to a random side."""

    interface = Interface(tasks=("navigation",))

    def __init__(self, robot: Robot, seed: int) -> None:
        check_goal(robot, place=True)
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


class AStar:
    """A policy that follows the shortest path to the goal on its own map, on which unknown cells count as free.

    The path is planned again after each step. If the map shows no path, the robot heads straight for the goal.
    The paths are exact, like those of A*. The search starts at the goal, so that one search serves all headings.
    """

    interface = Interface(tasks=("navigation",))

    def __init__(self, robot: Robot, seed: int) -> None:
        self._walker, self._lost = GoalWalker(robot), Greedy(robot, seed)
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
