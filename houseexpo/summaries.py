"""What a data set's ``stats.json`` is made of: summaries that other packages bring, found through entry points."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any, Protocol

from houseexpo.floorplan import FloorPlan

GROUP = "houseexpo.summaries"
"""Entry points of this group make an empty summary; their names are keys of ``stats.json``."""


class Summary(Protocol):
    """Takes plans one at a time and says what they are like together; two of them add up."""

    def add(self, plan: FloorPlan) -> None:
        """Take one plan in."""

    def merge(self, other: Any) -> None:
        """Take in what another summary of the same kind has seen."""

    def report(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; the order in which plans came leaves no trace in them."""
        ...


def new_summaries() -> dict[str, Summary]:
    """Return an empty summary from each entry point, by name."""
    return {entry.name: entry.load()() for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name)}
