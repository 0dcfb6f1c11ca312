"""Explore like MapEx (Ho, Kim et al., 2025; castacks/MapEx, mode "nearest"): go to the straight-line nearest frontier.

It differs from ``explorers.NearestFrontier``: nearest is by the straight line and not by the way, and the robot keeps a
frontier until it is there, even if it has seen it long before.

R1  A frontier's cell is free and has an unknown cell among its eight neighbours. Cells that share a side or a corner
    are a region; regions of 10 cells or fewer are ignored. The centre is the cell of the region closest to the mean of
    its cells, the first in row order of several.
R2  The target is the centre nearest to the robot by the straight line, among those that are at least 1 m away, where
    the robot can stand, and to which there is a way. Cells that are not known count as free for both.
R3  The target is kept until the robot is closer than 1 m to it, or cannot stand there by its map, or has no way to it.
R4  The robot is done when no centre is left.

The robot is another one than MapEx's, which moves three cells of 0.1 m along its way in each step, costs more near
walls, and has no heading: here it turns and drives by the shortest way. So two rules are added. A robot that does not
see all around first turns until it has. A target to which the robot is blocked repeatedly, or to which no action
brings it closer, is not chosen again.
"""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.agents.explorers import GoalWalker
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot
from houseexpo.pseudoslam.agents.simple import LEFT
from houseexpo.pseudoslam.kernels.mapping import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.tolerances import MAX_BUMPS
from houseexpo.pseudoslam.kernels.types import NO_WAY, PathScratch, new_path_scratch
from houseexpo.pseudoslam.planning import count_first_looks

IGNORED_CELLS: Final = 10
"""Regions of so many cells or fewer are ignored, at any resolution."""
REACHED_M: Final = 1.0

Cells = npt.NDArray[np.int64]


class MapExNearest:
    """A policy that goes to the frontier that is nearest by the straight line, and keeps it until it is there."""

    interface = Interface(tasks=("exploration",))

    def __init__(self, robot: Robot, _: int) -> None:
        config = robot.config
        self._reached_px = REACHED_M * config.pixels_per_metre
        self._radius_px = config.robot.radius_m * config.pixels_per_metre
        self._looks = count_first_looks(config)
        self._walker = GoalWalker(robot)
        self._ways: PathScratch = new_path_scratch(0)
        self._open = np.zeros((0, 0), np.uint8)
        self._target: tuple[int, int] | None = None
        self._lost: set[tuple[int, int]] = set()
        self._bumps = 0
        self._moved = True
        self.decided = False

    def __call__(self, _: Any, info: Knowledge) -> int | None:
        """Return the action forward, left or right, or None when no frontier is left (R4)."""
        self.decided = False
        if self._looks:
            self._looks -= 1
            return LEFT
        self._bumps += info["collided"]
        if self._target is not None and self._bumps > MAX_BUMPS:
            self._give_up()
        while True:
            action = self._next(info)
            if self._target is None or action is not None:
                return action
            self._give_up()

    def _next(self, info: Knowledge) -> int | None:
        """Return the next action to the target, which is chosen again if need be; None if there is no action."""
        known, pose = info["map"], info["pose_px"]
        if self._moved:  # the map is new; turns alone add little
            self._replan(known, pose)
        if self._target is None:
            return None
        action = self._walker.next(self._open, pose)
        self._moved = action is None or action not in (1, 2) or self._bumps > 0
        return action

    def _replan(self, known: npt.NDArray[np.uint8], pose: npt.NDArray[np.float64]) -> None:
        """Keep the target or choose another (R2, R3), and compute the distances to it."""
        seen_as = np.where(known == UNKNOWN, np.uint8(FREE), known)
        is_same = self._open.shape == seen_as.shape and np.array_equal(self._open, seen_as)
        if not is_same:
            self._open = seen_as
            if len(self._ways.ways) < known.size:
                self._ways = new_path_scratch(known.size)
            find_distances(self._open, pose[0].item(), pose[1].item(), self._radius_px, -1, self._ways)
        if self._target is not None and self._is_ahead(self._target, pose, known.shape[1]):
            if is_same:
                return  # no obstacle is new, so that the distances hold
        else:
            self._choose(known, pose)
        if self._target is not None:
            self._walker.aim(self._open, self._target[1] + 0.5, self._target[0] + 0.5)

    def _choose(self, known: npt.NDArray[np.uint8], pose: npt.NDArray[np.float64]) -> None:
        """Make the nearest reachable centre the target, or None if no centre is reachable (R2)."""
        self.decided = True
        self._target, self._bumps = None, 0
        centres = np.array([c for c in map(tuple, find_frontier_centres(known).tolist()) if c not in self._lost])
        if len(centres):
            away = np.hypot(centres[:, 0] + 0.5 - pose[1], centres[:, 1] + 0.5 - pose[0])
            order = (tuple(centres[k].tolist()) for k in np.argsort(away, kind="stable"))
            self._target = next((c for c in order if self._is_ahead(c, pose, known.shape[1])), None)

    def _is_ahead(self, cell: tuple[int, int], pose: npt.NDArray[np.float64], cols: int) -> bool:
        """Return whether a cell is at least 1 m away, and the robot can stand there and go there."""
        row, col = cell
        way = self._ways.ways[row * cols + col]
        is_far = np.hypot(row + 0.5 - pose[1], col + 0.5 - pose[0]) >= self._reached_px
        return bool(is_far and way >= 0 and way != NO_WAY)

    def _give_up(self) -> None:
        if self._target is not None:
            self._lost.add(self._target)
        self._target, self._bumps, self._moved = None, 0, True


def find_frontier_centres(known: npt.NDArray[np.uint8]) -> Cells:
    """Return the centres (n, 2), row and column, of the regions of a map (rows, cols) that are not ignored (R1).

    They are in the row order of the regions' first cells.
    """
    unknown = (known == UNKNOWN).astype(np.uint8)
    edge = (cv2.dilate(unknown, np.ones((3, 3), np.uint8)) > 0) & (known == FREE)
    _, labels = cv2.connectedComponents(edge.astype(np.uint8), connectivity=8)
    cells, of = np.argwhere(edge), labels[edge]
    regions, first, sizes = np.unique(of, return_index=True, return_counts=True)
    found = []
    for k in np.argsort(first):
        if sizes[k] > IGNORED_CELLS:
            members = cells[of == regions[k]]
            found.append(members[np.argmin(((members - members.mean(axis=0)) ** 2).sum(axis=1))])
    return np.array(found, np.int64).reshape(-1, 2)
