"""Draw the map round the robot near and far, the whole map, and pictures that mark the robot and the goal."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.episode import BY_PICTURES, Blocks, forget_changes
from houseexpo.pseudoslam.kernels.mapping import (
    FREE,
    OBSTACLE,
    UNKNOWN,
    crop_view,
    draw_disc,
    draw_nearest_cells,
    max_of_blocks,
    side_of_block,
)
from houseexpo.pseudoslam.kernels.planning.goal_paths import GOAL_CELL
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
    maps: Grid, sizes: Counts, poses: Rows, readings: Rows, changes: Counts, blocks: Blocks, goals: Floats,
    wanted: Grid, scales: PictureScales, out: Grid, first: int, end: int,
) -> None:  # fmt: skip
    """Draw the pictures of environments ``first`` to ``end``, excluded, except for those with nothing ``wanted``.

    Near and far maps are centred on the believed pose, with the heading up. The whole map is centred on the start, with
    the plan's y up; the marks of the robot and the goal are pictures of the same area.

    Parameters
    ----------
    maps, poses, readings, changes, blocks
        ``known``, ``pose``, ``readings``, ``changed`` and ``blocks`` of a pool of N episodes.
    sizes
        (N, 2), rows and columns of each one's map.
    goals
        (N, 2), cells across and down.
    wanted
        (N,), as in ``step``.
    out
        (N, pictures, side, side).
    """
    for i in range(first, end):
        if wanted[i] == SKIP:
            continue
        rows, cols = sizes[i, 0], sizes[i, 1]
        known = maps[i, : rows * cols].reshape((rows, cols))
        pose, pictures, changed = poses[i, 0], out[i], changes[i, BY_PICTURES]
        cos, sin = math.cos(pose.seen_heading), math.sin(pose.seen_heading)
        if scales.near_px == 1.0:
            crop_view(known, pose.seen_x, pose.seen_y, pose.seen_heading, pictures[NEAR])
        else:
            _draw(known, blocks.near[i], changed, pose.seen_x, pose.seen_y, cos, sin, scales.near_px, pictures[NEAR])
        if len(pictures) > FAR:
            _draw(known, blocks.far[i], changed, pose.seen_x, pose.seen_y, cos, sin, scales.far_px, pictures[FAR])
            _draw_whole(known, blocks.whole[i], changed, pose, readings[i, 0], goals[i], scales, pictures)
        forget_changes(changed)


@njit(cache=True, nogil=True)
def _draw(
    known: Grid, blocks: Grid, changed: Counts, x: float, y: float, cos: float, sin: float, pixel: float, out: Grid
) -> None:
    """Draw the same as ``draw_coarse_view`` from blocks that are kept, after those of cells that have changed."""
    size, (rows, cols) = side_of_block(pixel), known.shape
    if size == 1:
        draw_nearest_cells(known, x, y, cos, sin, pixel, out)
        return
    high, wide = (rows + size - 1) // size, (cols + size - 1) // size
    coarse = blocks[: high * wide].reshape((high, wide))
    max_of_blocks(known, size, changed, coarse)
    draw_nearest_cells(coarse, x / size, y / size, cos, sin, pixel / size, out)


@njit(cache=True, nogil=True)
def _draw_whole(
    known: Grid, blocks: Grid, changed: Counts, pose: Rows, start: Rows, goal: Floats, scales: PictureScales,
    pictures: Grid,
) -> None:  # fmt: skip
    """Draw the whole map, the robot as a disc with a fainter one in front of it, and the goal if it is observed."""
    pixel, middle = scales.whole_px, pictures.shape[1] / 2
    _draw(known, blocks, changed, start.start_x, start.start_y, 0.0, 1.0, pixel, pictures[WHOLE])
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


@njit(cache=True, nogil=True)
def draw_goal_views(known: Grid, standing: Grid, sizes: Counts, pose: Rows, pixel: float, out: Grid) -> None:
    """Draw the known cells of the goals' regions around the robots, headings up: 255 for such cells, 0 for others.

    Parameters
    ----------
    known, standing
        (N, cells), the maps and ``GoalPaths.standing`` of a pool.
    sizes, pose
        (N, 2) rows and columns, and (N, 1) ``POSE``.
    pixel
        The width of a pixel, cells.
    out
        (N, side, side).
    """
    seen = np.empty(out.shape[1:], np.uint8)
    for i in range(len(out)):
        rows, cols, at = sizes[i, 0], sizes[i, 1], pose[i, 0]
        cos, sin = math.cos(at.seen_heading), math.sin(at.seen_heading)
        draw_nearest_cells(known[i, : rows * cols].reshape((rows, cols)), at.seen_x, at.seen_y, cos, sin, pixel, seen)
        region = standing[i, : rows * cols].reshape((rows, cols))
        draw_nearest_cells(region, at.seen_x, at.seen_y, cos, sin, pixel, out[i])
        for row in range(len(seen)):
            for col in range(len(seen)):
                out[i, row, col] = 255 if seen[row, col] != UNKNOWN and out[i, row, col] == GOAL_CELL else 0
