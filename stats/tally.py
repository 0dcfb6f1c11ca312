"""Count a number's values in whole steps, for mean, quantiles and histogram; merging is exact and in any order."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]


class Tally:
    """Counts of numbers by multiples of ``step``; ``bin_width`` is a whole number of steps."""

    def __init__(self, step: float = 1.0, bin_width: float = 1.0) -> None:
        self.step = step
        self.bin_width = bin_width
        self._counts: Counter[int] = Counter()

    def add(self, value: float) -> None:
        """Add one number, rounded to the nearest step."""
        self._counts[round(value / self.step)] += 1

    def merge(self, other: Tally) -> None:
        """Add the numbers of another tally with the same step."""
        self._counts.update(other._counts)

    @property
    def count(self) -> int:
        """The number of numbers that were added."""
        return self._counts.total()

    def values(self) -> tuple[Numbers, Numbers]:
        """Return the distinct numbers in ascending order, and their counts; both (n,)."""
        steps = np.array(sorted(self._counts), dtype=np.int64)
        numbers = np.asarray(steps * self.step, dtype=np.float64)
        return numbers, np.array([self._counts[at] for at in steps.tolist()], dtype=np.float64)

    def moments(self) -> tuple[float, float]:
        """Return the mean and the standard deviation; the tally must not be empty."""
        count, total = self.count, self._total()
        squares = sum(at * at * n for at, n in self._counts.items())
        return total * self.step / count, math.sqrt(squares * count - total * total) * self.step / count

    def quantile(self, share: float) -> float:
        """Return the quantile of a share of the numbers as NumPy and pandas do, between the two nearest numbers."""
        steps = sorted(self._counts)
        ends = np.cumsum([self._counts[at] for at in steps])
        rank = share * (int(ends[-1]) - 1)
        low, high = (steps[int(np.searchsorted(ends, at, side="right"))] for at in (math.floor(rank), math.ceil(rank)))
        return self._in_units(low + (high - low) * (rank - math.floor(rank)))

    def report(self) -> dict[str, Any]:
        """Return plain values: count, sum, mean, deviation, 5%, median, 95%, extremes, and a histogram.

        The histogram maps the lower end of a bin to its count, without empty bins. Sums are of whole steps, so that
        they do not depend on the order.
        """
        count = self.count
        if not count:
            return {"count": 0}
        mean, std = self.moments()
        return {
            "count": count,
            "sum": self._in_units(self._total()),
            "mean": round(mean, 4),
            "std": round(std, 4),
            "p05": self.quantile(0.05),
            "median": self.quantile(0.5),
            "p95": self.quantile(0.95),
            "min": self._in_units(min(self._counts)),
            "max": self._in_units(max(self._counts)),
            "histogram": {f"{self._in_units(at):g}": n for at, n in self.bins()},
        }

    def bins(self) -> list[tuple[float, int]]:
        """Return the lower ends, in steps, and the counts of the bins that are not empty."""
        per_bin = max(round(self.bin_width / self.step), 1)
        found: Counter[int] = Counter()
        for at, n in self._counts.items():
            found[at // per_bin] += n
        return [(place * per_bin, found[place]) for place in sorted(found)]

    def _total(self) -> int:
        return sum(at * n for at, n in self._counts.items())

    def _in_units(self, steps: float) -> float:
        return round(steps * self.step, 6)
