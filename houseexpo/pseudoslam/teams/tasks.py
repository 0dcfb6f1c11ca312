"""Define what a team does, its reward, end, observations and measures: exploring, or a task of the caller's own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Literal, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import check_number, check_one_of
from houseexpo.pseudoslam.envs.spec import EnvSpec
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.tasks import Exploration, ExplorationReward, Task
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House

Floats = npt.NDArray[np.float64]
Array = npt.NDArray[Any]
Until = Literal["team", "robot", "report"]


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
        return {each.name for each in fields(cls) if each.init}  # type: ignore[arg-type]  # subclasses are dataclasses

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


@dataclass(frozen=True)
class TeamExploration(TeamTask):
    """The task of exploring a house. A robot's reward is for what it saw itself.

    Parameters
    ----------
    success_coverage, reward
        Fields of ``tasks.Exploration``.
    until
        When an episode terminates. "team": the maps of all robots together know ``success_coverage``. "robot": one
        robot's own map does. "report": one robot's own map does, and that robot is within ``report_m`` of where the
        first robot started.
    report_m
        The distance of a report, metres.
    """

    success_coverage: float | None = 0.95
    reward: ExplorationReward = "area"
    until: Until = "team"
    report_m: float = 1.0
    _each: Exploration = field(init=False, repr=False, compare=False)

    name = "exploration"
    knows_map = False
    measures = False

    def __post_init__(self) -> None:
        check_one_of(self.until, "until", get_args(Until))
        check_number(self.report_m, "report_m", above=0.0)
        object.__setattr__(self, "_each", Exploration(self.success_coverage, self.reward))

    @property
    def single(self) -> Exploration:
        """The task of one robot."""
        return self._each

    @property
    def _has_own_episode(self) -> bool:
        """Whether a derived task has an episode of its own, which must be asked team by team."""
        return type(self).begin is not TeamExploration.begin

    def rewards_by_robot(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats | None:
        """Return the rewards (N, R) of a step of N teams at once, None for a derived task with its own episode."""
        return None if self._has_own_episode else self.explored(before, seen, ahead)

    def explored(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        """Return the rewards (N, R) of N teams for what each robot saw in a step."""
        found: Floats = self._each.rewards(before, seen, ahead.ravel(), self._each.success(seen))
        return found.reshape(ahead.shape)

    def successes(self, coverage: Floats, now: Metrics) -> Bools | None:
        """Return in which of N teams enough is known (N,), None for a derived task with its own episode."""
        return None if self._has_own_episode else self.know_enough(coverage, now)

    def know_enough(self, coverage: Floats, now: Metrics) -> Bools:
        """Return in which of N teams enough is known (N,)."""
        teams = len(coverage)
        if self.success_coverage is None:
            return np.zeros(teams, bool)
        if self.until == "team":
            return coverage >= self.success_coverage
        known = now.coverage.reshape(teams, -1) >= self.success_coverage
        if self.until == "report":
            start_x, start_y = (now.readings[key].reshape(teams, -1)[:, :1] for key in ("start_x", "start_y"))
            places = now.pose_px.reshape(teams, -1, 6)
            away = np.hypot(places[..., 0] - start_x, places[..., 1] - start_y)
            known &= away <= self.report_m * now.config.pixels_per_metre
        return np.asarray(known.any(axis=1))

    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode."""
        del house
        return _Episode(team, self)


class _Episode(TeamEpisode):
    """An episode of one team: the same functions."""

    def __init__(self, team: Team, task: TeamExploration) -> None:
        super().__init__(team)
        self._task = task

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        found: Floats = self._task.explored(before, seen, ahead[None])[0]
        return found

    def success(self, now: Metrics) -> bool:
        return bool(self._task.know_enough(np.array([self.team.coverage]), now)[0])


def make_task(task: str | TeamTask, options: dict[str, Any]) -> tuple[TeamTask, dict[str, Any]]:
    """Return a task, exploring made with those of the options that are its own, and the other options.

    Raise ConfigError if there is no such task, or an option is invalid.
    """
    if isinstance(task, TeamTask):
        return task, options
    if task != TeamExploration.name:
        raise ConfigError(f"task: expected {TeamExploration.name!r} or a TeamTask, found {task!r}")
    own = TeamExploration.options()
    return (
        TeamExploration(**{name: value for name, value in options.items() if name in own}),
        {name: value for name, value in options.items() if name not in own},
    )
