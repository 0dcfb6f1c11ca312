"""Load empty summaries of plans from other packages (entry points); a build writes their reports to ``stats.json``."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any, Protocol

from houseexpo.floorplan import FloorPlan

GROUP = "houseexpo.summaries"
"""The group of entry points that create an empty summary; their names are the keys of ``stats.json``."""


class Summary(Protocol):
    """Statistics over plans, which are added one at a time; two summaries can be merged."""

    def add(self, plan: FloorPlan) -> None:
        """Add one plan."""

    def merge(self, other: Any) -> None:
        """Add the plans of another summary of the same kind."""

    def report(self) -> dict[str, Any]:
        """Return values that can be written as JSON; they do not depend on the order of the plans."""
        ...


def new_summaries() -> dict[str, Summary]:
    """Return an empty summary from each entry point, by name."""
    return {entry.name: entry.load()() for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name)}
