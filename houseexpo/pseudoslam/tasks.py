"""What a robot is asked to do: rewards, ends and reports, for many episodes at once.

Single and vector environments call the same functions, with arrays of one or of N, so that both say the same bits.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.config import GoalConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.checks import number, one_of
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.metrics import Bools, Floats, Metrics

ExplorationReward = Literal["area", "coverage"]
AvoidanceReward = Literal["paper", "way"]


class Task(ABC):
    """A task's default configuration, its reward, and when it is done."""

    default: SimulatorConfig
    clearance_m: float = 0.0
    rewards_add_up: bool = False
    """Whether ``rewards`` from before several steps to after them is the sum of theirs: planners' actions need it."""

    def configured(self, config: SimulatorConfig | None) -> SimulatorConfig:
        """Return the configuration that is used where this one is asked for; None: the task's own."""
        return config or self.default

    @abstractmethod
    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:
        """Return the rewards of a step.

        ``ahead`` says where the action was to go forward, ``success`` where the task is fulfilled now.
        """

    @abstractmethod
    def success(self, after: Metrics) -> Bools:
        """Return where the task is fulfilled."""

    def terminated(self, after: Metrics, success: Bools) -> Bools:  # noqa: ARG002  # other tasks use it
        """Return where the episode ends for the task's sake, an array of its own."""
        return success.copy()

    def enough_cells(self, observable_cells: int) -> int:  # noqa: ARG002  # other tasks use it
        """Return how many of the cells that coverage counts are to be known for success; more than there can be: any.

        Planners' actions end there, for an action is many steps.
        """
        return np.iinfo(np.int64).max

    def report(self, after: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Return what ``info`` says, a value for each episode: arrays of the caller's own."""
        return {
            "explored_m2": after.explored_m2.copy(),
            "coverage": after.coverage.copy(),
            "collisions": after.counts["collisions"].copy(),
            "collided": after.collided,
            "pose": after.pose.copy(),
            "is_success": success,
        }


@dataclass(frozen=True)
class Exploration(Task):
    """See the whole house.

    An episode ends when ``success_coverage`` of what the robot can see is known; None: when time is up.

    Parameters
    ----------
    reward
        "area": the newly known area, m2. "coverage": the newly known share of what can be seen, so that small houses
        count as much as big ones; an episode's rewards add up to 1 at most.
    cost_per_metre, cost_per_turn
        What a metre of the way gone and a full turn on the spot take off the reward, in its unit.
    """

    success_coverage: float | None = 0.95
    reward: ExplorationReward = "area"
    cost_per_metre: float = 0.0
    cost_per_turn: float = 0.0
    default = SimulatorConfig()

    def __post_init__(self) -> None:
        one_of(self.reward, "reward", get_args(ExplorationReward))
        number(self.cost_per_metre, "cost_per_metre", at_least=0.0)
        number(self.cost_per_turn, "cost_per_turn", at_least=0.0)
        if self.success_coverage is not None:
            number(self.success_coverage, "success_coverage", above=0.0)
            if self.success_coverage > 1:
                raise ConfigError(f"success_coverage: expected at most 1, found {self.success_coverage!r}")

    @property
    def rewards_add_up(self) -> bool:  # type: ignore[override]  # a constant of other tasks
        """Whether they do: turns on the way are seen only step by step."""
        return self.cost_per_turn == 0

    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:  # noqa: ARG002
        """Return what became known, less what that cost."""
        found: Floats
        if self.reward == "area":
            found = np.multiply(after.counts["known"] - before.counts["known"], after.cell_m**2)
        else:
            found = after.coverage - before.coverage
        if self.cost_per_metre > 0:
            found = found - self.cost_per_metre * after.way_since(before)
        if self.cost_per_turn > 0:
            found = found - self.cost_per_turn * after.turn_since(before) / (2.0 * math.pi)
        return found

    def success(self, after: Metrics) -> Bools:
        """Return where enough is known."""
        least = math.inf if self.success_coverage is None else self.success_coverage
        return after.coverage >= least

    def enough_cells(self, observable_cells: int) -> int:
        """Return how many cells ``success_coverage`` is, by the same division."""
        if self.success_coverage is None:
            return super().enough_cells(observable_cells)
        all_cells = max(observable_cells, 1)
        enough = math.floor(self.success_coverage * all_cells)
        return enough if enough / all_cells >= self.success_coverage else enough + 1


@dataclass(frozen=True)
class ObstacleAvoidance(Task):
    """Keep moving and off everything (section IV-B).

    A collision leaves the robot where it touches; ``terminate_on_collision`` ends the episode there. An episode without
    a collision is a success.

    Parameters
    ----------
    safe_m
        r_s is the room round the robot as a share of this, at most 1.
    reward
        "paper": -1 for a collision, else 0.9 r_s + 0.1 for going forward. Who spins on the spot in an open place gets
        nearly all of it. "way": -1 for a collision, else 0.9 r_s + 0.1, times the way gone forward as a share of a
        whole step: who spins, stands or backs gets nothing.
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
        number(self.safe_m, "safe_m", above=0.0)
        one_of(self.reward, "reward", get_args(AvoidanceReward))

    @property
    def clearance_m(self) -> float:  # type: ignore[override]  # a constant of other tasks
        """How far round the robot its clearance is measured."""
        return self.safe_m

    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:  # noqa: ARG002
        """Return the paper's reward, or that for the way gone."""
        if self.reward == "way":
            share = np.minimum(after.way_since(before) / after.config.robot.step_m, 1.0) * ahead
            return np.where(after.collided, -1.0, share * (0.9 * self._safety(after) + 0.1))
        return np.where(after.collided, -1.0, 0.9 * self._safety(after) + 0.1 * ahead)

    def _safety(self, after: Metrics) -> Floats:
        share: Floats = np.minimum(after.readings["clearance"] * after.cell_m / self.safe_m, 1.0)
        return share

    def success(self, after: Metrics) -> Bools:
        """Return where time is up and nothing was touched."""
        success: Bools = after.truncated() & (after.counts["collisions"] == 0)
        return success

    def terminated(self, after: Metrics, success: Bools) -> Bools:  # noqa: ARG002
        """Return where the robot has just collided, if that is to end the episode."""
        return after.collided if self.terminate_on_collision else np.zeros(len(after.counts), bool)

    def report(self, after: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Add the clearance."""
        return {**super().report(after, success), "clearance_m": after.readings["clearance"] * after.cell_m}


@dataclass(frozen=True)
class Navigation(Task):
    """Go to a place in a known house: the reward is the way to the goal that is saved, m, and ``success_reward``.

    An episode ends within ``config.goal.radius_m`` of the goal. ``spl`` is success weighted by path length (Anderson et
    al., 2018): 0, or the shortest way as a share of the way gone.
    """

    success_reward: float = 2.5
    default = SimulatorConfig(goal=GoalConfig(), known_map=True)
    rewards_add_up = True

    def __post_init__(self) -> None:
        number(self.success_reward, "success_reward")

    def configured(self, config: SimulatorConfig | None) -> SimulatorConfig:
        """Add a random goal to a configuration without one."""
        config = config or self.default
        return config if config.goal else replace(config, goal=GoalConfig())

    def rewards(self, before: Metrics, after: Metrics, ahead: Bools, success: Bools) -> Floats:  # noqa: ARG002
        """Return the progress along the shortest way, and a reward for being there."""
        saved: Floats = (before.readings["to_goal"] - after.readings["to_goal"]) * after.cell_m
        return saved + self.success_reward * success

    def success(self, after: Metrics) -> Bools:
        """Return where the robot is at the goal."""
        x, y = (after.constants.goal_m - after.pose[:, :2]).T
        there: Bools = np.hypot(x, y) <= (after.config.goal or GoalConfig()).radius_m
        return there

    def report(self, after: Metrics, success: Bools) -> dict[str, npt.NDArray[Any]]:
        """Add the way left, the way gone, and the success weighted by path length."""
        gone, best = after.readings["path_length"] * after.cell_m, after.constants.shortest_path_m
        share = best / np.maximum(np.maximum(gone, best), 1e-12)
        report = super().report(after, success)
        return {
            **report,
            "to_goal_m": after.readings["to_goal"] * after.cell_m,
            "way_m": gone,
            "goal": after.constants.goal_m.copy(),
            "spl": np.where(success, share, 0.0),
        }


ROOM = FloorPlan("room-5.2x3.5", np.array([(0.0, 0.0), (0.0, 3.5), (5.2, 3.5), (5.2, 0.0)]), 1, {})
"""The room that the paper avoids obstacles in."""
