"""Define the task of a team that explores a house together: its rewards, and its end when enough is known."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from houseexpo.pseudoslam.config.checks import check_number, check_one_of
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
    measures = False

    def __post_init__(self) -> None:
        check_one_of(self.until, "until", get_args(Until))
        check_number(self.report_m, "report_m", above=0.0)
        object.__setattr__(self, "_each", Exploration(self.success_coverage, self.reward))

    @property
    def single(self) -> Exploration:
        """The task of one robot."""
        return self._each

    def rewards_by_robot(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        """Return the rewards (N, R) of a step of N teams at once."""
        found: Floats = self._each.rewards(before, seen, ahead.ravel(), self._each.success(seen))
        return found.reshape(ahead.shape)

    def successes(self, coverage: Floats, now: Metrics) -> Bools:
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
        found: Floats = self._task.rewards_by_robot(before, seen, ahead[None])[0]
        return found

    def success(self, now: Metrics) -> bool:
        return bool(self._task.successes(np.array([self.team.coverage]), now)[0])
