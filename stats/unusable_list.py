"""Compare a list of unusable plans, such as a manual one, with the measured plans that are not connected."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.files import read_text
from stats.record import Record

RADIUS = "0.20"
DRAWN = 20


@dataclass(frozen=True)
class ListComparison:
    """Plans that the list, the measurement or both call bad.

    A plan is measured as bad if a robot cannot reach a place where it fits. ``both``, ``measured_only`` and
    ``listed_only`` are sorted ids.
    """

    name: str
    both: tuple[str, ...]
    measured_only: tuple[str, ...]
    listed_only: tuple[str, ...]
    unknown: int

    @property
    def precision(self) -> float:
        """Share of the plans measured as bad that are in the list."""
        return len(self.both) / max(len(self.both) + len(self.measured_only), 1)

    @property
    def recall(self) -> float:
        """Share of the list's plans that are measured as bad."""
        return len(self.both) / max(len(self.both) + len(self.listed_only), 1)

    def sample(self, seed: int = 0) -> tuple[list[str], list[str]]:
        """Return ten random plans that only the measurement calls bad, and ten that only the list does."""
        rng = np.random.default_rng(seed)
        some, other = (
            sorted(rng.choice(ids, min(DRAWN // 2, len(ids)), replace=False).tolist())
            for ids in (self.measured_only, self.listed_only)
        )
        return some, other

    def report(self) -> dict[str, Any]:
        """Return plain values."""
        measured_only, listed_only = self.sample()
        return {
            "list": self.name,
            "radius_m": float(RADIUS),
            "listed": len(self.both) + len(self.listed_only),
            "listed_without_plan": self.unknown,
            "measured": len(self.both) + len(self.measured_only),
            "both": len(self.both),
            "precision": round(self.precision, 4),
            "recall": round(self.recall, 4),
            "drawn_measured_only": measured_only,
            "drawn_listed_only": listed_only,
        }


def read_list(path: Path) -> frozenset[str]:
    """Read ids, one at the start of each line, with or without ``.json``; repeated ids count once."""
    try:
        lines = [line.split()[0] for line in read_text(path).splitlines() if line.strip()]
    except (OSError, UnicodeError) as error:
        raise ConfigError(f"{path}: expected a text file of plans' ids, one per line ({error})") from None
    if not lines:
        raise ConfigError(f"{path}: expected plans' ids, one per line, found none")
    return frozenset(line.removesuffix(".json") for line in lines)


def compare_with_list(records: Iterable[Record], listed: frozenset[str], name: str) -> ListComparison:
    """Compare a list with the plans in which a robot of 0.20 m radius cannot reach every place where it fits."""
    ids, bad = set(), set()
    for record in records:
        ids.add(record.id)
        if record.reach[RADIUS][0] != 1:
            bad.add(record.id)
    known = listed & ids
    both, measured_only, listed_only = (tuple(sorted(part)) for part in (bad & known, bad - known, known - bad))
    return ListComparison(name, both, measured_only, listed_only, len(listed) - len(known))
