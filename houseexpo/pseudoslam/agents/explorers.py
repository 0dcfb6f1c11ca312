"""Choose actions of policies that go from frontier to frontier on their own map: nearest, random, most to see, a tour.

The rules of their actions are those of ``kernels.explore``; each explorer here chooses the frontier in its own way.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot
from houseexpo.pseudoslam.kernels.explore import (
    EXPLORER,
    FORWARD,
    LEFT,
    NO_ACTION,
    RIGHT,
    descent_action,
    first_look_action,
    must_choose_again,
    new_memory,
    next_action,
    set_target,
)
from houseexpo.pseudoslam.kernels.planning.cover import short_tour
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers, unknown_area_in_sight
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.kernels.tolerances import BEYOND_M, GAIN_PER_M, MAX_BUMPS, MAX_FRONTIERS
from houseexpo.pseudoslam.kernels.types import NO_WAY, PathScratch, Rows, new_path_scratch
from houseexpo.pseudoslam.planning import count_first_looks, descent_rules, explorer_frontier_rules
from houseexpo.pseudoslam.step_kernels import enlarge_scratch, make_scratch

Grid = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]

_BEAMS: Final = 90
_GAINS: Final = 16
"""The number of frontiers whose gain is computed: those that ``find_frontiers`` ranks first."""
_TOURED: Final = 12
"""The number of frontiers in the tour: those that ``find_frontiers`` ranks first."""


class GoalWalker:
    """A robot that goes to a place on a map, by the discrete actions that reduce its distance to the place."""

    def __init__(self, robot: Robot) -> None:
        self._rules = descent_rules(robot.config)
        self._state = np.zeros(1, EXPLORER)
        self._ways: PathScratch = new_path_scratch(0)

    def aim(self, known: Grid, goal_x: float, goal_y: float) -> None:
        """Compute the distances of all cells to a goal in pixels."""
        if len(self._ways.ways) < known.size:
            self._ways = new_path_scratch(known.size)
        find_distances(known, goal_x, goal_y, self._rules.radius_px, -1, self._ways)
        self._state[0].turns = self._state[0].goes = 0

    def next(self, known: Grid, pose: Floats) -> int | None:
        """Return the next action, None if no step brings the robot closer."""
        if len(self._ways.ways) < known.size:
            return None  # no goal yet
        x, y, heading = pose.tolist()
        action = descent_action(known, x, y, heading, self._state, self._rules, self._ways)
        return None if action == NO_ACTION else int(action)


class Explorer(ABC):
    """A policy that goes to one frontier after another until no frontier is left; subclasses choose the frontier."""

    interface = Interface(tasks=("exploration",))
    parts = 1
    """See ``DescentRules``; with more than one, actions are continuous."""

    def __init__(self, robot: Robot, _: int) -> None:
        config = robot.config
        self.metre = config.pixels_per_metre
        self.range_px = config.laser.range_m * self.metre
        self.radius_px = config.robot.radius_m * self.metre
        self.scratch = make_scratch(config)
        self._rules, self._descent = explorer_frontier_rules(config), descent_rules(config, self.parts)
        self._memory = new_memory(count_first_looks(config), MAX_FRONTIERS)
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

    def __call__(self, _observation: Any, info: Knowledge) -> int | Floats | None:
        """Return the next action, or None when there is nothing left to see."""
        action = self.act(info)
        if action is None or self.parts == 1:
            return action
        turn = {LEFT: 1.0, RIGHT: -1.0}.get(action, self._memory.state[0].rest / self.parts)
        return np.array([float(action == FORWARD), turn])

    def act(self, info: Knowledge) -> int | None:
        """Return forward, left or right, or None when there is nothing left to see."""
        known, memory = info["map"], self._memory
        x, y, heading = info["pose_px"].tolist()
        self.scratch = enlarge_scratch(self.scratch, known.size)
        self.decided = False
        action = first_look_action(memory, int(info["collided"]))
        for _ in range(MAX_FRONTIERS):
            if action != NO_ACTION:
                return int(action)
            if self._must_choose(known):
                self.decided = True
                given_up = memory.given_up[: memory.state[0].lost]
                n = find_frontiers(known, x, y, self._rules, given_up, self.scratch, memory.frontiers)
                if not n:
                    return None
                self._set_target(known, x, y, self.choose(known, memory.frontiers[:n], info))
            action = self._next_action(known, x, y, heading)
        return None if action == NO_ACTION else int(action)

    def _must_choose(self, known: Grid) -> bool:
        """Return whether to choose again (R2 and R3 of ``kernels.explore``)."""
        return must_choose_again(known, self._memory, MAX_BUMPS)

    def _set_target(self, known: Grid, x: float, y: float, chosen: int) -> None:
        """Make one of the memory's frontiers the target."""
        set_target(known, x, y, self._memory, chosen, self._rules.radius_px, self.scratch.ways)

    def _next_action(self, known: Grid, x: float, y: float, heading: float) -> int:
        """Return the next action to the target, or ``NO_ACTION`` if it was looked at in vain."""
        return next_action(known, x, y, heading, self._memory, self._descent, self.scratch.ways)


