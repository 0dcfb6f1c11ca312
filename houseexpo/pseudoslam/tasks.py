"""What a robot is asked to do: rewards, ends and reports, for many episodes at once.

Single and vector environments call the same functions, with arrays of one or of N, so that both say the same bits.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.plan import FloorPlan
from houseexpo.pseudoslam.checks import number
from houseexpo.pseudoslam.config import GoalConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.step import (
    BLOCKED,
    CLEARANCE,
    COLLISIONS,
    COVERED,
    KNOWN,
    START_X,
    STEPS,
    TO_GOAL,
    WAY,
)
from houseexpo.pseudoslam.obstacle_config import ObstaclesConfig, RandomObstacles

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


class Facts(NamedTuple):
    """What does not change in an episode; arrays of N."""

    corner_m: Floats
    """(N, 2) the plan's (x, y) of the upper left corner of the first cell."""
    countable: Ints
    """Cells that coverage counts."""
    goal_m: Floats
    """(N, 2), not a number where there is none."""
    best_way_m: Floats
    """The way from the start to the goal."""


class Measures(NamedTuple):
    """What an episode has come to; arrays of N."""

    facts: Facts
    counts: Ints
    """(N, 7), see ``kernels.step``."""
    readings: Floats
    """(N, 3), see ``kernels.step``."""
    pose_px: Floats
    """(N, 6), see ``kernels.step``."""
    config: SimulatorConfig

    @property
    def cell_m(self) -> float:
        """Side of a cell."""
        return 1.0 / self.config.pixels_per_metre

    def pose(self) -> Floats:
        """Return (N, 3): x, y in the plan's metres, heading in radians."""
        return self._in_metres(self.pose_px[:, :3])

    def believed_pose(self) -> Floats:
        """Return (N, 3): where odometry has the robot, as ``pose`` does."""
        return self._in_metres(self.pose_px[:, 3:])

    def _in_metres(self, pose_px: Floats) -> Floats:
        found = pose_px * (self.cell_m, -self.cell_m, 1.0)
        found[:, :2] += self.facts.corner_m
        return found

    def since_start(self) -> Floats:
        """Return (N, 3) the believed pose: x, y in metres from where the episode started, heading in radians."""
        found = self.pose_px[:, 3:] * (self.cell_m, -self.cell_m, 1.0)
        found[:, :2] -= self.readings[:, START_X:] * (self.cell_m, -self.cell_m)
        return found

    def goal_ahead(self) -> Floats:
        """Return (N, 2) the goal as the robot sees it from where it believes to be: metres ahead and to the left."""
        x, y, heading = self.believed_pose().T
        right, up = self.facts.goal_m[:, 0] - x, self.facts.goal_m[:, 1] - y
        cos, sin = np.cos(heading), np.sin(heading)
        return np.stack([right * cos + up * sin, up * cos - right * sin], axis=1)

    def explored_m2(self) -> Floats:
        """Return the area that is known."""
        return self.counts[:, KNOWN] * self.cell_m**2

    def coverage(self) -> Floats:
        """Return the share of what can be seen that is known, 0 to 1."""
        return self.counts[:, COVERED] / np.maximum(self.facts.countable, 1)

    def truncated(self) -> Bools:
        """Return where time is up."""
        return self.counts[:, STEPS] >= self.config.max_steps


class Task(ABC):
    """A task's default configuration, its reward, and when it is done."""

    default: SimulatorConfig
    clearance_m: float = 0.0

    def configured(self, config: SimulatorConfig | None) -> SimulatorConfig:
        """Return the configuration that is used where this one is asked for; None: the task's own."""
        return config or self.default

    @abstractmethod
    def rewards(self, before: Measures, after: Measures, ahead: Bools) -> Floats:
        """Return the rewards of a step; ``ahead`` says where the action was to go forward."""

    @abstractmethod
    def success(self, after: Measures) -> Bools:
        """Return where the task is fulfilled."""

    def terminated(self, after: Measures) -> Bools:
        """Return where the episode ends for the task's sake."""
        return self.success(after)

    def report(self, after: Measures) -> dict[str, npt.NDArray[Any]]:
        """Return what ``info`` says, a value for each episode."""
        return {
            "explored_m2": after.explored_m2(),
            "coverage": after.coverage(),
            "collisions": after.counts[:, COLLISIONS].copy(),
            "collided": after.counts[:, BLOCKED] != 0,
            "pose": after.pose(),
            "is_success": self.success(after),
        }


