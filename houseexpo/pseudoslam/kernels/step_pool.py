"""Steps of some of the environments of a pool, one after the other; ``step`` says what a step is.

Four kernels take the same step: looking at a sector, along rays, or in full (errors, ranges, overview), and among
people. They differ in what has to be compiled, so each is compiled when it is asked for. A single environment is a pool
of one. Threads share a pool: each calls the kernel with environments of its own, and scratch memory of its own.
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
"""Takes an action in one environment: a step, or what a planner does."""

SKIP, STEP, REDRAW = range(3)
"""What is ``wanted`` of an environment: nothing, a step, or to be shown again what it knows."""


@njit(cache=True, nogil=True)
def steps_by_sector(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Step environments that look at sectors, without errors, and draw their views; the other kernels do as this one.

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
    scratch
        Memory that nobody else uses meanwhile.
    first, end
        Environments ``first`` to ``end``, excluded.
    """
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, stand_still, look_at_sector, False)


@njit(cache=True, nogil=True)
def steps_by_rays(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Look along rays."""
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, stand_still, look_along_rays, False)


@njit(cache=True, nogil=True)
def steps_in_full(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Look as the parameters say, with errors where they say so, and ranges and an overview where there is room."""
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, stand_still, look, True)


@njit(cache=True, nogil=True)
def steps_with_people(
    pool: Episode, sizes: Counts, motions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Do as ``steps_in_full`` does, after people and what is on a trajectory have moved."""
    act_in_each(pool, sizes, motions, wanted, params, scratch, first, end, _step, move_people, look, True)


@njit(inline="always")
def act_in_each(
    pool: Episode, sizes: Counts, actions: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int, act: Act, move: Move, look: Look, full: bool,
) -> None:  # fmt: skip
    """Act in environments ``first`` to ``end`` that want it, and draw the views of those and of who is shown again.

    Parameters
    ----------
    act
        Takes one environment's action, ``actions[i]``.
    move, look, full
        As ``step`` takes them.
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
