"""Slow, obvious twins of the simulator's kernels, and of the published simulator's rule."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.worlds.world import new_scan_buffers

Cells = set[tuple[int, int]]
Floats = npt.NDArray[np.float64]
UNASKED = np.zeros(0, np.uint8)
"""For kernels that mark what they change: nobody asks."""


def slow_rays(
    solid: np.ndarray, x: float, y: float, heading: float, fov: float, resolution: float, range_px: float
) -> tuple[Cells, Cells]:
    """The published simulator's scan: free cells and obstacles, angles in radians."""
    k = np.arange(round(range_px) + 1)
    free, hit = set(), set()
    for angle in heading + np.arange(-fov * 0.5, fov * 0.5, step=resolution):
        row = np.round(y - 0.5 - np.sin(angle) * k).astype(int)
        col = np.round(x - 0.5 + np.cos(angle) * k).astype(int)
        on_grid = (row >= 0) & (row < solid.shape[0]) & (col >= 0) & (col < solid.shape[1])
        row, col = row[on_grid], col[on_grid]  # a ray that leaves the grid does not come back
        ends = np.flatnonzero(solid[row, col])
        seen = int(ends[0]) if len(ends) else len(row)
        free |= set(zip(row[:seen].tolist(), col[:seen].tolist(), strict=True))
        if 0 < seen < len(row):
            hit.add((int(row[seen]), int(col[seen])))
    return free, hit


def slow_sector(
    solid: np.ndarray, x: float, y: float, heading: float, half_fov: float, range_px: float
) -> tuple[Cells, Cells]:
    """Free cells whose centre is in sight, and the obstacles that some line of sight meets first.

    A line may graze a corner, but not squeeze through where nothing beside it gets through: so what counts is a line a
    hair to the left of the centre, or to the right.
    """
    if solid[int(y), int(x)]:
        return set(), set()
    rows, cols = np.nonzero(solid)
    near = np.hypot(cols + 0.5 - x, rows + 0.5 - y) <= range_px + 2
    rows, cols = rows[near], cols[near]
    boxes = np.stack([cols - x, rows - y, cols + 1 - x, rows + 1 - y], axis=1)
    free = {(int(y), int(x))}
    for row, col in np.argwhere(solid == 0).tolist():
        across, down = col + 0.5 - x, row + 0.5 - y
        distance = math.hypot(across, down)
        if not 0 < distance <= range_px:
            continue
        angle = math.atan2(-down, across)
        beside = [a for a in (angle - 1e-7, angle + 1e-7) if abs(_turned(a - heading)) <= half_fov]
        if any(first_hit(boxes, math.cos(a), -math.sin(a))[1] >= distance for a in beside):
            free.add((row, col))
    corners = [math.atan2(-down, across) for a, b, c, d in boxes for across in (a, c) for down in (b, d)]
    inside = {turned for angle in corners if abs(turned := _turned(angle - heading)) < half_fov}
    bounds = np.array(sorted({-half_fov, half_fov} | inside))
    hit = set()
    for low, high in itertools.pairwise(bounds):
        if high - low > 1e-7:
            angle = heading + (low + high) / 2
            k, _ = first_hit(boxes, math.cos(angle), -math.sin(angle))
            if k >= 0 and math.hypot(cols[k] + 0.5 - x, rows[k] + 0.5 - y) <= range_px:
                hit.add((int(rows[k]), int(cols[k])))
    return free, hit


def first_hit(boxes: Floats, right: float, down: float) -> tuple[int, float]:
    """Which of the boxes (n, 4) a ray from the origin enters first, and where; -1 and infinity where none."""
    with np.errstate(divide="ignore"):
        by = 1.0 / np.array([right, down])
    with np.errstate(invalid="ignore"):
        ends = np.sort(np.stack([boxes[:, :2] * by, boxes[:, 2:] * by]), axis=0)
    enter, leave = ends[0].max(axis=1), ends[1].min(axis=1)
    enter = np.where((enter < leave) & (leave > 0), enter, np.inf)
    if not len(enter) or not np.isfinite(enter).any():
        return -1, math.inf
    k = int(enter.argmin())
    return k, float(enter[k])


def slow_crop(known: np.ndarray, x: float, y: float, heading: float, side: int) -> np.ndarray:
    """The square of the map round a position, heading up, by the nearest cell; off the map it is unknown."""
    down, across = _places(x, y, heading, side)
    row, col = np.floor(down).astype(int), np.floor(across).astype(int)
    inside = (row >= 0) & (row < known.shape[0]) & (col >= 0) & (col < known.shape[1])
    return np.where(inside, known[np.where(inside, row, 0), np.where(inside, col, 0)], 0)


def crop_ties(x: float, y: float, heading: float, side: int) -> np.ndarray:
    """Where in such a square a place lies so near to a border of cells (1e-4) that either side will do."""
    down, across = _places(x, y, heading, side)
    return np.minimum(np.abs(down - np.round(down)), np.abs(across - np.round(across))) < 1e-4


def _places(x: float, y: float, heading: float, side: int) -> tuple[Floats, Floats]:
    i, j = np.mgrid[:side, :side]
    ahead, right = (side - 1) / 2 - i, j - (side - 1) / 2
    down = y - ahead * math.sin(heading) + right * math.cos(heading)
    return down, x + ahead * math.cos(heading) + right * math.sin(heading)


def _turned(angle: float) -> float:
    return math.atan2(math.sin(angle), math.cos(angle))


# What can be seen, found the slow and obvious way.


def slow_visible(occupied: np.ndarray, traversable: np.ndarray, range_px: float) -> np.ndarray:
    """A look all round from the middle of every standing cell."""
    seen = np.zeros(occupied.size, np.uint8)
    runs, hit, slopes = new_scan_buffers(range_px)
    for row, col in np.argwhere(traversable).tolist():
        n_runs, _ = sector_scan(occupied, col + 0.5, row + 0.5, 0.0, math.pi, range_px, runs, hit, slopes)
        for first, last in runs[:n_runs].tolist():
            seen[first : last + 1] = 1
    return seen.reshape(occupied.shape)


# The published simulator's rule, slowly and in the open: what to keep of it, with poses in our pixels.
#
# Its cells' centres lie at whole numbers, ours half a cell further. Its map holds -101, 0 and 100 for unknown, free and
# obstacle.


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