@dataclass(frozen=True)
class Exploration(Task):
    """See the whole house: the reward is the newly known area, m2.

    An episode ends when ``success_coverage`` of what the robot can see is known; None: when time is up.
    """

    success_coverage: float | None = 0.95
    default = SimulatorConfig()

    def __post_init__(self) -> None:
        if self.success_coverage is not None:
            number(self.success_coverage, "success_coverage", above=0.0)
            if self.success_coverage > 1:
                raise ConfigError(f"success_coverage: expected at most 1, found {self.success_coverage!r}")

    def rewards(self, before: Measures, after: Measures, ahead: Bools) -> Floats:  # noqa: ARG002
        """Return the newly known area."""
        return (after.counts[:, KNOWN] - before.counts[:, KNOWN]) * after.cell_m**2

    def success(self, after: Measures) -> Bools:
        """Return where enough is known."""
        least = math.inf if self.success_coverage is None else self.success_coverage
        return after.coverage() >= least


@dataclass(frozen=True)
class ObstacleAvoidance(Task):
    """Keep moving and off everything (section IV-B): -1 for a collision, else 0.9 r_s + 0.1 for going forward.

    r_s is the room round the robot as a share of ``safe_m``, at most 1. A collision leaves the robot where it touches;
    ``terminate_on_collision`` ends the episode there. An episode without a collision is a success.
    """

    terminate_on_collision: bool = False
    safe_m: float = 0.5
    default = SimulatorConfig(
        pixels_per_metre=33.0,
        observation=ObservationConfig(size_m=3.0),
        obstacles=ObstaclesConfig(random=RandomObstacles(number=(1, 5))),
    )

    def __post_init__(self) -> None:
        number(self.safe_m, "safe_m", above=0.0)

    @property
    def clearance_m(self) -> float:  # type: ignore[override]  # a constant of other tasks
        """How far round the robot its clearance is measured."""
        return self.safe_m

    def rewards(self, before: Measures, after: Measures, ahead: Bools) -> Floats:  # noqa: ARG002
        """Return the paper's reward."""
        return np.where(after.counts[:, BLOCKED] != 0, -1.0, 0.9 * self._safety(after) + 0.1 * ahead)

    def _safety(self, after: Measures) -> Floats:
        return np.minimum(after.readings[:, CLEARANCE] * after.cell_m / self.safe_m, 1.0)

    def success(self, after: Measures) -> Bools:
        """Return where time is up and nothing was touched."""
        return after.truncated() & (after.counts[:, COLLISIONS] == 0)

    def terminated(self, after: Measures) -> Bools:
        """Return where the robot has just collided, if that is to end the episode."""
        return (after.counts[:, BLOCKED] != 0) & self.terminate_on_collision

    def report(self, after: Measures) -> dict[str, npt.NDArray[Any]]:
        """Add the clearance."""
        return {**super().report(after), "clearance_m": after.readings[:, CLEARANCE] * after.cell_m}


@dataclass(frozen=True)
class Navigation(Task):
    """Go to a place in a known house: the reward is the way to the goal that is saved, m, and ``success_reward``.

    An episode ends within ``config.goal.radius_m`` of the goal. ``spl`` is success weighted by path length (Anderson et
    al., 2018): 0, or the shortest way as a share of the way gone.
    """

    success_reward: float = 2.5
    default = SimulatorConfig(goal=GoalConfig(), known_map=True)

    def __post_init__(self) -> None:
        number(self.success_reward, "success_reward")

    def configured(self, config: SimulatorConfig | None) -> SimulatorConfig:
        """Add a random goal to a configuration without one."""
        config = config or self.default
        return config if config.goal else replace(config, goal=GoalConfig())

    def rewards(self, before: Measures, after: Measures, ahead: Bools) -> Floats:  # noqa: ARG002
        """Return the progress along the shortest way, and a reward for being there."""
        saved = (before.readings[:, TO_GOAL] - after.readings[:, TO_GOAL]) * after.cell_m
        return saved + self.success_reward * self.success(after)

    def success(self, after: Measures) -> Bools:
        """Return where the robot is at the goal."""
        x, y, _ = after.pose().T
        return np.hypot(after.facts.goal_m[:, 0] - x, after.facts.goal_m[:, 1] - y) <= (after.config.goal or GoalConfig()).radius_m

    def report(self, after: Measures) -> dict[str, npt.NDArray[Any]]:
        """Add the way left, the way gone, and the success weighted by path length."""
        gone, best = after.readings[:, WAY] * after.cell_m, after.facts.best_way_m
        share = best / np.maximum(np.maximum(gone, best), 1e-12)
        return {
            **super().report(after),
            "to_goal_m": after.readings[:, TO_GOAL] * after.cell_m,
            "way_m": gone,
            "goal": after.facts.goal_m.copy(),
            "spl": np.where(self.success(after), share, 0.0),
        }


ROOM = FloorPlan("room-5.2x3.5", [(0.0, 0.0), (0.0, 3.5), (5.2, 3.5), (5.2, 0.0)], 1, {})
"""The room that the paper avoids obstacles in."""

