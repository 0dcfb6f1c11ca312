"""Define what a team does, explore a house (rewards, when an episode ends), and which robots hear each other."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_number, check_one_of
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.kernels.radio import RadioParams
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


Model = Literal["none", "always", "range", "sight", "signal"]


@dataclass(frozen=True)
class Radio:
    """The communication of a team. Robots that hear each other exchange their maps, in both directions.

    Parameters
    ----------
    model
        "none"; "always"; "range": within ``range_m``; "sight": within ``range_m``, with no wall in between; "signal":
        the received power is above ``threshold_dbm``.
    range_m
        The range of the models "range" and "sight", metres.
    power_dbm, threshold_dbm
        The sent power, and the least power that is received.
    loss_db
        The path loss at the reference distance.
    reference_m
        The reference distance in air; air up to it adds no loss.
    air_exponent, wall_exponent
        The path-loss exponents of air and of walls.
    wall_unit_m
        The thickness of wall that adds no loss.

    Notes
    -----
    "signal" is the model of IR2 (Tan et al., IROS 2024) without its fading: with the length ``a`` of the line between
    two robots in air and ``w`` in walls, the received power is ``power - loss - 10 air_exponent log10(a / reference) -
    10 wall_exponent log10(w / wall_unit)``; a logarithm below 0 counts as 0. IR2 counts lengths in cells of its maps
    (reference 35, unit 1); the defaults here take one of its cells as 0.1 m. It treats unknown cells like walls,
    because it asks the robots' maps; here the house itself decides.
    """

    model: Model = "none"
    range_m: float = 5.0
    power_dbm: float = -20.0
    threshold_dbm: float = -70.0
    loss_db: float = 31.0
    reference_m: float = 3.5
    air_exponent: float = 2.0
    wall_exponent: float = 4.0
    wall_unit_m: float = 0.1

    def __post_init__(self) -> None:
        check_one_of(self.model, "radio.model", get_args(Model))
        for name in ("range_m", "reference_m", "wall_unit_m", "air_exponent", "wall_exponent"):
            check_number(getattr(self, name), f"radio.{name}", above=0.0)
        check_number(self.loss_db, "radio.loss_db", at_least=0.0)
        for name in ("power_dbm", "threshold_dbm"):
            check_number(getattr(self, name), f"radio.{name}")

    def link(self, cell_m: float) -> RadioParams:
        """Return the parameters for kernels, on a grid with cells of this side."""
        return RadioParams(
            get_args(Model).index(self.model), float(cell_m), float(self.range_m), float(self.power_dbm),
            float(self.threshold_dbm), float(self.loss_db), float(self.reference_m), float(self.air_exponent),
            float(self.wall_exponent), float(self.wall_unit_m),
        )  # fmt: skip
