"""Trajectories in the form of the kernels, on the grid of a world."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config.dynamics import Trajectory
from houseexpo.pseudoslam.config.shapes import Circle, Ellipse, Shape
from houseexpo.pseudoslam.kernels.motion.bodies import HALF_DIAGONAL, MOVING, SHAPE, Tracks, pose_at
from houseexpo.pseudoslam.kernels.motion.sweep import first_hit, sweep

_CORNERS = 32  # of an ellipse, with an error of 0.5%

Floats = npt.NDArray[np.float64]
Grid = npt.NDArray[np.uint8]


def make_tracks(trajectories: Sequence[Trajectory], occupied: Grid, frame: GridFrame, plan_id: str) -> Tracks:
    """Return trajectories on the grid of a world; ``occupied`` are the static obstacles.

    Raises
    ------
    ConfigError
        A shape runs into a wall or off the grid; the error says which trajectory, when and where.
    """
    tracks = _tracks(trajectories, frame)
    for k in range(len(trajectories)):
        time, row, col = first_hit(occupied, tracks, k)
        if time >= 0.0:
            x, y = frame.points_from_pixels(pose_at(tracks, k, time)[:2]).tolist()
            at_x, at_y = frame.points_from_cells([row, col]).tolist()
            raise ConfigError(
                f"trajectories[{k}]: at {time:.2f} s, at ({x:.2f}, {y:.2f}) m, its shape meets a wall or an obstacle "
                f"at ({at_x:.2f}, {at_y:.2f}) m of plan {plan_id!r}; lead it round, or make it smaller"
            )
    return tracks


def swept_cells(tracks: Tracks, shape: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """Return the cells (rows, cols) that trajectories pass, where nothing else may be placed."""
    swept = np.zeros(shape, np.uint8)
    for k in range(len(tracks.times_s)):
        sweep(swept, tracks, k)
    found: npt.NDArray[np.bool_] = swept == MOVING
    return found


def _tracks(trajectories: Sequence[Trajectory], frame: GridFrame) -> Tracks:
    ppm = frame.pixels_per_metre
    shapes = [_corners(one.shape) for one in trajectories]
    n = len(trajectories)
    most = max((len(one.times_s) for one in trajectories), default=1)
    tracks = Tracks(
        np.zeros((n, most)),
        np.zeros((n, most, 3)),
        np.zeros((n, max((len(corners) for corners, _ in shapes), default=1), 2)),
        np.zeros(n, SHAPE),
    )
    for k, (one, (corners, round_m)) in enumerate(zip(trajectories, shapes, strict=True)):
        keys = len(one.times_s)
        poses = np.array(one.poses)
        poses[:, :2] = frame.pixels_from_points(poses[:, :2])
        poses[:, 2] = np.unwrap(np.radians(poses[:, 2]))
        tracks.times_s[k, :keys], tracks.poses[k, :keys] = one.times_s, poses
        tracks.corners[k, : len(corners)] = corners * ppm
        # a shape thinner than a cell's diagonal is enlarged to it, so that it always covers cells, and connected ones
        grown_px = round_m * ppm + max(HALF_DIAGONAL - one.shape.thickness_m * ppm / 2, 0.0)
        reach_px = float(np.hypot(*corners.T).max()) * ppm + grown_px
        core_px, fastest = max(_core(corners) * ppm + grown_px, 0.0), _fastest(one.times_s, poses, reach_px)
        tracks.shapes[k] = keys, len(corners), one.loop, grown_px, core_px, reach_px, fastest
    return tracks


def _corners(shape: Shape) -> tuple[Floats, float]:
    """Return corners (n, 2), metres ahead and to the left, and the radius around them; a circle is one corner."""
    if isinstance(shape, Circle):
        return np.zeros((1, 2)), shape.radius_m
    if isinstance(shape, Ellipse):
        angles = np.arange(_CORNERS) * (2 * math.pi / _CORNERS)
        halves = shape.width_m / 2, shape.height_m / 2
        return np.stack([halves[0] * np.cos(angles), halves[1] * np.sin(angles)], axis=1), 0.0
    return np.array(shape.outline_m, dtype=np.float64), 0.0


def _core(corners: Floats) -> float:
    """Return the radius of the largest disc around the position in a polygon; if outside, minus the distance."""
    along = np.roll(corners, -1, axis=0) - corners
    length = (along**2).sum(axis=1)
    part = np.clip(-(corners * along).sum(axis=1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    rim = float(np.hypot(*(corners + part[:, None] * along).T).min())
    inside = False
    for (x1, y1), (x2, y2) in zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True):
        if (y1 > 0) != (y2 > 0) and x1 - y1 * (x2 - x1) / (y2 - y1) > 0:
            inside = not inside
    return rim if inside else -rim


def _fastest(times_s: Sequence[float], poses: Floats, reach_px: float) -> float:
    """Return the speed of the fastest point of a body, pixels per second."""
    moved = np.diff(poses, axis=0)
    speeds = (np.hypot(moved[:, 0], moved[:, 1]) + reach_px * np.abs(moved[:, 2])) / np.diff(times_s)
    return float(speeds.max())
