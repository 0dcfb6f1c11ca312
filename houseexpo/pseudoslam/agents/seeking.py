"""Go to a room or a piece of furniture of a kind: explore until one is seen, or know the house.

L1  A learned seeker goes to the frontier with the highest weighted sum of the numbers of ``frontier_features`` and of
    the rooms there: the label of the room in which the frontier's goal lies, and the shares of labels among the known
    cells around its middle. Each kind of goal has weights of its own.
L2  It looks round before it goes on, like the policy ``look-around``.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.files import read_json
from houseexpo.plan.room_labels import LABELS, UNLABELLED
from houseexpo.pseudoslam.agents.explorers import Explorer, GoalWalker, NearestFrontier, distances_to_cells
from houseexpo.pseudoslam.agents.learned import LookAround
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot, Training, check_goal
from houseexpo.pseudoslam.agents.simple import FORWARD
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES, LOOKED_AT
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.types import Floats, PathScratch, Rows, new_path_scratch
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


class Seeker:
    """A policy that explores until it sees a goal of the kind, and then goes there.

    Ways are planned again after each step, on the robot's own map. Without ``explorer``, it explores like the
    nearest-frontier explorer.
    """

    interface = Interface(tasks=("search", "navigation"))

    def __init__(self, robot: Robot, seed: int, explorer: Explorer | None = None) -> None:
        check_goal(robot, place=False)
        self._explorer, self.metre = explorer or NearestFrontier(robot, seed), robot.config.pixels_per_metre
        self.decided = False
        self._to_goal, goal = RegionWalker(robot), robot.config.goal
        self._reach_px = OBJECT_M * self.metre if goal is not None and goal.kind == "object" else 0.0
        self._path_m, self._sees = -1.0, False

    def __call__(self, _observation: Any, info: Knowledge) -> int | None:
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
            action = self._explorer.act(info)
            self.decided = self._explorer.decided
            return action
        self.decided = True
        return action


_HERE: Final = tuple(f"in {label}" for label in (UNLABELLED, *LABELS))
_NEAR: Final = tuple(f"near {label}" for label in (UNLABELLED, *LABELS))
SEEKER_FEATURES: Final = (*FEATURES, *_HERE, *_NEAR)
"""The names of the numbers of a frontier (L1)."""
_LABELS_WITHIN_M: Final = 2.5
_LABELS_EVERY_M: Final = 0.1
"""Half the side of the square around a frontier in which labels are counted, the size of a room, and the distance of
the cells that are looked at, metres."""
FORMAT: Final = "houseexpo seeker 1"
"""What a file of weights begins with."""


class SeekerWeights(msgspec.Struct, frozen=True):
    """The contents of a file of weights: by the kind of goal, weights in the order of ``features``.

    The kind "" stands for all that are not named.
    """

    format: str
    about: dict[str, Any]
    features: tuple[str, ...]
    goals: dict[str, tuple[float, ...]]


class LikelyExplorer(LookAround):
    """An explorer that goes to the frontier behind which a goal is likely to be near (L1, L2)."""

    def __init__(self, robot: Robot, seed: int, weights: SeekerWeights) -> None:
        super().__init__(robot, seed, np.zeros(len(FEATURES)))
        self._by_goal = weights.goals

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the frontier with the highest score."""
        weights = self._by_goal.get(info["goal_name"], self._by_goal[""])
        return int(np.argmax(self.measure(known, frontiers, info) @ np.array(weights)))

    def measure(self, known: Grid, frontiers: Rows, info: Knowledge) -> Floats:
        """Return the numbers (n, ``SEEKER_FEATURES``) of the first frontiers."""
        super().choose(known, frontiers, info)
        n = min(len(frontiers), LOOKED_AT)
        found = np.zeros((n, len(SEEKER_FEATURES)))
        found[:, : len(FEATURES)] = self._outlooks[:n]
        rooms, labels = info["room_map"], len(LABELS) + 1
        reach, apart = round(_LABELS_WITHIN_M * self.metre), max(round(_LABELS_EVERY_M * self.metre), 1)
        for out, goal, middle in zip(found, frontiers["goal"].tolist(), frontiers["middle"].tolist(), strict=False):
            out[len(FEATURES) + int(rooms.flat[goal])] = 1.0
            row, col = divmod(middle, known.shape[1])
            around = np.s_[max(row - reach, 0) : row + reach : apart, max(col - reach, 0) : col + reach : apart]
            seen = rooms[around][known[around] == FREE]
            out[-labels:] = np.bincount(seen, minlength=labels) / max(len(seen), 1)
        return found


class SeekerFactory:
    """A factory of learned seekers with the weights of a file."""

    interface = Seeker.interface

    def __init__(self, file: Path) -> None:
        self.file = file

    def __call__(self, robot: Robot, seed: int) -> Seeker:
        """Return the policy for an episode."""
        return Seeker(robot, seed, LikelyExplorer(robot, seed, self.weights))

    @property
    def training(self) -> Training:
        """The family of the weights, and the seed of their training."""
        about = self.weights.about
        return Training(str(about["family"]), int(about["seed"]))

    @cached_property
    def weights(self) -> SeekerWeights:
        """The contents of the file."""
        found = read_json(self.file, SeekerWeights)
        if found.format != FORMAT or found.features != SEEKER_FEATURES:
            raise ConfigError(f"{self.file}: expected {FORMAT!r} of this version, found another; learn it again")
        return found


seek_likely_0, seek_likely_1, seek_likely_2 = (
    SeekerFactory(Path(__file__).with_name(f"seek-likely-{seed}.json")) for seed in range(3)
)


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
