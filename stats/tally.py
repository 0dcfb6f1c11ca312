"""Distributions of one number that add up exactly: whole counts of whole steps, so that no order of adding matters."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any


class Tally:
    """Counts how often a number falls on each multiple of ``step``; ``bin_width`` is a whole number of steps."""

    def __init__(self, step: float = 1.0, bin_width: float = 1.0) -> None:
        self._step = step
        self._per_bin = max(round(bin_width / step), 1)
        self._counts: Counter[int] = Counter()

    def add(self, value: float) -> None:
        """Take in one number, rounded to the nearest step."""
        self._counts[round(value / self._step)] += 1

    def merge(self, other: Tally) -> None:
        """Take in the numbers of another tally with the same step."""
        self._counts.update(other._counts)

    def report(self) -> dict[str, Any]:
        """Return count, mean, median, min, max and a histogram: lower end of a bin -> how many, empty bins left out."""
        count = self._counts.total()
        if not count:
            return {"count": 0}
        steps = sorted(self._counts)
        total = sum(value * n for value, n in self._counts.items())
        bins: Counter[int] = Counter()
        for value, n in self._counts.items():
            bins[math.floor(value / self._per_bin)] += n
        return {
            "count": count,
            "mean": round(total * self._step / count, 4),
            "median": self._in_units((self._at((count - 1) // 2) + self._at(count // 2)) / 2),
            "min": self._in_units(steps[0]),
            "max": self._in_units(steps[-1]),
            "histogram": {f"{self._in_units(b * self._per_bin):g}": bins[b] for b in sorted(bins)},
        }

    def _at(self, rank: int) -> int:
        """Return the number of that rank (0 is the least)."""
        for value in sorted(self._counts):
            rank -= self._counts[value]
            if rank < 0:
                return value
        raise IndexError(rank)

    def _in_units(self, steps: float) -> float:
        return round(steps * self._step, 6)
