"""A compiled explorer of frontiers in one house, whose steps are identical to those of ``agents.exploring``.

It is for training with many explorations. R1 to R4 are the explorer's rules.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.episode import Episode, StepParams, episode_of
from houseexpo.pseudoslam.kernels.look import look_at_sector
from houseexpo.pseudoslam.kernels.mapping.merge import UNKNOWN
from houseexpo.pseudoslam.kernels.planning.descent import NO_TURN, best_turns
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.known_ways import find_ways
from houseexpo.pseudoslam.kernels.planning.outlook import OutlookRules, describe
from houseexpo.pseudoslam.kernels.planning.plan import FrontierRules
from houseexpo.pseudoslam.kernels.planning.scoring import best_of
from houseexpo.pseudoslam.kernels.step import stand_still, step
from houseexpo.pseudoslam.kernels.types import Cells, Counts, Floats, Grid, Rows, Scratch, row_type
from houseexpo.pseudoslam.kernels.whole import whole

ERRAND = row_type(looks=int, lost=int, target=int, bumps=int)
"""Remaining turns of the first look around; the number of cells given up; the target cell, -1 for none; how often the
robot was blocked on the way there."""
ENDED, NOTHING = range(2)
"""Why ``explore`` returned: enough is seen or time is up; or there is no frontier."""
_NONE, _FORWARD, _LEFT, _RIGHT = range(4)


class ExplorerRules(NamedTuple):
    """The parameters of the explorer's steps and choices, the same for all houses."""

    step_px: float
    turn_rad: float
    enough: float
    """The argument of ``best_turns``."""
    most_bumps: int
    frontiers: FrontierRules
    outlook: OutlookRules


class Errand(NamedTuple):
    """The memory of an explorer, and working memory for its choices."""

    state: Rows
    """(1,) ``ERRAND``."""
    given_up: Cells
    """(n,), cells that remained unknown after the robot looked at them."""
    frontiers: Rows
    """(n,) ``FRONTIER``."""
    outlooks: Floats
    """(LOOKED_AT, numbers)"""
    scores: Floats
    """(LOOKED_AT,)"""


class Course(NamedTuple):
    """The course of an exploration: counted cells seen and pixels travelled, (steps + 1,) each, including the start."""

    covered: Counts
    gone_px: Floats


@njit(cache=True, nogil=True)
def explore(
    pool: Episode, sizes: Counts, errand: Errand, weights: Floats, rules: ExplorerRules, params: StepParams,
    scratch: Scratch, enough: int, course: Course,
) -> int:  # fmt: skip
    """Explore until enough is seen or ``course`` is full; return why it ended.

    Parameters
    ----------
    pool, sizes
        One episode that scans sectors without noise; its view is not drawn.
    weights
        (numbers,), the weights for the scores of frontiers.
    enough
        The number of counted cells to see.
    """
    episode = episode_of(pool, sizes, 0)
    known, pose, counts, state, found = episode.known, episode.pose, episode.counts, errand.state[0], scratch.ways
    cols, radius = known.shape[1], rules.frontiers.radius_px
    turns, goes = 0, False
    while counts.covered < enough and counts.steps < len(course.covered) - 1:
        act = _NONE
        if state.looks > 0:  # R1
            state.looks -= 1
            act = _LEFT
        else:
            state.bumps += counts.blocked
        for _ in range(len(errand.frontiers)):
            if act != _NONE:
                break
            if turns == 0 and _has_to_choose(known, errand, rules.most_bumps):
                n = find_frontiers(
                    known, pose.seen_x, pose.seen_y, rules.frontiers, errand.given_up[: state.lost], scratch,
                    errand.frontiers,
                )  # fmt: skip
                if n == 0:
                    return NOTHING  # R4
                looked = describe(
                    known, pose.seen_x, pose.seen_y, pose.seen_heading, counts.steps, errand.frontiers, n,
                    rules.outlook, found, errand.outlooks,
                )  # fmt: skip
                chosen = best_of(errand.outlooks, looked, weights, errand.scores)
                goal = errand.frontiers[chosen].goal
                state.target, state.bumps = errand.frontiers[chosen].middle, 0
                here = math.floor(pose.seen_y) * cols + math.floor(pose.seen_x)
                until = whole(here) if found.ways[here] >= 0 else whole(-1)
                find_ways(known, goal % cols + 0.5, goal // cols + 0.5, radius, until, found)
                turns, goes = 0, False
            if not goes:
                best = best_turns(
                    known, pose.seen_x, pose.seen_y, pose.seen_heading, rules.turn_rad, rules.step_px, radius,
                    rules.enough, found,
                )  # fmt: skip
                if best != NO_TURN:
                    turns, goes = best, True
            if not goes:
                act = _look(known, pose.seen_x, pose.seen_y, pose.seen_heading, errand, rules.turn_rad)
            elif turns != 0:
                act = _LEFT if turns > 0 else _RIGHT
                turns -= 1 if turns > 0 else -1
            else:
                act, goes = _FORWARD, False
        if act == _NONE:
            return NOTHING
        turn = rules.turn_rad if act == _LEFT else -rules.turn_rad if act == _RIGHT else 0.0
        forward = rules.step_px if act == _FORWARD else 0.0
        step(episode, turn, forward, params, scratch, stand_still, look_at_sector, False)
        course.covered[counts.steps] = counts.covered
        course.gone_px[counts.steps] = episode.readings.path_length
    return ENDED


@njit(cache=True, nogil=True)
def _has_to_choose(known: Grid, errand: Errand, most_bumps: int) -> bool:
    """Return whether to choose again (R2); give up a frontier to which the robot is blocked (R3)."""
    state = errand.state[0]
    if state.bumps > most_bumps:
        _give_up(errand)
        state.target, state.bumps = -1, 0
    return bool(state.target < 0 or known.ravel()[state.target] != UNKNOWN)


@njit(cache=True, nogil=True)
def _give_up(errand: Errand) -> None:
    """Remember a frontier's middle as one that remains unknown, if there is space."""
    state = errand.state[0]
    if state.lost < len(errand.given_up):
        errand.given_up[state.lost] = state.target
        state.lost += 1


@njit(cache=True, nogil=True)
def _look(known: Grid, x: float, y: float, heading: float, errand: Errand, turn: float) -> int:
    """Return the turn towards the frontier, or no action if the robot has looked at it (R3)."""
    state = errand.state[0]
    row, col = state.target // known.shape[1], state.target % known.shape[1]
    is_unknown = known[row, col] == UNKNOWN
    off = math.atan2(y - row - 0.5, col + 0.5 - x) - heading
    off -= 2.0 * math.pi * np.rint(off / (2.0 * math.pi))
    turns = np.rint(off / turn)
    if is_unknown and turns != 0.0:
        return _LEFT if turns > 0.0 else _RIGHT
    if is_unknown:
        _give_up(errand)
    state.target = -1
    return _NONE
