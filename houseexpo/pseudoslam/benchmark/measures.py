"""Record an episode's trace, compute its metrics by kind of track, and define their names, units and tables."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

Values = dict[str, float | None]
OVER: Final = ("steps", "metres")
MEAN_DIGITS: Final = 6
PERSONAL_M: Final = 1.2
INTIMATE_M: Final = 0.45
"""The outer limits of people's personal and intimate distance (Hall, The Hidden Dimension, 1966: 4 and 1.5 feet)."""
TOUCH_M: Final = 0.1
"""The largest gap between a robot that was stopped and the person that stopped it: both are drawn as whole cells."""


@dataclass
class Trace:
    """The rows of an episode, one at the start and one after each action, and the last ``info``.

    An action of a planner may take many steps; rows count the robot's steps, not actions.
    """

    steps: array[float] = field(default_factory=lambda: array("d"))
    metres: array[float] = field(default_factory=lambda: array("d"))
    coverage: array[float] = field(default_factory=lambda: array("d"))
    reward: float = 0.0
    info: Mapping[str, Any] = field(default_factory=dict)
    metres_untouched: float = 0.0
    """The metres before the first collision."""
    person_m: array[float] = field(default_factory=lambda: array("d"))
    """The gap between the robot and the nearest person, infinite without people."""
    person_collisions: int = 0
    """The number of rows in which the robot has just been stopped by a person."""

    def add(
        self, steps: int, metres: float, info: Mapping[str, Any], reward: float = 0.0, person_m: float = math.inf
    ) -> None:
        """Add a row; ``person_m`` is the gap between the robot and the nearest person.

        Raises
        ------
        ValueError
            Something else changed or reset the environment: the coverage is not a share, or steps or metres fall.
        """
        coverage = info["coverage"]
        if not 0.0 <= coverage <= 1.0:
            raise ValueError(f"a coverage of {coverage:.2%}, expected 0 to 100%: something changed the environment")
        if self.steps and (steps < self.steps[-1] or metres < self.metres[-1]):
            raise ValueError(
                f"{steps} steps and {metres:.1f} m after {self.steps[-1]:.0f} and {self.metres[-1]:.1f} m: something "
                "reset the environment in the middle of an episode"
            )
        self.steps.append(steps)
        self.metres.append(metres)
        self.coverage.append(coverage)
        self.person_m.append(person_m)
        self.person_collisions += bool(info.get("collided")) and person_m <= TOUCH_M
        self.reward += reward
        if not info["collisions"]:
            self.metres_untouched = metres
        self.info = info

    def over(self, what: str) -> Floats:
        """Return the steps, or the metres, of all rows."""
        return np.frombuffer(self.steps if what == "steps" else self.metres)

    def coverage_at(self, what: str, places: npt.ArrayLike) -> Floats:
        """Return the coverage after a number of steps or metres: the coverage of the last row within them."""
        rows = np.searchsorted(self.over(what), np.asarray(places, np.float64), side="right") - 1
        found: Floats = np.frombuffer(self.coverage)[rows]
        return found

    def mean_coverage(self, what: str, budget: float) -> float:
        """Return the area under the curve of coverage from 0 to a budget, as a share of the budget.

        Coverage is constant from each row to the next, and after the last one.
        """
        ends = np.minimum(np.append(self.over(what), budget), budget)
        return float(np.diff(ends) @ np.frombuffer(self.coverage)) / budget

    def first(self, coverage: float) -> tuple[float, float] | None:
        """Return the steps and metres until a coverage was reached, None if it was not."""
        rows = np.flatnonzero(np.frombuffer(self.coverage) >= coverage)
        return None if not len(rows) else (self.steps[rows[0]], self.metres[rows[0]])


@dataclass(frozen=True)
class Metric:
    """A metric of an episode.

    Parameters
    ----------
    key, title, unit
        The name in results, the name in tables, and "%", "m", "p" for a p-value, or "".
    better
        The direction that is better.
    table
        The table that shows it, "" for the first; None to show it only in results.
    paired
        Whether tables also show the difference from the baseline, plan by plan.
    """

    key: str
    title: str
    unit: str
    better: Literal["high", "low"]
    table: str | None = ""
    paired: bool = False


COLLISIONS: Final = Metric("collisions", "collisions", "", "low")


def budget_metrics(budgets: tuple[int, ...]) -> tuple[Metric, ...]:
    """Return the metrics of ``CoverageAtBudgets``, with one table over steps and one over metres."""
    found = []
    for over, longest in zip(OVER, (budgets[-1], budgets[1]), strict=True):
        areas = [
            Metric(f"area_{b}_{over}", f"area, {b} {over}", "%", "high", over if b == longest else None, b == longest)
            for b in budgets
        ]
        areas.sort(key=lambda metric: metric.table is None)
        found += [areas[0], *(Metric(f"coverage_{b}_{over}", f"{b} {over}", "%", "high", over) for b in budgets)]
        found += areas[1:]
    return (*found, replace(COLLISIONS, table=OVER[0]))


def metre_budget_metrics(budgets: tuple[int, ...]) -> tuple[Metric, ...]:
    """Return the metrics of ``CoverageAtBudgets`` over metres alone; tables are sorted by the area to the longest."""
    area = Metric(f"area_{budgets[-1]}_metres", f"area, {budgets[-1]} metres", "%", "high", paired=True)
    return (area, *(Metric(f"coverage_{b}_metres", f"{b} metres", "%", "high") for b in budgets), COLLISIONS)


