"""Navigability of many plans for robots of one radius, as counts that can be merged."""

from __future__ import annotations

from typing import Any

from stats.tally import Tally


class Reach:
    """The number of plans in which a robot can reach everything, the share that it reaches, the narrowest passages."""

    def __init__(self) -> None:
        self.plans = 0
        self.connected = 0
        self.nowhere = 0
        self.largest_share = Tally(step=0.0001, bin_width=0.05)
        self.narrowest = Tally(step=0.01, bin_width=0.1)

    def take(self, components: int, largest_share: float, narrowest: float) -> None:
        """Add one plan; if the robot fits nowhere, there is no passage."""
        self.plans += 1
        self.connected += components == 1
        self.nowhere += components == 0
        self.largest_share.add(largest_share)
        if components:
            self.narrowest.add(narrowest)

    def merge(self, other: Reach) -> None:
        """Add the plans of another one."""
        self.plans += other.plans
        self.connected += other.connected
        self.nowhere += other.nowhere
        self.largest_share.merge(other.largest_share)
        self.narrowest.merge(other.narrowest)

    @property
    def connected_share(self) -> float:
        """Share of the plans in which the robot can reach every place where it fits."""
        return self.connected / self.plans if self.plans else 0.0

    def report(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "plans": self.plans,
            "connected": self.connected,
            "connected_share": round(self.connected_share, 6),
            "nowhere": self.nowhere,
            "largest_share": self.largest_share.report(),
            "narrowest": self.narrowest.report(),
        }
