"""Record steps, metres and coverage of an episode, at the start and after each action; look up coverage at a budget."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


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

    def add(self, steps: int, metres: float, info: Mapping[str, Any], reward: float = 0.0) -> None:
        """Add a row.

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
        self.reward += reward
        if not info["collisions"]:
            self.metres_untouched = metres
        self.info = info

    def over(self, what: str) -> Floats:
        """Return the steps, or the metres, of all rows."""
        return np.frombuffer(self.steps if what == "steps" else self.metres)

    def coverage_at(self, what: str, places: npt.ArrayLike) -> Floats:
        """Return the coverage after a number of steps or metres, which is that of the last row within them."""
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
