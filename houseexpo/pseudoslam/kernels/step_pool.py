"""Many environments' steps: threads take them one by one from a pool, until all have been stepped and drawn.

``step`` says what a step is; ``runtime.thread_pool`` how threads share them.
"""

from __future__ import annotations

from typing import TypeAlias

from numba import njit

from houseexpo.pseudoslam.kernels.episode import Episode, StepParams, episode_of
from houseexpo.pseudoslam.kernels.look import look, look_along_rays, look_at_sector
from houseexpo.pseudoslam.kernels.runtime.thread_pool import MAX_ENVS, VIEWS, done, enter, leave, puts_off, take
from houseexpo.pseudoslam.kernels.step import Look, Move, move_people, show, stand_still, step
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Scratch

SKIP, STEP, REDRAW = range(3)
"""What is ``wanted`` of an environment: nothing, a step, or to be shown again what it knows."""
ARRAYS = 3
"""Arrays for views beside the pool's: the caller of a batch holds one or two, one is written."""
ViewBuffers: TypeAlias = tuple[Grid, ...]


@njit(cache=True, nogil=True)
def transitions(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Step environments as ``step.step_episode`` does one; the other kernels here do as its others.

    Parameters
    ----------
    pool
        N episodes.
    sizes
        (N, 2) rows and columns of each one's rasters.
    motions
        (N, 2) turn and way forward, radians and pixels.
    wanted
        (N,) ``STEP`` where an environment steps, ``REDRAW`` where it is only shown again, ``SKIP`` where neither.
    views
        Arrays (N, side, side), of which ``sync`` names one, or none: what robots are shown is drawn there, not in the
        pool.
    crew, epoch, thread
        What threads share, see ``sync``. Thread 0 begins a step and returns when it is done, but for views that it puts
        off; others take part in steps until none has come for a while. All have ``scratch`` of their own.
    """
    steps(pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, stand_still, look_at_sector, False)


@njit(cache=True, nogil=True)
def transitions_by_rays(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``transitions`` does, looking along rays."""
    steps(
        pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, stand_still, look_along_rays, False
    )


@njit(cache=True, nogil=True)
def transitions_in_full(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``transitions`` does, as the rules say: with errors, and ranges and an overview where there is room."""
    steps(pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, stand_still, look, True)


@njit(inline="always")
def steps(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int, move: Move, look: Look, full: bool,
) -> None:  # fmt: skip
    """Take environments, step them and draw their views, until there are no more."""
    enter(sync, thread)
    while True:
        taken = take(sync, epoch, thread)
        if taken < 0:
            break
        i, is_moved = taken & MAX_ENVS, taken <= MAX_ENVS
        if wanted[i] != SKIP:
            episode = episode_of(pool, sizes, i)
            if is_moved and wanted[i] == STEP:
                step(episode, motions[i, 0], motions[i, 1], params, scratch, move, look, full)
            if not (is_moved and puts_off(sync, i)):
                view = sync[VIEWS]
                show(episode, views[view][i] if view >= 0 else episode.shown)
        done(sync, taken)
    leave(sync, thread)


@njit(cache=True, nogil=True)
def transitions_with_people(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, views: ViewBuffers,
    scratch: Scratch, sync: Counts, epoch: int, thread: int,
) -> None:  # fmt: skip
    """Do as ``transitions_in_full`` does, after people and what is on a trajectory have moved."""
    steps(pool, sizes, motions, wanted, params, views, scratch, sync, epoch, thread, move_people, look, True)
