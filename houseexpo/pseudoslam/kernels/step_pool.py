"""Steps of some of the environments of a pool, one after the other; ``step`` defines a step.

Four kernels take the same step: scanning a sector, scanning along rays, in full (noise, ranges, overview), and with
people. They need different code, so that each is compiled only when it is used. A single environment is a pool of one.
Threads share a pool: each calls the kernel for its own environments, with its own working memory.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from numba import njit

from houseexpo.pseudoslam.kernels.episode import Episode, StepParams, episode_of
from houseexpo.pseudoslam.kernels.look import look, look_along_rays, look_at_sector
from houseexpo.pseudoslam.kernels.step import Look, Move, move_people, show, stand_still, step
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Scratch

Act: TypeAlias = Callable[[Episode, Floats, StepParams, Scratch, Move, Look, bool], None]
"""A function that takes an action in one environment: a step, or a planner's action."""

SKIP, STEP, REDRAW = range(3)
"""What is ``wanted`` of an environment: nothing, a step, or redrawing its view."""


@njit(cache=True, nogil=True)
def steps_by_sector(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Step environments that scan sectors without noise, and draw their views; the other kernels are like this one.

    Parameters
    ----------
    pool
        N episodes.
    sizes
        (N, 2), rows and columns of each one's rasters.
    motions
        (N, 2), turn and distance forward, radians and pixels.
    wanted
        (N,), ``STEP`` to take a step, ``REDRAW`` only to redraw the view, ``SKIP`` for neither.
    scratch
        Working memory that no other thread uses.
    first, end
        Environments ``first`` to ``end``, excluded.
    """
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, stand_still, look_at_sector, False)


@njit(cache=True, nogil=True)
def steps_by_rays(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Step environments that scan along rays without noise."""
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, stand_still, look_along_rays, False)


@njit(cache=True, nogil=True)
def steps_in_full(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Step environments with the scans and the noise of the parameters, and draw ranges and an overview if observed."""
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, stand_still, look, True)


@njit(cache=True, nogil=True)
def steps_with_people(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Do the same as ``steps_in_full`` after people and bodies on trajectories have moved."""
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, move_people, look, True)


@njit(inline="always")
def act_in_each(
    pool: Episode, sizes: Counts, actions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int, act: Act, move: Move, look: Look, full: bool,
) -> None:  # fmt: skip
    """Act in those environments ``first`` to ``end`` that want it, and draw their views and those to be redrawn.

    Parameters
    ----------
    act
        A function that takes one environment's action, ``actions[i]``.
    move, look, full
        Arguments of ``step``.
    """
    for i in range(first, end):
        if wanted[i] == SKIP:
            continue
        episode = episode_of(pool, sizes, i)
        if wanted[i] == STEP:
            act(episode, actions[i], params, scratch, move, look, full)
        show(episode)


@njit(inline="always")
def _step(
    episode: Episode, motion: Floats, params: StepParams, scratch: Scratch, move: Move, look: Look, full: bool
) -> None:
    step(episode, motion[0], motion[1], params, scratch, move, look, full)
