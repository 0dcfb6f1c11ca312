"""The published simulator's rule, slowly and in the open: what to keep of it, with poses in our pixels.

Its cells' centres lie at whole numbers, ours half a cell further. Its map holds -101, 0 and 100 for unknown, free and
obstacle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig

UNCERTAIN, OPEN, BLOCKED = -101, 0, 100
Pose = tuple[float, float, float]


class PublishedMap:
    """What the published simulator would know of a grid (1 where an obstacle is) that it looks at."""

    def __init__(self, solid: np.ndarray, config: SimulatorConfig) -> None:
        self.world = np.where(solid != 0, BLOCKED, OPEN)
        self.known = np.full(solid.shape, UNCERTAIN)
        laser, self.ppm = config.laser, config.pixels_per_metre
        fov, resolution = math.radians(laser.fov_deg), math.radians(laser.resolution_deg)
        self.fan = np.arange(-fov * 0.5, fov * 0.5, step=resolution)[:, None]  # the last ray is missing
        self.steps = np.arange(round(laser.range_m * self.ppm) + 1)[None]  # unit pixels
        self.side = 2 * int(config.observation.size_m * self.ppm / 2)

    def look(self, pose: Pose) -> None:
        """Follow each ray to the first obstacle, inclusive."""
        x, y, heading = pose
        row = np.round(y - 0.5 - np.sin(heading + self.fan) * self.steps).astype(int)
        col = np.round(x - 0.5 + np.cos(heading + self.fan) * self.steps).astype(int)
        inside = (row >= 0) & (row < self.world.shape[0]) & (col >= 0) & (col < self.world.shape[1])
        value = self.world[np.where(inside, row, 0), np.where(inside, col, 0)]
        ends = ~inside | (value == BLOCKED)
        first = np.where(ends.any(axis=1), ends.argmax(axis=1), ends.shape[1])[:, None]
        seen = inside & (self.steps <= first)
        self.known[row[seen], col[seen]] = value[seen]

    def move(self, before: Pose, after: Pose) -> float:
        """Look on the way between two poses and at its end; return the reward: the newly known area in m2."""
        unknown = int((self.known == UNCERTAIN).sum())
        for pose in way_points(before, after, self.ppm):
            self.look(pose)
        return (unknown - int((self.known == UNCERTAIN).sum())) / self.ppm / self.ppm


def way_points(before: Pose, after: Pose, ppm: float) -> Iterator[Pose]:
    """Poses at most 10 degrees and 0.3 m apart: it turns, then goes; one at least."""
    turn = math.remainder(after[2] - before[2], 2 * math.pi)
    way = math.hypot(after[0] - before[0], after[1] - before[1])
    turns, goes = math.ceil(abs(turn) / math.radians(10) - 1e-9), math.ceil(way / (0.3 * ppm) - 1e-9)
    for k in range(1, turns + 1):
        yield before[0], before[1], before[2] + turn * k / turns
    for k in range(1, goes + 1):
        yield (
            before[0] + (after[0] - before[0]) * k / goes,
            before[1] + (after[1] - before[1]) * k / goes,
            after[2],
        )
    if turns == goes == 0:
        yield after
