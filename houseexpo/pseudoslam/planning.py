"""Plan on a robot's own map: find where it can stand, distances and frontiers; make the parameters of such kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.kernels.explore import DescentRules
from houseexpo.pseudoslam.kernels.planning.frontier_features import FeatureRules
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.paths import find_distances, trace_path
from houseexpo.pseudoslam.kernels.planning.planner_types import (
    FRONTIER,
    STRAIGHT,
    FrontierRules,
    PlannerRules,
    TravelRules,
)
from houseexpo.pseudoslam.kernels.tolerances import (
    AIM_M,
    ENOUGH,
    ENOUGH_GOING,
    FEATURE_BEAMS,
    FEATURE_SAMPLES_PER_M,
    LARGE_M,
    NEAR_GOAL_M,
    SPARE_PX,
)
from houseexpo.pseudoslam.kernels.types import Offsets
from houseexpo.pseudoslam.step_kernels import enlarge_scratch, make_scratch


def planner_rules(config: SimulatorConfig, planning: PlanningConfig) -> PlannerRules:
    """Return the parameters of a planner's actions."""
    robot, ppm = config.robot, float(config.pixels_per_metre)
    return PlannerRules(
        frontier_rules(config, planning.large_m, planning.least_m),
        TravelRules(
            float(robot.radius_m * ppm),
            float(robot.step_m * ppm),
            math.radians(robot.turn_deg),
            round(planning.settled_m * ppm),
            max(round(AIM_M * ppm), 4),
            planning.max_steps,
        ),
    )


def frontier_rules(config: SimulatorConfig, large_m: float = LARGE_M, least_m: float = 0.0) -> FrontierRules:
    """Return the parameters for finding frontiers."""
    ppm = config.pixels_per_metre
    radius_px = config.robot.radius_m * ppm
    return FrontierRules(
        float(radius_px),
        float(config.laser.range_m * ppm),
        max(round(large_m * ppm), 1),
        max(round(least_m * ppm), 1),
        float(radius_px),
        max(round(config.laser.range_m * ppm), 1),
        nearby_offsets(max(NEAR_GOAL_M * ppm, 2 * radius_px)),
    )


def explorer_frontier_rules(config: SimulatorConfig) -> FrontierRules:
    """Return the parameters of explorers, which may find other frontiers close to one that was given up."""
    return frontier_rules(config)._replace(spare_px=SPARE_PX)


def descent_rules(config: SimulatorConfig, parts: int = 1) -> DescentRules:
    """Return the parameters of a robot that descends distances; ``parts`` is an argument of ``choose_turns``."""
    robot, ppm = config.robot, float(config.pixels_per_metre)
    radius_px, turn_rad = float(robot.radius_m * ppm), math.radians(robot.turn_deg)
    enough = ENOUGH if parts == 1 else ENOUGH_GOING
    return DescentRules(float(robot.step_m * ppm), turn_rad, radius_px, enough, parts)


def count_first_looks(config: SimulatorConfig) -> int:
    """Return the number of turns until the robot has looked in all directions."""
    return math.ceil((360.0 - config.laser.fov_deg) / config.robot.turn_deg - 1e-9)


def feature_rules(config: SimulatorConfig) -> FeatureRules:
    """Return the parameters for describing frontiers."""
    ppm = float(config.pixels_per_metre)
    angles = np.arange(FEATURE_BEAMS) * (2 * math.pi / FEATURE_BEAMS)
    frontiers = frontier_rules(config)
    apart = max(round(ppm / FEATURE_SAMPLES_PER_M), 1)
    return FeatureRules(ppm, frontiers.range_px, frontiers.large, apart, np.cos(angles), np.sin(angles))


def nearby_offsets(reach_px: float) -> Offsets:
    """Return the offsets of the cells within reach, nearest first, in the form of ``FrontierRules.near``."""
    reach = math.ceil(reach_px)
    found = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1).T
    squared = (found**2).sum(axis=1)
    order = np.lexsort((found[:, 1], found[:, 0], squared))
    return np.ascontiguousarray(found[order[squared[order] <= reach_px**2]].astype(np.int16))


class MapPlanner:
    """A planner for one map at a time. It has its own memory, so that each thread needs its own object.

    Cells are flat indices of the map, ``row * cols + col``; the centre of a cell is at (col + 0.5, row + 0.5).

    Parameters
    ----------
    config
        The robot's radius, the laser's range and the resolution are used.
    most
        Largest number of frontiers to return.
    large_m, least_m
        Clusters at least ``large_m`` long come first; those shorter than ``least_m`` are left out.

    Examples
    --------
    >>> planner = MapPlanner(SimulatorConfig())
    >>> x, y, _ = state.believed_px  # doctest: +SKIP
    >>> frontiers = planner.frontiers(state.known, x, y)  # doctest: +SKIP
    >>> path = planner.path(frontiers["goal"][0])  # doctest: +SKIP
    """

    def __init__(
        self, config: SimulatorConfig, *, most: int = 256, large_m: float = LARGE_M, least_m: float = 0.0
    ) -> None:
        self._rules = frontier_rules(config, large_m, least_m)
        self._cell_m = 1.0 / config.pixels_per_metre
        self._scratch = make_scratch(config)
        self._table = np.zeros(most, FRONTIER)
        self._shape = (0, 0)

    def frontiers(self, known: npt.NDArray[np.uint8], x: float, y: float, given_up: Sequence[int] = ()) -> Any:
        """Return the frontiers of a map, (n,) records ``FRONTIER`` in the order of ``kernels.planning.frontiers``.

        They are valid until the next call. ``goal`` is the cell to stand on, ``middle`` the cell to look at, ``cells``
        the size, and ``way`` the distance to the goal (``metres`` converts it). Cells within the robot's radius of
        those ``given_up`` are not frontiers. This also computes the distances of ``find_distances``.
        """
        self._prepare(known)
        lost = np.asarray(given_up, np.int32)
        n = find_frontiers(known, float(x), float(y), self._rules, lost, self._scratch, self._table)
        return self._table[:n]

    def find_distances(self, known: npt.NDArray[np.uint8], x: float, y: float, until: int = -1) -> None:
        """Compute only the distances to cells: those up to the cell ``until``, or all of them."""
        self._prepare(known)
        find_distances(known, float(x), float(y), self._rules.radius_px, int(until), self._scratch.ways)

    @property
    def ways(self) -> npt.NDArray[np.int32]:
        """The distance to each cell (rows, cols), in the units of ``PathScratch.ways``, valid until the next call."""
        return self._scratch.ways.ways[: self._shape[0] * self._shape[1]].reshape(self._shape)

    def path(self, cell: int) -> npt.NDArray[np.int32]:
        """Return the cells on the shortest path from the robot to a cell, none if there is no path."""
        path = np.empty(max(self._shape[0] * self._shape[1], 1), np.int32)
        return path[: trace_path(self._scratch.ways, int(cell), path)]

    def metres(self, ways: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Convert distances to metres."""
        found: npt.NDArray[np.float64] = ways * (self._cell_m / STRAIGHT)
        return found

    def _prepare(self, known: npt.NDArray[np.uint8]) -> None:
        """Allocate memory for a map, if needed."""
        self._scratch = enlarge_scratch(self._scratch, known.size)
        self._shape = known.shape
