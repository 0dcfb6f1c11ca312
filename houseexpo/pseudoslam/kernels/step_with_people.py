"""A step among people and other things that move; apart from ``step``, for it takes as long again to compile."""

from __future__ import annotations

from numba import njit

from houseexpo.pseudoslam.kernels.motion.bodies import Disc
from houseexpo.pseudoslam.kernels.people.advance import advance
from houseexpo.pseudoslam.kernels.step import (
    KEY,
    PEOPLE,
    STEPS,
    Episode,
    StepParams,
    ViewBuffers,
    X,
    Y,
    key_of,
    look,
    steps,
)
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Scratch


@njit(cache=True, nogil=True)
def transitions_with_people(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``step.transitions`` does, after all else has moved; in an episode that has just begun nothing has."""
    steps(pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, _advance, look, True)


@njit(inline="always")
def _advance(episode: Episode, params: StepParams) -> None:
    """Move people and what is on a trajectory, once the episode has begun."""
    if episode.counts[STEPS] >= 0:
        robot = Disc(episode.pose[X], episode.pose[Y], params.robot.radius_px)
        advance(
            episode.occupied, episode.bodies, episode.tracks, episode.flow, params.walk,
            key_of(episode.counts[KEY], PEOPLE), robot, params.seconds,
        )  # fmt: skip
