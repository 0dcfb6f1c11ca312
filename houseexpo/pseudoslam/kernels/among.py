"""A step among people and other things that move; apart from ``step``, for it takes as long again to compile."""

from __future__ import annotations

from numba import njit

from houseexpo.pseudoslam.kernels.bodies import Disc
from houseexpo.pseudoslam.kernels.crew import COPY, done, enter, leave, take
from houseexpo.pseudoslam.kernels.dynamics import advance
from houseexpo.pseudoslam.kernels.step import (
    KEY,
    PEOPLE,
    STEPS,
    Copies,
    Episode,
    Rules,
    X,
    Y,
    episode_of,
    keep,
    key_of,
    look,
    step,
)
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Scratch


@njit(cache=True, nogil=True)
def transitions_among(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, rules: Rules, copies: Copies, scratch: Scratch,
    crew: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``step.transitions`` does, after all else has moved; in an episode that has just begun nothing has."""
    enter(crew, thread)
    while True:
        i = take(crew, epoch, thread)
        if i < 0:
            break
        if wanted[i] != 0:
            episode = episode_of(pool, sizes, i)
            if episode.counts[STEPS] >= 0:
                robot = Disc(episode.pose[X], episode.pose[Y], rules.robot.radius_px)
                advance(
                    episode.solid, episode.bodies, episode.tracks, episode.flow, rules.walk,
                    key_of(episode.counts[KEY], PEOPLE), robot, rules.seconds,
                )  # fmt: skip
            step(episode, motions[i, 0], motions[i, 1], rules, scratch, look, True)
            keep(pool, copies, crew[COPY], i)
        done(crew)
    leave(crew, thread)
