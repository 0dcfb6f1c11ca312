"""A batched step as one writes it first: every sample of every ray, every pixel of the crop, one after the other.

Its maps are those of the ``rays`` scan, cell by cell.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.collision import free_way
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams, episode_of
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid


@njit
def steps(pool: Episode, sizes: Counts, motions: Floats, params: StepParams) -> None:
    """Turn, go, scan, crop: one environment after the other."""
    for i in range(len(sizes)):
        episode = episode_of(pool, sizes, i)
        pose, sensor = episode.pose, params.sensor
        pose.heading += motions[i, 0]
        if pose.heading > math.pi:
            pose.heading -= 2.0 * math.pi
        right, down = math.cos(pose.heading), -math.sin(pose.heading)
        way = motions[i, 1]
        if way > 0:
            way = free_way(episode.occupied, pose.x, pose.y, right, down, way, params.robot.radius_px)
        episode.counts.blocked = 1 if way < motions[i, 1] else 0
        pose.x += way * right
        pose.y += way * down
        scan(episode, sensor.fan_cos, sensor.fan_sin, sensor.range_px)
        crop(episode.known, pose.x, pose.y, pose.heading, episode.shown)


@njit
def scan(episode: Episode, fan_cos: Floats, fan_sin: Floats, range_px: float) -> None:
    """Follow each ray by unit pixels up to the first obstacle, and draw it."""
    occupied, observable, known = episode.occupied, episode.observable, episode.known
    pose, counts = episode.pose, episode.counts
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    for i in range(len(fan_cos)):
        right, up = fan_cos[i] * cos - fan_sin[i] * sin, fan_sin[i] * cos + fan_cos[i] * sin
        for k in range(int(np.rint(range_px)) + 1):
            row, col = int(np.rint(pose.y - 0.5 - k * up)), int(np.rint(pose.x - 0.5 + k * right))
            if not (0 <= row < occupied.shape[0] and 0 <= col < occupied.shape[1]):
                break
            if known[row, col] == UNKNOWN:
                counts.known += 1
                counts.covered += observable[row, col]
            if occupied[row, col] != 0:
                known[row, col] = OBSTACLE
                break
            known[row, col] = FREE


@njit
def crop(known: Grid, x: float, y: float, heading: float, out: npt.NDArray[np.uint8]) -> None:
    """Take the nearest cell for each pixel of the view."""
    side = len(out)
    cos, sin = math.cos(heading), math.sin(heading)
    for i in range(side):
        for j in range(side):
            ahead, right = (side - 1) / 2 - i, j - (side - 1) / 2
            row, col = math.floor(y - ahead * sin + right * cos), math.floor(x + ahead * cos + right * sin)
            inside = 0 <= row < known.shape[0] and 0 <= col < known.shape[1]
            out[i, j] = known[row, col] if inside else UNKNOWN