@dataclass(frozen=True)
class CoverageAtBudgets:
    """Coverage after a budget of steps or metres, and the area under its curve up to there, as a share."""

    budgets: tuple[int, ...]

    def __call__(self, trace: Trace) -> Values:
        """Return the values of an episode."""
        found: Values = {"collisions": float(trace.info["collisions"])}
        for over in OVER:
            at = trace.coverage_at(over, self.budgets).tolist()
            for budget, coverage in zip(self.budgets, at, strict=True):
                found[f"coverage_{budget}_{over}"] = coverage
                found[f"area_{budget}_{over}"] = trace.mean_coverage(over, budget)
        return found


SLAM: Final = (
    Metric("ate_m", "path error", "m", "low", "slam"),
    Metric("odometry_ate_m", "path error of odometry", "m", "low", "slam"),
    Metric("heading_deg", "heading error at the end, degrees", "", "low", "slam"),
    Metric("iou_seen_free", "IoU of free cells", "%", "high", "slam"),
    Metric("iou_seen_walls", "IoU of walls", "%", "high", "slam"),
)
"""The metrics of ``CoverageAndSlamErrors`` beside those of ``CoverageAtBudgets``."""


@dataclass(frozen=True)
class CoverageAndSlamErrors(CoverageAtBudgets):
    """Coverage as ``CoverageAtBudgets``, and the errors of the SLAM's path and map at the end (``envs.slam_env``)."""

    def __call__(self, trace: Trace) -> Values:
        """Return the values of an episode."""
        return {**super().__call__(trace), **trace.info["slam"]()}


def steps_to_coverage_metrics(shares: tuple[int, ...]) -> tuple[Metric, ...]:
    """Return the metrics of ``StepsToCoverage``."""
    reached = [Metric(f"reached_{share}", f"{share}% seen", "%", "high") for share in shares]
    metres = [
        Metric(f"metres_to_{share}", f"metres to {share}%", "m", "low", paired=share == shares[0]) for share in shares
    ]
    steps = [Metric(f"steps_to_{share}", f"steps to {share}%", "", "low") for share in shares]
    return (*reached, *metres, *steps, COLLISIONS)


@dataclass(frozen=True)
class StepsToCoverage:
    """Whether a coverage was reached, and after how many steps and metres; None if it was not."""

    shares: tuple[int, ...]

    def __call__(self, trace: Trace) -> Values:
        """Return the values of an episode."""
        found: Values = {"collisions": float(trace.info["collisions"])}
        for share in self.shares:
            at = trace.first(share / 100)
            found[f"reached_{share}"] = float(at is not None)
            found[f"steps_to_{share}"], found[f"metres_to_{share}"] = at or (None, None)
        return found


AVOIDANCE: Final = (
    Metric("metres_untouched", "way to the first collision", "m", "high"),
    COLLISIONS,
    Metric("untouched", "without a collision", "%", "high"),
    Metric("metres", "way", "m", "high"),
    Metric("return", "the paper's return", "", "high"),
)


def measure_avoidance(trace: Trace) -> Values:
    """Return the distance travelled to the first collision, or to the end, and what else describes an episode.

    A robot that stands or spins touches nothing, and its distance is 0.
    """
    collisions = float(trace.info["collisions"])
    return {
        "metres_untouched": trace.metres_untouched,
        "collisions": collisions,
        "untouched": float(collisions == 0),
        "metres": trace.metres[-1],
        "return": trace.reward,
    }


NAVIGATION: Final = (
    Metric("spl", "SPL", "%", "high"),
    Metric("success", "success", "%", "high"),
    Metric("metres", "way", "m", "low"),
    Metric("steps", "steps", "", "low"),
    COLLISIONS,
)


def measure_navigation(trace: Trace) -> Values:
    """Return success, success weighted by path length (Anderson et al., 2018), and the steps and metres used."""
    return {
        "spl": float(trace.info["spl"]),
        "success": float(trace.info["is_success"]),
        "metres": trace.metres[-1],
        "steps": trace.steps[-1],
        "collisions": float(trace.info["collisions"]),
    }


SOCIAL: Final = (
    *NAVIGATION[:2],
    Metric("seconds_to_goal", "time to the goal, s", "", "low"),
    Metric("personal_s", f"time within {PERSONAL_M:g} m of people, s", "", "low"),
    Metric("intimate_s", f"time within {INTIMATE_M:g} m of people, s", "", "low"),
    Metric("person_collisions", "collisions with people", "", "low"),
    *NAVIGATION[2:],
)


@dataclass(frozen=True)
class SocialNavigation:
    """Navigation among people: how long the robot was in their personal space, and how often one stopped it.

    Gaps are between the robot's and the person's circles, at the ends of steps of ``step_s`` seconds.
    """

    step_s: float

    def __call__(self, trace: Trace) -> Values:
        """Return the values of an episode; the time to the goal is None if the robot did not get there."""
        seconds = self.step_s * np.diff(np.frombuffer(trace.steps))
        gaps = np.frombuffer(trace.person_m)[1:]
        return {
            **measure_navigation(trace),
            "seconds_to_goal": float(seconds.sum()) if trace.info["is_success"] else None,
            "personal_s": float(seconds[gaps < PERSONAL_M].sum()),
            "intimate_s": float(seconds[gaps < INTIMATE_M].sum()),
            "person_collisions": float(trace.person_collisions),
        }
