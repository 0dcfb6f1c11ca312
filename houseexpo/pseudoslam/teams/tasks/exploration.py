"""Explore the house together."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from houseexpo.pseudoslam.config.checks import number, one_of
from houseexpo.pseudoslam.metrics import Bools, EpisodeConstants, Metrics
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
        one_of(self.until, "until", get_args(Until))
        number(self.report_m, "report_m", above=0.0)
        object.__setattr__(self, "_each", Exploration(self.success_coverage, self.reward))

    @property
    def single(self) -> Exploration:
        """The task of one robot."""
        return self._each

    def rewards_by_robot(self, before: list[Metrics], seen: list[Metrics], ahead: Bools) -> Floats:
        """Return the rewards (N, R) of a step of N teams at once."""
        found = np.empty(ahead.shape)
        for robot, (was, after) in enumerate(zip(before, seen, strict=True)):
            found[:, robot] = self._each.rewards(was, after, ahead[:, robot], self._each.success(after))
        return found

    def successes(self, coverage: Floats, now: list[Metrics]) -> Bools:
        """Return in which of N teams enough is known (N,)."""
        if self.success_coverage is None:
            return np.zeros(len(coverage), bool)
        if self.until == "team":
            return coverage >= self.success_coverage
        known = np.stack([each.coverage for each in now], axis=1) >= self.success_coverage
        if self.until == "report":
            base = np.column_stack([now[0].readings["start_x"], now[0].readings["start_y"]])
            away = np.stack([np.hypot(*(each.pose_px[:, :2] - base).T) for each in now], axis=1)
            known &= away <= self.report_m * now[0].config.pixels_per_metre
        return np.asarray(known.any(axis=1))

    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode."""
        del house
        return _Episode(team, self)


class _Episode(TeamEpisode):
    """An episode of one team: the same functions, with each robot's metrics by itself."""

    def __init__(self, team: Team, task: TeamExploration) -> None:
        super().__init__(team)
        self._task = task

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        one_each = _by_robot(before), _by_robot(seen)
        found: Floats = self._task.rewards_by_robot(*one_each, ahead[None])[0]
        return found

    def success(self, now: Metrics) -> bool:
        return bool(self._task.successes(np.array([self.team.coverage]), _by_robot(now))[0])


def _by_robot(metrics: Metrics) -> list[Metrics]:
    """Return the metrics of one team's robots (R,) as R of (1,)."""
    found = []
    for k in range(len(metrics.counts)):
        one = slice(k, k + 1)
        found.append(
            metrics._replace(
                constants=EpisodeConstants.of(metrics.constants.rows[one]), counts=metrics.counts[one],
                readings=metrics.readings[one], pose_px=metrics.pose_px[one], explored_m2=metrics.explored_m2[one],
                coverage=metrics.coverage[one], poses=metrics.poses[one],
            )
        )  # fmt: skip
    return found
