"""Explore the house together."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from houseexpo.pseudoslam.config.checks import number, one_of
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.tasks import Exploration, ExplorationReward
from houseexpo.pseudoslam.teams.tasks.task import Floats, TeamEpisode, TeamTask
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House

Until = Literal["team", "robot", "report"]


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

    def __post_init__(self) -> None:
        one_of(self.until, "until", get_args(Until))
        number(self.report_m, "report_m", above=0.0)
        object.__setattr__(self, "_each", Exploration(self.success_coverage, self.reward))

    @property
    def single(self) -> Exploration:
        """The task of one robot."""
        return self._each

    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode."""
        del house
        return _Episode(team, self)


class _Episode(TeamEpisode):
    def __init__(self, team: Team, task: TeamExploration) -> None:
        super().__init__(team)
        self._task = task

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        single = self._task.single
        return single.rewards(before, seen, ahead, single.success(seen))

    def success(self, now: Metrics) -> bool:
        least = self._task.success_coverage
        if least is None:
            return False
        if self._task.until == "team":
            return self.team.coverage >= least
        found: Bools = now.coverage >= least
        if self._task.until == "report":
            starts = np.column_stack([now.readings["start_x"], now.readings["start_y"]])
            away = np.hypot(*(now.pose_px[:, :2] - starts[0]).T)
            found = found & (away <= self._task.report_m * self.team.ppm)
        return bool(found.any())
