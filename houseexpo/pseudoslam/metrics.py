"""What episodes have come to, for many of them at once: from arrays to metres and shares."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.kernels.types import Rows

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


class EpisodeConstants(NamedTuple):
    """What does not change in an episode; arrays of N, parts of one."""

    rows: Floats
    """(N, 10): all that follows, side by side."""
    corner_m: Floats
    """(N, 6) the plan's (x, y) of the upper left corner of the first cell, and 0: twice, as ``pose`` holds poses."""
    observable: Floats
    """Cells that coverage counts; 1 where there are none."""
    shortest_path_m: Floats
    """The way from the start to the goal."""
    goal_m: Floats
    """(N, 2), not a number where there is none."""

    @classmethod
    def of(cls, rows: Floats) -> EpisodeConstants:
        """Return the parts of rows (N, 10), as views of them."""
        return cls(rows, rows[:, :6], rows[:, 6], rows[:, 7], rows[:, 8:])

    def __reduce__(self) -> tuple[Callable[[Floats], EpisodeConstants], tuple[Floats]]:
        """Pickle and copy the rows: the parts of the copy are views of its own."""
        return EpisodeConstants.of, (self.rows,)


class Metrics(NamedTuple):
    """What episodes have come to; arrays of N."""

    constants: EpisodeConstants
    counts: Rows
    """(N,) ``kernels.episode.COUNTS``."""
    readings: Rows
    """(N,) ``kernels.episode.READINGS``."""
    pose_px: Floats
    """(N, 6): ``kernels.episode.POSE``, side by side."""
    config: SimulatorConfig
    cell_m: float
    """Side of a cell."""
    explored_m2: Floats
    """The area that is known."""
    coverage: Floats
    """The share of what can be seen that is known, 0 to 1."""
    poses: Floats
    """(N, 6): the pose and the believed one."""

    @classmethod
    def of(cls, constants: EpisodeConstants, pool: Episode, config: SimulatorConfig) -> Metrics:
        """Return what the episodes of a pool have come to; later steps do not change it, but for ``constants``."""
        counts, pose_px = pool.counts[:, 0].copy(), pool.pose.view(np.float64).copy()
        cell_m = 1.0 / config.pixels_per_metre
        poses = pose_px * _scale(config.pixels_per_metre, len(pose_px))
        poses += constants.corner_m
        explored, coverage = (
            np.multiply(counts["known"], cell_m**2),
            np.divide(counts["covered"], constants.observable),
        )
        return cls(constants, counts, pool.readings[:, 0].copy(), pose_px, config, cell_m, explored, coverage, poses)

    @property
    def pose(self) -> Floats:
        """(N, 3): x, y in the plan's metres, heading in radians."""
        return self.poses[:, :3]

    @property
    def believed_pose(self) -> Floats:
        """(N, 3): where odometry has the robot, as ``pose`` does."""
        return self.poses[:, 3:]

    @property
    def collided(self) -> Bools:
        """Where something was in the way of the last step."""
        found: Bools = self.counts["blocked"] != 0
        return found

    def truncated(self) -> Bools:
        """Return where time is up."""
        found: Bools = self.counts["steps"] >= self.config.max_steps
        return found

    def way_since(self, before: Metrics) -> Floats:
        """Return (N,) metres gone since then."""
        way: Floats = (self.readings["path_length"] - before.readings["path_length"]) * self.cell_m
        return way

    def turn_since(self, before: Metrics) -> Floats:
        """Return (N,) radians from the heading that the robot had then, 0 to pi."""
        turn: Floats = np.abs(self.pose[:, 2] - before.pose[:, 2])
        return np.minimum(turn, 2.0 * np.pi - turn)

    def since_start(self) -> Floats:
        """Return (N, 3) the believed pose: x, y in metres from where the episode started, heading in radians."""
        scale = _scale(self.config.pixels_per_metre, 1)[0, 3:]
        found: Floats = self.pose_px[:, 3:] * scale
        found[:, 0] -= self.readings["start_x"] * scale[0]
        found[:, 1] -= self.readings["start_y"] * scale[1]
        return found

    def goal_ahead(self) -> Floats:
        """Return (N, 2) the goal as the robot sees it from where it believes to be: metres ahead and to the left."""
        x, y, heading = self.believed_pose.T
        right, up = self.constants.goal_m[:, 0] - x, self.constants.goal_m[:, 1] - y
        cos, sin = np.cos(heading), np.sin(heading)
        return np.stack([right * cos + up * sin, up * cos - right * sin], axis=1)


@lru_cache(maxsize=16)
def _scale(pixels_per_metre: float, number: int) -> Floats:
    """Return (number, 6) what poses in pixels, y down, are multiplied by: as many rows as there are, for speed."""
    cell_m = 1.0 / pixels_per_metre
    return np.tile(np.array([cell_m, -cell_m, 1.0]), (number, 2))
