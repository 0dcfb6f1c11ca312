"""What episodes have come to, for many of them at once: from arrays to metres and shares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.step import COVERED, KNOWN, START_X, STEPS

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


class Facts(NamedTuple):
    """What does not change in an episode; arrays of N."""

    corner_m: Floats
    """(N, 2) the plan's (x, y) of the upper left corner of the first cell."""
    countable: Ints
    """Cells that coverage counts."""
    goal_m: Floats
    """(N, 2), not a number where there is none."""
    best_way_m: Floats
    """The way from the start to the goal."""


class Measures(NamedTuple):
    """What an episode has come to; arrays of N."""

    facts: Facts
    counts: Ints
    """(N, 7), see ``kernels.step``."""
    readings: Floats
    """(N, 3), see ``kernels.step``."""
    pose_px: Floats
    """(N, 6), see ``kernels.step``."""
    config: SimulatorConfig

    @property
    def cell_m(self) -> float:
        """Side of a cell."""
        return 1.0 / self.config.pixels_per_metre

    def pose(self) -> Floats:
        """Return (N, 3): x, y in the plan's metres, heading in radians."""
        return self._in_metres(self.pose_px[:, :3])

    def believed_pose(self) -> Floats:
        """Return (N, 3): where odometry has the robot, as ``pose`` does."""
        return self._in_metres(self.pose_px[:, 3:])

    def _in_metres(self, pose_px: Floats) -> Floats:
        found = pose_px * (self.cell_m, -self.cell_m, 1.0)
        found[:, :2] += self.facts.corner_m
        return found

    def since_start(self) -> Floats:
        """Return (N, 3) the believed pose: x, y in metres from where the episode started, heading in radians."""
        found = self.pose_px[:, 3:] * (self.cell_m, -self.cell_m, 1.0)
        found[:, :2] -= self.readings[:, START_X:] * (self.cell_m, -self.cell_m)
        return found

    def goal_ahead(self) -> Floats:
        """Return (N, 2) the goal as the robot sees it from where it believes to be: metres ahead and to the left."""
        x, y, heading = self.believed_pose().T
        right, up = self.facts.goal_m[:, 0] - x, self.facts.goal_m[:, 1] - y
        cos, sin = np.cos(heading), np.sin(heading)
        return np.stack([right * cos + up * sin, up * cos - right * sin], axis=1)

    def explored_m2(self) -> Floats:
        """Return the area that is known."""
        return np.multiply(self.counts[:, KNOWN], self.cell_m**2, dtype=np.float64)

    def coverage(self) -> Floats:
        """Return the share of what can be seen that is known, 0 to 1."""
        return np.divide(self.counts[:, COVERED], np.maximum(self.facts.countable, 1))

    def truncated(self) -> Bools:
        """Return where time is up."""
        return self.counts[:, STEPS] >= self.config.max_steps
