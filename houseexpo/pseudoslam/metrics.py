"""Compute metrics of many episodes at once, in metres and shares, from the simulator's arrays; for tasks and infos."""

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
    """Quantities that do not change in an episode, as arrays of N that are views of one array."""

    rows: Floats
    """All following columns side by side, (N, 10)."""
    corner_m: Floats
    """(x, y) of the upper left corner of the first cell in the plan, and 0, twice (N, 6), in the layout of poses."""
    observable: Floats
    """Number of cells that coverage counts; 1 if there are none."""
    shortest_path_m: Floats
    """Length of the shortest path from the start to the goal, metres."""
    goal_m: Floats
    """The goal (N, 2), metres; NaN if there is none."""

    @classmethod
    def of(cls, rows: Floats) -> EpisodeConstants:
        """Return the columns of rows (N, 10), as views of them."""
        return cls(rows, rows[:, :6], rows[:, 6], rows[:, 7], rows[:, 8:])

    def __reduce__(self) -> tuple[Callable[[Floats], EpisodeConstants], tuple[Floats]]:
        """Pickle and copy the rows; the columns of the copy are views of its own rows."""
        return EpisodeConstants.of, (self.rows,)


class Metrics(NamedTuple):
    """The metrics of episodes, as arrays of N."""

    constants: EpisodeConstants
    counts: Rows
    """(N,) ``kernels.episode.COUNTS``."""
    readings: Rows
    """(N,) ``kernels.episode.READINGS``."""
    pose_px: Floats
    """(N, 6): ``kernels.episode.POSE``, side by side."""
    config: SimulatorConfig
    cell_m: float
    """Side of a cell, metres."""
    explored_m2: Floats
    """The known area, m2."""
    coverage: Floats
    """The known share of the observable cells, 0 to 1."""
    poses: Floats
    """The pose and the believed pose (N, 6)."""

    @classmethod
    def of(cls, constants: EpisodeConstants, pool: Episode, config: SimulatorConfig) -> Metrics:
        """Return the metrics of the episodes of a pool; later steps change nothing in them but ``constants``."""
        counts, pose_px = _copy_rows(pool.counts), np.frombuffer(pool.pose.tobytes()).reshape(-1, 6)
        cell_m = 1.0 / config.pixels_per_metre
        poses = pose_px * _scale(config.pixels_per_metre, len(pose_px))
        poses += constants.corner_m
        explored, coverage = counts["known"] * cell_m**2, counts["covered"] / constants.observable
        return cls(constants, counts, _copy_rows(pool.readings), pose_px, config, cell_m, explored, coverage, poses)

    def with_counts_of(self, pool: Episode) -> Metrics:
        """Return the metrics of the same episodes of a pool if only their counts have changed."""
        counts = _copy_rows(pool.counts)
        explored, coverage = counts["known"] * self.cell_m**2, counts["covered"] / self.constants.observable
        return self._replace(counts=counts, explored_m2=explored, coverage=coverage)

    def part(self, rows: slice) -> Metrics:
        """Return the metrics of some of the episodes."""
        return self._replace(
            constants=EpisodeConstants.of(self.constants.rows[rows]), counts=self.counts[rows],
            readings=self.readings[rows], pose_px=self.pose_px[rows], explored_m2=self.explored_m2[rows],
            coverage=self.coverage[rows], poses=self.poses[rows],
        )  # fmt: skip

    @property
    def pose(self) -> Floats:
        """The pose (N, 3): x, y in the plan's metres, heading in radians."""
        return self.poses[:, :3]

    @property
    def believed_pose(self) -> Floats:
        """The pose according to odometry (N, 3), in the units of ``pose``."""
        return self.poses[:, 3:]

    @property
    def collided(self) -> Bools:
        """Whether an obstacle blocked the last step."""
        found: Bools = self.counts["blocked"].astype(bool)
        return found

    def truncated(self) -> Bools:
        """Whether the episode has reached its time limit."""
        found: Bools = self.counts["steps"] >= self.config.max_steps
        return found

    def area_since(self, before: Metrics) -> Floats:
        """Return the area that has become known since ``before`` (N,), m2."""
        area: Floats = np.multiply(self.counts["known"] - before.counts["known"], self.cell_m**2)
        return area

    def way_since(self, before: Metrics) -> Floats:
        """Return the distance travelled since ``before`` (N,), metres."""
        way: Floats = (self.readings["path_length"] - before.readings["path_length"]) * self.cell_m
        return way

    def turn_since(self, before: Metrics) -> Floats:
        """Return the angle between the headings now and in ``before`` (N,), 0 to pi."""
        turn: Floats = np.abs(self.pose[:, 2] - before.pose[:, 2])
        return np.minimum(turn, 2.0 * np.pi - turn)

    def velocity(self) -> Floats:
        """Return the velocity of a drive (N, 2): m/s; and rad/s, or the steering angle in radians."""
        return np.stack([self.readings["speed"] * self.cell_m, self.readings["turning"]], axis=1)

    def since_start(self) -> Floats:
        """Return the believed pose relative to the start (N, 3): x, y in metres, heading in radians."""
        scale = _scale(self.config.pixels_per_metre, 1)[0, 3:]
        found: Floats = self.pose_px[:, 3:] * scale
        found[:, 0] -= self.readings["start_x"] * scale[0]
        found[:, 1] -= self.readings["start_y"] * scale[1]
        return found

    def start(self) -> Floats:
        """Return the place of the start (N, 2), (x, y) in the plan's metres."""
        found: Floats = self.constants.corner_m[:, :2].copy()
        found[:, 0] += self.readings["start_x"] * self.cell_m
        found[:, 1] -= self.readings["start_y"] * self.cell_m
        return found

    def goal_ahead(self) -> Floats:
        """Return the goal relative to the believed pose (N, 2): metres ahead and to the left."""
        x, y, heading = self.believed_pose.T
        right, up = self.constants.goal_m[:, 0] - x, self.constants.goal_m[:, 1] - y
        cos, sin = np.cos(heading), np.sin(heading)
        return np.stack([right * cos + up * sin, up * cos - right * sin], axis=1)


def _copy_rows(rows: Rows) -> Rows:
    """Return a read-only copy (N,) of records (N, 1), byte by byte, which is faster than record by record."""
    return np.frombuffer(rows.tobytes(), rows.dtype)


@lru_cache(maxsize=16)
def _scale(pixels_per_metre: float, number: int) -> Floats:
    """Return the factors (number, 6) for poses in pixels with y down; one row per pose, for speed."""
    cell_m = 1.0 / pixels_per_metre
    return np.tile(np.array([cell_m, -cell_m, 1.0]), (number, 2))
