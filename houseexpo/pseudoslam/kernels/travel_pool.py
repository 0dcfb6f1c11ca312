"""Planners' actions in some of the environments of a pool; each takes as many steps as its travel needs.

The kernels are those of ``step_pool``, with the same arguments but such an action instead of a step; each is compiled
only when it is used.
"""

from __future__ import annotations

from numba import njit

from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.look import look, look_along_rays, look_at_sector
from houseexpo.pseudoslam.kernels.planning.errand import look_back, set_out, survey
from houseexpo.pseudoslam.kernels.planning.plan import GOING, NOTHING
from houseexpo.pseudoslam.kernels.planning.travel import next_motion
from houseexpo.pseudoslam.kernels.step import Look, Move, move_people, stand_still, step
from houseexpo.pseudoslam.kernels.step_pool import act_in_each
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Scratch


@njit(cache=True, nogil=True)
def travels_by_sector(
    pool: Episode, sizes: Counts, choices: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Travel in environments that scan sectors without noise; the other kernels are like this one.

    Parameters
    ----------
    pool, sizes, wanted, params, scratch, first, end
        Arguments of ``steps_by_sector``.
    choices
        (N, 2), the actions in the form of ``set_out``.
    """
    act_in_each(pool, sizes, choices, wanted, params, scratch, first, end, _travel, stand_still, look_at_sector, False)


@njit(cache=True, nogil=True)
def travels_by_rays(
    pool: Episode, sizes: Counts, choices: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Travel in environments that scan along rays without noise."""
    act_in_each(pool, sizes, choices, wanted, params, scratch, first, end, _travel, stand_still, look_along_rays, False)


@njit(cache=True, nogil=True)
def travels_in_full(
    pool: Episode, sizes: Counts, choices: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Travel in environments with the scans and the noise of the parameters."""
    act_in_each(pool, sizes, choices, wanted, params, scratch, first, end, _travel, stand_still, look, True)


@njit(cache=True, nogil=True)
def travels_with_people(
    pool: Episode, sizes: Counts, choices: Floats, wanted: Grid, params: StepParams, scratch: Scratch,
    first: int, end: int,
) -> None:  # fmt: skip
    """Do the same as ``travels_in_full`` while people and bodies on trajectories move."""
    act_in_each(pool, sizes, choices, wanted, params, scratch, first, end, _travel, move_people, look, True)


@njit(inline="always")
def _travel(
    episode: Episode, choice: Floats, params: StepParams, scratch: Scratch, move: Move, look: Look, full: bool
) -> None:
    """Take steps until the action ends; an episode that has not begun begins with a first scan, which is not a step."""
    plan, graph, rules, found = episode.plans, episode.graph, params.plan, scratch.ways
    state, pose, readings = plan.state[0], episode.pose, episode.readings
    before_px = readings.path_length
    begins = episode.counts.steps < 0
    if begins:
        state.lost = 0
        if len(graph.state) > 0:
            graph.state[0].visits = 0
    else:
        set_out(episode.known, pose, plan, graph, choice, rules, found)
    turn, forward = 0.0, 0.0
    if not begins and state.outcome == NOTHING:
        turn = rules.travel.turn_rad
    while True:
        if not begins and state.outcome == GOING:
            turn, forward, state.at, state.outcome = next_motion(
                episode.known, pose.seen_x, pose.seen_y, pose.seen_heading, found, state.path, state.at,
                state.target, rules.travel,
            )  # fmt: skip
            if state.outcome != GOING and state.steps > 0:
                break
        step(episode, turn, forward, params, scratch, move, look, full)
        if begins:
            state.outcome, state.steps, state.target = NOTHING, 0, -1
            break
        look_back(episode.known, pose, episode.counts, plan, rules.travel)
        if state.outcome != GOING:
            break
    state.gone_px = readings.path_length - before_px
    survey(episode.known, pose, plan, graph, rules, scratch)
