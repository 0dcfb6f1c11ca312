"""Go to a room or a piece of furniture of a kind: explore until one is seen, or know the house."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import GoalWalker, NearestFrontier, distances_to_cells
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot, check_goal
from houseexpo.pseudoslam.agents.simple import FORWARD
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.types import PathScratch, new_path_scratch
from houseexpo.pseudoslam.worlds.goal_regions import OBJECT_M, cells_beside

Grid = npt.NDArray[np.uint8]
_DEEP_M: Final = 0.15
"""How deep in a region places are that robots aim at, if there are such: half a step, by which they may miss them."""


class RegionWalker:
    """A robot that goes to the nearest place in a region of a map."""

    def __init__(self, robot: Robot) -> None:
        self._walker = GoalWalker(robot)
        self._ways: PathScratch = new_path_scratch(0)
        self._radius_px = robot.config.robot.radius_m * robot.config.pixels_per_metre
        self._deep_px = round(_DEEP_M * robot.config.pixels_per_metre)

    def aim(self, known: Grid, region: Grid, x: float, y: float) -> bool:
        """Aim at the nearest place in a region (rows, cols) from (x, y), pixels; return whether a way leads there."""
        import cv2

        if len(self._ways.ways) < known.size:
            self._ways = new_path_scratch(known.size)
        find_distances(known, x, y, self._radius_px, -1, self._ways)
        side = 2 * self._deep_px + 1
        deep = cv2.erode(region, np.ones((side, side), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0)
        for places in (deep, region):
            cells = np.flatnonzero(places)
            cells = cells[self._ways.ways[cells] >= 0]
            if len(cells):
                row, col = divmod(int(cells[distances_to_cells(self._ways, cells).argmin()]), known.shape[1])
                self._walker.aim(known, col + 0.5, row + 0.5)
                return True
        return False

    def next(self, known: Grid, pose: npt.NDArray[np.float64]) -> int | None:
        """Return the next action, None at the place."""
        return self._walker.next(known, pose)


class Seeker(NearestFrontier):
    """A policy that explores like the nearest-frontier explorer until it sees a goal of the kind, and then goes there.

    Ways are planned again after each step, on the robot's own map.
    """

    interface = Interface(tasks=("search", "navigation"))

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot, seed)
        check_goal(robot, place=False)
        self._to_goal, goal = RegionWalker(robot), robot.config.goal
        self._reach_px = OBJECT_M * self.metre if goal is not None and goal.kind == "object" else 0.0
        self._path_m, self._sees = -1.0, False

    def __call__(self, observation: Any, info: Knowledge) -> int | None:
        """Return the action forward, left or right, or None when all is explored."""
        known, seen = info["map"], info["goal_map"]
        if info["path_m"] != self._path_m or info["collided"] or not self._sees:
            self._path_m, self._sees = info["path_m"], False
            if seen.any():
                place = seen & (known == FREE)
                if self._reach_px:
                    place = cells_beside(seen, (known != FREE).view(np.uint8), self._reach_px)
                self._sees = self._to_goal.aim(known, place, *info["pose_px"][:2].tolist())
        action = self._to_goal.next(known, info["pose_px"]) if self._sees else None
        if action is None:
            return super().__call__(observation, info)
        self.decided = True
        return action


class ShortestWay:
    """A policy that knows the true house and follows the shortest way to the goal, or to the nearest of its kind."""

    interface = Interface(sees_truth=True, tasks=("navigation", "search"))

    def __init__(self, robot: Robot, _: int) -> None:
        if robot.world is None:
            raise ConfigError("policy 'shortest': expected to be given the world, found none")
        self._world, self._walker, self._to_goal = robot.world, GoalWalker(robot), RegionWalker(robot)
        self._house = np.where(robot.world.occupied != 0, OBSTACLE, FREE).astype(np.uint8)
        self._starts = True

    def __call__(self, _: Any, info: Knowledge) -> int:
        """Return the action forward, left or right."""
        by_kind = "goal_name" in info
        if self._starts:
            self._starts = False
            if by_kind:
                inside = self._world.regions[info["goal_name"]].inside
                self._to_goal.aim(self._house, inside, *info["pose_px"][:2].tolist())
            else:
                self._walker.aim(self._house, *info["goal_px"].tolist())
        action = (self._to_goal if by_kind else self._walker).next(self._house, info["pose_px"])
        return FORWARD if action is None else action
