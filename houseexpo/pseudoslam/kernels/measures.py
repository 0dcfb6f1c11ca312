"""Measure the episodes of a pool after a step: one record each of all that rewards and infos are made of."""

from __future__ import annotations

from numba import literal_unroll, njit

from houseexpo.pseudoslam.kernels.episode import COUNTS, POSE, READINGS
from houseexpo.pseudoslam.kernels.types import Floats, Rows, make_row_dtype

_COUNTS, _READINGS, _POSE = COUNTS.names or (), READINGS.names or (), POSE.names or ()
MEASURES = make_row_dtype(
    **dict.fromkeys(_COUNTS, int), **dict.fromkeys((*_READINGS, *_POSE), float), explored_m2=float,
    coverage=float, collided=bool, truncated=bool,
)  # fmt: skip
"""The counts, the readings and the poses of an episode, and what follows: the known area, m2, the known share of the
observable cells, whether an obstacle blocked the last step, and whether the episode has reached its time limit."""


@njit(cache=True)
def measure_pool(
    counts: Rows, readings: Rows, pose: Rows, constants: Floats, cell_m: float, cell_m2: float, max_steps: int,
    out: Rows, poses: Floats,
) -> None:  # fmt: skip
    """Write the measures of N episodes.

    Parameters
    ----------
    counts, readings, pose
        (N, 1), those of the pool.
    constants
        (N, 11), ``metrics.EpisodeConstants.rows``.
    cell_m, cell_m2
        Side and area of a cell, metres and m2.
    max_steps
        The number of steps after which an episode is truncated.
    out
        (N,), receives ``MEASURES``.
    poses
        (N, 6), receives the pose and the believed pose: x, y in the plan's metres, heading in radians.
    """
    for i in range(len(out)):
        row, count, reading, at = out[i], counts[i, 0], readings[i, 0], pose[i, 0]
        for name in literal_unroll(_COUNTS):
            row[name] = count[name]
        for name in literal_unroll(_READINGS):
            row[name] = reading[name]
        for name in literal_unroll(_POSE):
            row[name] = at[name]
        row.explored_m2 = count.known * cell_m2
        row.coverage = count.covered / constants[i, 6]
        row.collided = count.blocked != 0
        row.truncated = count.steps >= max_steps
        poses[i, 0] = at.x * cell_m + constants[i, 0]
        poses[i, 1] = at.y * -cell_m + constants[i, 1]
        poses[i, 2] = at.heading + constants[i, 2]
        poses[i, 3] = at.seen_x * cell_m + constants[i, 3]
        poses[i, 4] = at.seen_y * -cell_m + constants[i, 4]
        poses[i, 5] = at.seen_heading + constants[i, 5]
