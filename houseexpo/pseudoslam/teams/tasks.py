"""Define the task of a team, exploring a house: its rewards, and when an episode ends."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.checks import check_number, check_one_of
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.tasks import Exploration, ExplorationReward

Floats = npt.NDArray[np.float64]
Until = Literal["team", "robot", "report"]


@dataclass(frozen=True)
class TeamExploration:
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

    def __post_init__(self) -> None:
        check_one_of(self.until, "until", get_args(Until))
        check_number(self.report_m, "report_m", above=0.0)
        _ = self.single  # which checks the others

    @classmethod
    def options(cls) -> set[str]:
        """Return the names of the task's options."""
        return {each.name for each in fields(cls)}

    @cached_property
    def single(self) -> Exploration:
        """The task of one robot."""
        return Exploration(self.success_coverage, self.reward)

    def rewards(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        """Return the rewards (N, R) of a step of N teams, for what each robot saw.

        ``before`` and ``seen`` are the metrics of N * R robots, team after team; ``ahead`` (N, R) says whose action was
        to go forward.
        """
        found: Floats = self.single.rewards(before, seen, ahead.ravel(), self.single.success(seen))
        return found.reshape(ahead.shape)

    def successes(self, coverage: Floats, now: Metrics) -> Bools:
        """Return in which of N teams enough is known (N,).

        ``coverage`` (N,) is the share of what can be seen that each team knows; ``now`` are the metrics of all N * R.
        """
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


def make_task(task: str, options: dict[str, Any]) -> tuple[TeamExploration, dict[str, Any]]:
    """Return the task, made with those of the options that are its own, and the other options.

    Raise ConfigError if there is no such task, or an option is invalid.
    """
    if task != "exploration":
        raise ConfigError(f"task: expected 'exploration', found {task!r}")
    own = TeamExploration.options()
    return (
        TeamExploration(**{name: value for name, value in options.items() if name in own}),
        {name: value for name, value in options.items() if name not in own},
    )
