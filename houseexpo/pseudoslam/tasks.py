"""Compute rewards, termination and reports of exploration, obstacle avoidance and navigation, for N episodes at once.

Single and vector environments call the same functions with arrays of length 1 or N, so that their results are identical
to the last bit.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_number, check_one_of
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.config import GoalConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.metrics import Bools, Floats, Metrics

ExplorationReward = Literal["area", "coverage"]
AvoidanceReward = Literal["paper", "way"]


class Task(ABC):
    """A task: its default configuration, its reward, and its termination."""

    default: SimulatorConfig
    clearance_m: float = 0.0
    rewards_add_up: bool = False
    """Whether ``rewards`` over several steps equals the sum over single steps, which planners' actions need."""

    def configure(self, config: SimulatorConfig | None) -> SimulatorConfig:
        """Return the configuration for a requested one; for None, the task's default."""
        return config or self.default

    @abstractmethod
    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:
        """Return the rewards (N,) of a step.

        ``ahead`` says in which episodes the action was to go forward, ``success`` in which the task is now fulfilled.
        """

    @abstractmethod
    def success(self, after: Metrics) -> Bools:
        """Return in which episodes (N,) the task is fulfilled."""

    def terminated(self, after: Metrics, success: Bools) -> Bools:  # noqa: ARG002  # other tasks use it
        """Return which episodes (N,) the task terminates, as a new array."""
        return success.copy()

    def enough_cells(self, observable_cells: int) -> int:  # noqa: ARG002  # other tasks use it
        """Return how many of the cells that coverage counts must be known for success.

        Planners' actions, which take many steps, end at this number. If they need not end, it is impossibly large.
        """
        return np.iinfo(np.int64).max

    def report(self, after: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Return the entries of ``info`` as new arrays with one value for each episode."""
        return {
            "explored_m2": after.explored_m2.copy(),
            "coverage": after.coverage.copy(),
            "collisions": after.counts["collisions"].copy(),
            "collided": after.collided.copy(),
            "pose": after.pose.copy(),
            "is_success": success,
        }


@dataclass(frozen=True)
class Exploration(Task):
    """The task of exploring the whole house.

    Parameters
    ----------
    success_coverage
        An episode terminates when the robot knows this share of what it can see. None, as in the paper (section IV-C):
        it runs until the time limit, and no episode is a success.
    reward
        "area", the paper's: the newly known area, m2. "coverage": the newly known share of what the robot can see, so
        that small and large houses have equal weight; the rewards of an episode add up to 1 at most.
    cost_per_metre, cost_per_turn
        The amounts that each metre travelled and each full turn in place subtract from the reward, in its unit.
    """

    success_coverage: float | None = None
    reward: ExplorationReward = "area"
    cost_per_metre: float = 0.0
    cost_per_turn: float = 0.0
    default = SimulatorConfig()

    def __post_init__(self) -> None:
        check_one_of(self.reward, "reward", get_args(ExplorationReward))
        check_number(self.cost_per_metre, "cost_per_metre", at_least=0.0)
        check_number(self.cost_per_turn, "cost_per_turn", at_least=0.0)
        if self.success_coverage is not None:
            check_number(self.success_coverage, "success_coverage", above=0.0)
            if self.success_coverage > 1:
                raise ConfigError(f"success_coverage: expected at most 1, found {self.success_coverage!r}")

    @property
    def rewards_add_up(self) -> bool:  # type: ignore[override]  # a constant of other tasks
        """Whether the rewards add up; turns can only be measured step by step."""
        return self.cost_per_turn == 0

    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:  # noqa: ARG002
        """Return the newly known area or share minus the costs."""
        found = after.area_since(before) if self.reward == "area" else after.coverage - before.coverage
        if self.cost_per_metre > 0:
            found = found - self.cost_per_metre * after.way_since(before)
        if self.cost_per_turn > 0:
            found = found - self.cost_per_turn * after.turn_since(before) / (2.0 * math.pi)
        return found

    def success(self, after: Metrics) -> Bools:
        """Return in which episodes enough is known."""
        if self.success_coverage is None:
            return np.zeros(len(after.rows), bool)
        return after.coverage >= self.success_coverage

    def enough_cells(self, observable_cells: int) -> int:
        """Return the number of cells that ``success_coverage`` stands for, by the same division."""
        if self.success_coverage is None:
            return super().enough_cells(observable_cells)
        all_cells = max(observable_cells, 1)
        enough = math.floor(self.success_coverage * all_cells)
        return enough if enough / all_cells >= self.success_coverage else enough + 1


@dataclass(frozen=True)
class ObstacleAvoidance(Task):
    """The task of moving without touching obstacles (section IV-B).

    After a collision, the robot stays where it touches the obstacle; with ``terminate_on_collision``, the episode
    terminates. An episode without a collision is a success.

    Parameters
    ----------
    safe_m
        The least clearance for the full reward of "way", metres.
    reward
        "paper": -1 for a collision, else 0.9 times the newly known area in m2, plus 0.1 for the action forward. "way":
        -1 for a collision, else the distance forward as a share of a full step, times 0.1 + 0.9 c, where c is the
        clearance divided by ``safe_m``, at most 1. It pays for driving on when the whole room is known, and for keeping
        away from obstacles.
    """

    terminate_on_collision: bool = False
    safe_m: float = 0.5
    reward: AvoidanceReward = "paper"
    default = SimulatorConfig(
        pixels_per_metre=33.0,
        observation=ObservationConfig(size_m=3.0),
        obstacles=ObstaclesConfig(random=RandomObstacles(number=(1, 5))),
    )

    def __post_init__(self) -> None:
        check_number(self.safe_m, "safe_m", above=0.0)
        check_one_of(self.reward, "reward", get_args(AvoidanceReward))

    @property
    def clearance_m(self) -> float:  # type: ignore[override]  # a constant of other tasks
        """The distance up to which the robot's clearance is measured."""
        return self.safe_m

    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:  # noqa: ARG002
        """Return the paper's reward, or the one for the distance travelled."""
        if self.reward == "way":
            share = np.minimum(after.way_since(before) / after.config.full_step_m, 1.0) * ahead
            safety = np.minimum(after.readings["clearance"] * after.cell_m / self.safe_m, 1.0)
            return np.where(after.collided, -1.0, share * (0.9 * safety + 0.1))
        return np.where(after.collided, -1.0, 0.9 * after.area_since(before) + 0.1 * ahead)

    def success(self, after: Metrics) -> Bools:
        """Return which episodes have reached the time limit without a collision."""
        success: Bools = after.truncated() & (after.counts["collisions"] == 0)
        return success

    def terminated(self, after: Metrics, success: Bools) -> Bools:  # noqa: ARG002
        """Return in which episodes the robot has just collided, if that terminates the episode."""
        return after.collided.copy() if self.terminate_on_collision else np.zeros(len(after.rows), bool)

    def report(self, after: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Add the clearance."""
        return {**super().report(after, success), "clearance_m": after.readings["clearance"] * after.cell_m}


@dataclass(frozen=True)
class Navigation(Task):
    """The task of going to a place, or to a room or piece of furniture of a kind (``config.goal``).

    The reward is the progress along the shortest path to the goal, metres, plus ``success_reward`` at the goal. An
    episode terminates within ``config.goal.radius_m`` of the goal; one that starts there terminates with its first
    step. If the goal is a kind of room or furniture, the shortest path is the one from the start to the nearest of the
    kind, the progress is along paths to that place, and any of its kind will do. ``spl`` in ``info`` is success
    weighted by path length (Anderson et al., 2018): 0 without success, 1 if the episode starts at the goal, else the
    shortest path as a share of the distance travelled.
    """

    success_reward: float = 2.5
    default = SimulatorConfig(goal=GoalConfig(), known_map=True)
    rewards_add_up = True

    def __post_init__(self) -> None:
        check_number(self.success_reward, "success_reward")

    def configure(self, config: SimulatorConfig | None) -> SimulatorConfig:
        """Add a random goal to a configuration without one."""
        config = config or self.default
        return config if config.goal else replace(config, goal=GoalConfig())

    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:  # noqa: ARG002
        """Return the progress along the shortest path, plus the reward at the goal."""
        saved: Floats = (before.readings["to_goal"] - after.readings["to_goal"]) * after.cell_m
        return saved + self.success_reward * success

    def success(self, after: Metrics) -> Bools:
        """Return in which episodes the robot is at the goal, or was at the start."""
        return self._is_goal(after, after.readings["to_goal"], after.pose[:, :2]) | self._starts_there(after)

    def _starts_there(self, after: Metrics) -> Bools:
        return self._is_goal(after, after.constants.shortest_path_m, after.start())

    def _is_goal(self, after: Metrics, way: Floats, place: Floats) -> Bools:
        """Return in which episodes a place (N, 2), m, is the goal; ``way`` (N,) is the way from there."""
        if after.config.goal_region:
            here: Bools = way == 0.0
            return here
        x, y = (after.constants.goal_m - place).T
        there: Bools = np.hypot(x, y) <= (after.config.goal or GoalConfig()).radius_m
        return there

    def report(self, after: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Add the remaining distance, the distance travelled, and the success weighted by path length."""
        gone, best = after.readings["path_length"] * after.cell_m, after.constants.shortest_path_m
        share = best / np.maximum(np.maximum(gone, best), 1e-12)
        report = super().report(after, success)
        return {
            **report,
            "to_goal_m": after.readings["to_goal"] * after.cell_m,
            "way_m": gone,
            "goal": after.constants.goal_m.copy(),
            "spl": np.where(success, np.where(self._starts_there(after), 1.0, share), 0.0),
        }


ROOM = FloorPlan("room-5.5x3.2", np.array([(0.0, 0.0), (0.0, 3.2), (5.5, 3.2), (5.5, 0.0)]), 1, {})
"""A room of the size in which the paper tests obstacle avoidance (section IV-B, figure 7)."""
