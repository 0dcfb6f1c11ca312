"""Draw the map round the robot near and far, the whole map, and pictures that mark the robot and the goal."""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN, crop_view, draw_coarse_view, draw_disc
from houseexpo.pseudoslam.kernels.step import SKIP
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Rows, as_int64

NEAR, FAR, WHOLE, ROBOT, GOAL = range(5)
"""The pictures of one environment, of which the first, the first four, or all are drawn."""


class PictureScales(NamedTuple):
    """The side of a pixel of each picture, and the radii of the marks, in cells."""

    near_px: float
    far_px: float
    whole_px: float
    robot_px: float
    goal_px: float


@njit(cache=True, nogil=True)
def draw_pictures(
    pool: Episode, sizes: Counts, goals: Floats, wanted: Grid, scales: PictureScales, out: Grid, first: int, end: int
) -> None:
    """Draw the pictures of environments ``first`` to ``end``, excluded, except for those with nothing ``wanted``.

    Near and far maps are centred on the believed pose, with the heading up. The whole map is centred on the start, with
    the plan's y up; the marks of the robot and the goal are pictures of the same area.

    Parameters
    ----------
    pool, sizes, wanted
        Arguments as in ``step``.
    goals
        (N, 2), cells across and down.
    out
        (N, pictures, side, side).
    """
    for i in range(first, end):
        if wanted[i] == SKIP:
            continue
        rows, cols = sizes[i, 0], sizes[i, 1]
        known = pool.known[i, : rows * cols].reshape((rows, cols))
        pose, pictures = pool.pose[i, 0], out[i]
        cos, sin = math.cos(pose.seen_heading), math.sin(pose.seen_heading)
        if scales.near_px == 1.0:
            crop_view(known, pose.seen_x, pose.seen_y, pose.seen_heading, pictures[NEAR])
        else:
            draw_coarse_view(known, pose.seen_x, pose.seen_y, cos, sin, scales.near_px, pictures[NEAR])
        if len(pictures) > FAR:
            draw_coarse_view(known, pose.seen_x, pose.seen_y, cos, sin, scales.far_px, pictures[FAR])
            _draw_whole(known, pose, pool.readings[i, 0], goals[i], scales, pictures)


@njit(cache=True, nogil=True)
def _draw_whole(known: Grid, pose: Rows, start: Rows, goal: Floats, scales: PictureScales, pictures: Grid) -> None:
    """Draw the whole map, the robot as a disc with a fainter one in front of it, and the goal if it is observed."""
    pixel, middle = scales.whole_px, pictures.shape[1] / 2
    draw_coarse_view(known, start.start_x, start.start_y, 0.0, 1.0, pixel, pictures[WHOLE])
    x, y = (pose.seen_x - start.start_x) / pixel + middle, (pose.seen_y - start.start_y) / pixel + middle
    radius = max(scales.robot_px / pixel, 1.0)
    ahead_x, ahead_y = math.cos(pose.seen_heading) * 2.0 * radius, -math.sin(pose.seen_heading) * 2.0 * radius
    pictures[ROBOT] = UNKNOWN
    draw_disc(pictures[ROBOT], x + ahead_x, y + ahead_y, radius, as_int64(FREE))
    draw_disc(pictures[ROBOT], x, y, radius, as_int64(OBSTACLE))
    if len(pictures) > GOAL:
        x, y = (goal[0] - start.start_x) / pixel + middle, (goal[1] - start.start_y) / pixel + middle
        pictures[GOAL] = UNKNOWN
        draw_disc(pictures[GOAL], x, y, max(scales.goal_px / pixel, 1.0), as_int64(OBSTACLE))