class NearestFrontier(Explorer):
    """Nearest frontier (Yamauchi, 1997): go to the nearest long frontier, and finally to the small frontiers."""

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the first frontier, since they are in this order."""
        del known, frontiers, info
        return 0


class RandomFrontier(Explorer):
    """Go to random frontiers one after another: a baseline that shows the value of choosing among frontiers."""

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot, seed)
        self._rng = np.random.default_rng(seed)

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return one of all frontiers, equally likely."""
        del known, info
        return int(self._rng.integers(len(frontiers)))


class InformationGain(Explorer):
    """Information gain (Gonzalez-Banos and Latombe, 2002): go where much is unknown and the path is short.

    It maximises A exp(-0.2 L) with A the unknown area that is visible from the goal, and L the length of the path.
    """

    gains = _GAINS
    """The number of frontiers whose gain is computed: those that ``find_frontiers`` ranks first."""

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:  # noqa: ARG002  # others use it
        """Return the first frontier with the greatest value."""
        first = frontiers[: self.gains]
        nearness = self.nearness(first["way"] / (STRAIGHT * self.metre))
        return int(np.argmax(unknown_areas(known, first, self.range_px) * nearness))

    def nearness(self, ways_m: Floats) -> Floats:
        """Return the factors of the areas for paths in metres (n,)."""
        return np.exp(-GAIN_PER_M * ways_m)


class Prospector(InformationGain):
    """Go where most can be seen for each metre: it maximises A / (L + 10 m), with A and L as above.

    With L in an exponent, an area of any size is worth nothing from afar. So a robot whose laser reaches far goes into
    each room beside it, and leaves large parts of a floor for later. All frontiers are compared: with the first 16, the
    far ones of a large floor do not count.
    """

    gains = MAX_FRONTIERS

    def nearness(self, ways_m: Floats) -> Floats:
        """Return the factors of the areas for paths in metres (n,)."""
        return 1.0 / (ways_m + BEYOND_M)


def unknown_areas(known: Grid, frontiers: Rows, range_px: float) -> Floats:
    """Return the unknown area in sight of the goal of each frontier (n,), cells."""
    angles = np.arange(_BEAMS) * (2 * math.pi / _BEAMS)
    rows, cols = np.divmod(frontiers["goal"], known.shape[1])
    seen = np.cos(angles), np.sin(angles)
    return np.array(
        [
            unknown_area_in_sight(known, x + 0.5, y + 0.5, range_px, *seen)
            for y, x in zip(rows.tolist(), cols.tolist(), strict=True)
        ],
        np.float64,
    )


class Tour(Explorer):
    """Distance utility (Kulich, Faigl and Preucil, 2011): go to the first frontier of a short tour of all of them.

    Going to a near frontier may leave others behind and cost the way back, which nearest-frontier exploration ignores.
    The tour goes to nearest neighbours and is improved by 2-opt, by paths on the robot's map.
    """

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot, seed)
        self._ways: PathScratch = new_path_scratch(0)

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:  # noqa: ARG002  # others use it
        """Return the first frontier of the tour from the robot."""
        if len(self._ways.ways) < known.size:
            self._ways = new_path_scratch(known.size)
        first = frontiers[:_TOURED]
        lengths = np.zeros((len(first) + 1, len(first) + 1))
        lengths[0, 1:] = lengths[1:, 0] = first["way"]
        goals = first["goal"].tolist()
        for i, goal in enumerate(goals[:-1], start=1):
            row, col = divmod(goal, known.shape[1])
            find_distances(known, col + 0.5, row + 0.5, self.radius_px, -1, self._ways)
            lengths[i, i + 1 :] = lengths[i + 1 :, i] = distances_to_cells(self._ways, goals[i:])
        return int(short_tour(lengths)[1]) - 1


def distances_to_cells(ways: PathScratch, cells: npt.ArrayLike) -> Floats:
    """Return the distances to cells (flat indices); unreachable cells have a very large distance."""
    found: Floats = ways.ways[np.asarray(cells)].astype(np.float64)
    found[found < 0] = NO_WAY
    return found
