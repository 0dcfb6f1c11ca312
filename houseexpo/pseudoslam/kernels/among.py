"""A step among people and other things that move; apart from ``step``, for it takes as long again to compile."""

from __future__ import annotations

from numba import njit

from houseexpo.pseudoslam.kernels.bodies import Disc
from houseexpo.pseudoslam.kernels.dynamics import advance
from houseexpo.pseudoslam.kernels.step import (
    KEY,
    PEOPLE,
    STEPS,
    Episode,
    Rules,
    Views,
    X,
    Y,
    key_of,
    look,
    steps,
)
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Scratch


@njit(cache=True, nogil=True)
def transitions_among(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, rules: Rules, views: Views, scratch: Scratch,
    crew: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``step.transitions`` does, after all else has moved; in an episode that has just begun nothing has."""
    steps(pool, sizes, motions, wanted, rules, views, scratch, crew, epoch, thread, _advance, look, True)


@njit(inline="always")
def _advance(episode: Episode, rules: Rules) -> None:
    """Move people and what is on a trajectory, once the episode has begun."""
    if episode.counts[STEPS] >= 0:
        robot = Disc(episode.pose[X], episode.pose[Y], rules.robot.radius_px)
        advance(
            episode.solid, episode.bodies, episode.tracks, episode.flow, rules.walk,
            key_of(episode.counts[KEY], PEOPLE), robot, rules.seconds,
        )  # fmt: skip
