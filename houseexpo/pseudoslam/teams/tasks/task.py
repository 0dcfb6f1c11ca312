"""Define the interface of a team's task: its reward, end, observations and measures, but not how robots move."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.spec import EnvSpec
from houseexpo.pseudoslam.kernels.walls import length_in_walls
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.tasks import Exploration, Task
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House

Floats = npt.NDArray[np.float64]
Array = npt.NDArray[Any]
FARTHER_THAN_ANY_M = 10_000.0
"""Larger than any distance in a house."""


class TeamTask(ABC):
    """A task of a team. Subclasses are frozen dataclasses, whose fields are arguments of ``parallel_env``."""

    name: ClassVar[str]
    default: ClassVar[SimulatorConfig] = SimulatorConfig()
    knows_map: ClassVar[bool] = True
    """Whether robots may know the map from the start (``config.known_map``)."""
    measures: ClassVar[bool] = True
    """Whether episodes have measures of their own."""
    house_matters: ClassVar[bool] = False
    """Whether episodes need the house itself, with its rooms, besides its cells."""

    @classmethod
    def options(cls) -> set[str]:
        """Return the names of the task's options."""
        return {field.name for field in fields(cls) if field.init}  # type: ignore[arg-type]  # subclasses are dataclasses

    @property
    def single(self) -> Task:
        """The task whose configuration and ``info`` each robot has: exploring, which nothing ends."""
        return _Each(None, of=self)

    def configure(self, config: SimulatorConfig) -> SimulatorConfig:
        """Return the configuration to use if this one is requested."""
        return config

    def spaces(self, spec: EnvSpec, robots: int) -> dict[str, spaces.Space[Any]]:  # noqa: ARG002  # other tasks use it
        """Return the spaces of the parts that the task adds to each robot's observation."""
        return {}

    def rewards_by_robot(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats | None:  # noqa: ARG002
        """Return the rewards (N, R) of a step of N teams at once, None if their episodes must be asked one by one.

        ``before`` and ``seen`` are the metrics of N * R robots, team after team; ``ahead`` is (N, R).
        """
        return None

    def successes(self, coverage: Floats, now: Metrics) -> Bools | None:  # noqa: ARG002
        """Return in which of N teams the task is fulfilled (N,), None if their episodes must be asked one by one.

        ``coverage`` (N,) is the share of what can be seen that each team knows; ``now`` are the metrics of all N * R.
        """
        return None

    @abstractmethod
    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode whose robots are at their starts; raise ConfigError if there is none.

        ``house`` is None unless ``house_matters``.
        """


@dataclass(frozen=True)
class _Each(Exploration):
    """Exploring with the configuration of a team's task."""

    of: TeamTask | None = None

    def configure(self, config: SimulatorConfig | None) -> SimulatorConfig:
        """Return the configuration that the team's task makes of this one, or of its own."""
        assert self.of is not None  # noqa: S101  # a default that a dataclass wants
        return self.of.configure(config or self.of.default)


class TeamEpisode(ABC):
    """What a task keeps of an episode of one team."""

    def __init__(self, team: Team) -> None:
        self.team = team

    @abstractmethod
    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        """Take note of a step, and return the robots' rewards (n,).

        Parameters
        ----------
        before, seen
            The robots' metrics before the step, and after it but before they exchanged maps.
        ahead
            (n,), whose action was to go forward.
        """

    @abstractmethod
    def success(self, now: Metrics) -> bool:
        """Return whether the task is fulfilled, which ends the episode for all robots."""

    def observe(self) -> dict[str, Array]:
        """Return the task's parts of the observations, new arrays (n, ...)."""
        return {}

    def report(self) -> dict[str, float | None]:
        """Return the task's measures, None for what has not happened yet."""
        return {}


def to_robot_frame(pose_px: Floats, places_px: Floats, pixels_per_metre: float) -> Floats:
    """Return places (n, 2) relative to a pose (3,), both in pixels with y down: metres ahead and to the left (n, 2)."""
    right, up = places_px[:, 0] - pose_px[0], pose_px[1] - places_px[:, 1]
    cos, sin = math.cos(pose_px[2]), math.sin(pose_px[2])
    return np.column_stack([right * cos + up * sin, up * cos - right * sin]) / pixels_per_metre


def are_in_view(team: Team, robot: int, places_px: Floats) -> Bools:
    """Return which places (n, 2), pixels, are in the range and field of view of a robot's laser, with no wall between.

    Robots and people do not hide each other.
    """
    pose = team.states[robot].pose_px
    near = to_robot_frame(pose, places_px, 1.0)
    sensor = team.params.sensor
    found: Bools = np.hypot(*near.T) <= sensor.range_px
    found &= np.abs(np.arctan2(near[:, 1], near[:, 0])) <= sensor.half_fov
    for k in np.flatnonzero(found).tolist():
        found[k] = has_line_of_sight(team, pose[:2], places_px[k])
    return found


def has_line_of_sight(team: Team, one_px: Floats, other_px: Floats) -> bool:
    """Return whether no wall is between two places (2,), pixels."""
    return length_in_walls(team.walls, *one_px.tolist(), *other_px.tolist()) == 0.0
