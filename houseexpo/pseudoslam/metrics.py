"""Compute metrics of many episodes at once, in metres and shares, from the simulator's arrays; for tasks and infos."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.compiling import compiled_function
from houseexpo.pseudoslam.kernels.episode import COUNTS, MEASURES, POSE, READINGS, Episode, measure_pool
from houseexpo.pseudoslam.kernels.types import Rows

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


class EpisodeConstants(NamedTuple):
    """Quantities that do not change in an episode, as arrays of N that are views of one array."""

    rows: Floats
    """All following columns side by side, (N, 11)."""
    corner_m: Floats
    """(x, y) of the upper left corner of the first cell in the plan, and 0, twice (N, 6), in the layout of poses."""
    observable: Floats
    """Number of cells that coverage counts; 1 if there are none."""
    shortest_path_m: Floats
    """Length of the shortest path from the start to the goal, metres."""
    goal_m: Floats
    """The goal (N, 2), metres; NaN if there is none."""
    goal_number: Floats
    """The index of the goal's kind of room or furniture; -1 if it is a place."""

    @classmethod
    def of(cls, rows: Floats) -> EpisodeConstants:
        """Return the columns of rows (N, 11), as views of them."""
        return cls(rows, rows[:, :6], rows[:, 6], rows[:, 7], rows[:, 8:10], rows[:, 10])

    def __reduce__(self) -> tuple[Callable[[Floats], EpisodeConstants], tuple[Floats]]:
        """Pickle and copy the rows; the columns of the copy are views of its own rows."""
        return EpisodeConstants.of, (self.rows,)


class Metrics(NamedTuple):
    """The metrics of episodes, as arrays of N."""

    constants: EpisodeConstants
    rows: Rows
    """(N,) ``kernels.measures.MEASURES``."""
    poses: Floats
    """The pose and the believed pose (N, 6)."""
    config: SimulatorConfig
    cell_m: float
    """Side of a cell, metres."""

    @classmethod
    def of(cls, constants: EpisodeConstants, pool: Episode, config: SimulatorConfig) -> Metrics:
        """Return the metrics of the episodes of a pool; later steps change nothing in them but ``constants``."""
        number, cell_m = len(pool.counts), 1.0 / config.pixels_per_metre
        rows = np.frombuffer(bytearray(number * MEASURES.itemsize), MEASURES)  # a third of the time of np.empty
        poses = np.empty((number, 6))
        _compiled_measures()(
            pool.counts, pool.readings, pool.pose, constants.rows, cell_m, cell_m**2, config.max_steps, rows, poses
        )
        return cls(constants, rows, poses, config, cell_m)

    @property
    def counts(self) -> Rows:
        """The counts (N,), records with the names of ``kernels.episode.COUNTS``."""
        return self.rows

    @property
    def readings(self) -> Rows:
        """The readings (N,), records with the names of ``kernels.episode.READINGS``."""
        return self.rows

    @property
    def pose_px(self) -> Floats:
        """The pose and the believed pose (N, 6), ``kernels.episode.POSE``, side by side."""
        return np.stack([self.rows[name] for name in POSE.names or ()], axis=1)

    @property
    def explored_m2(self) -> Floats:
        """The known area (N,), m2."""
        found: Floats = self.rows["explored_m2"]
        return found

    @property
    def coverage(self) -> Floats:
        """The known share of the observable cells (N,), 0 to 1."""
        found: Floats = self.rows["coverage"]
        return found

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
        found: Bools = self.rows["collided"]
        return found

    def truncated(self) -> Bools:
        """Whether the episode has reached its time limit."""
        found: Bools = self.rows["truncated"].copy()
        return found

    def area_since(self, before: Metrics) -> Floats:
        """Return the area that has become known since ``before`` (N,), m2."""
        area: Floats = (self.rows["known"] - before.rows["known"]) * _cell_area_m2(self.config.pixels_per_metre)
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
        row, cell_m = self.rows, self.cell_m
        right = row["seen_x"] * cell_m - row["start_x"] * cell_m
        up = row["seen_y"] * -cell_m - row["start_y"] * -cell_m
        return np.stack([right, up, row["seen_heading"]], axis=1)

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


@cache
def _compiled_measures() -> Callable[..., None]:
    """Return ``measure_pool`` for the arrays that it is always given."""
    pool = np.zeros((1, 1), COUNTS), np.zeros((1, 1), READINGS), np.zeros((1, 1), POSE)
    into = np.empty(1, MEASURES), np.empty((1, 6))
    return compiled_function(measure_pool, *pool, np.zeros((1, 11)), 1.0, 1.0, 1, *into)


@lru_cache(maxsize=16)
def _cell_area_m2(pixels_per_metre: float) -> Floats:
    """Return the area of a cell (1,), m2, as an array, since products with numbers take three times as long."""
    return np.array([(1.0 / pixels_per_metre) ** 2])
