"""Carry out planners' actions (travel to a frontier), then find the next choices; for a pool.

The kernels are those of ``step``, with the same arguments but such an action instead of a step; each is compiled only
when it is used.
"""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.bound_pool import BoundPool
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.mapping import UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.paths import (
    find_distances,
    is_explored_near,
    nearest_reachable_cell,
    next_motion,
    trace_path,
)
from houseexpo.pseudoslam.kernels.planning.planner_types import (
    ARRIVED,
    BLOCKED,
    DONE,
    GIVEN_UP,
    GOING,
    LIMIT,
    NO_CHOICE,
    NOTHING,
    SEEN,
    PlannerMemory,
    PlannerRules,
    TravelRules,
)
from houseexpo.pseudoslam.kernels.step import (
    Look,
    Move,
    act_in_pool,
    measure_ranges,
    move_nothing,
    move_obstacles,
    scan_fully_into_map,
    scan_rays_into_map,
    scan_sector_into_map,
    step,
)
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, PathScratch, Rows, Scratch


@njit(cache=True, nogil=True)
def start_travel(
    known: Grid, pose: Rows, plan: PlannerMemory, choice: Floats, rules: PlannerRules, found: PathScratch
) -> None:
    """Find the path of an action, in ``found``, and set the state of the plan.

    Parameters
    ----------
    choice
        (2,), the number of a frontier, and 0.
    """
    state = plan.state[0]
    state.outcome, state.target, state.path, state.at, state.steps = NOTHING, -1, 0, 0, 0
    chosen = plan.frontiers[int(choice[0])]
    goal = chosen.goal
    if goal == NO_CHOICE:
        return
    if known.ravel()[chosen.middle] == UNKNOWN:
        state.target = chosen.middle
    find_distances(known, pose.seen_x, pose.seen_y, rules.frontiers.radius_px, goal, found)
    state.path = trace_path(found, goal, found.queue[0])
    state.outcome = GOING if state.path > 0 else NOTHING


@njit(cache=True, nogil=True)
def update_travel(known: Grid, pose: Rows, counts: Rows, plan: PlannerMemory, rules: TravelRules) -> None:
    """Update the state of a travel after a step."""
    state = plan.state[0]
    state.steps += 1
    if counts.covered >= state.enough or math.hypot(pose.x - state.goal_x, pose.y - state.goal_y) <= state.goal_px:
        state.outcome = DONE
    elif counts.blocked != 0:
        state.outcome = BLOCKED
    elif state.outcome == GOING and state.target >= 0 and is_explored_near(known, state.target, rules.settled_px):
        state.outcome = SEEN
    elif state.outcome == GOING and (state.steps >= rules.most_steps or counts.steps >= state.time):
        state.outcome = LIMIT


@njit(cache=True, nogil=True)
def update_choices(known: Grid, pose: Rows, plan: PlannerMemory, rules: PlannerRules, scratch: Scratch) -> None:
    """Find the next frontiers to choose from; give up a frontier that remained unknown."""
    state = plan.state[0]
    in_vain = state.outcome == ARRIVED or (state.outcome == BLOCKED and state.gone_px == 0.0)
    if in_vain and state.target >= 0 and known.ravel()[state.target] == UNKNOWN:
        plan.given_up[state.lost % GIVEN_UP] = state.target
        state.lost += 1
    _find_choices(known, pose, plan, plan.given_up[: min(state.lost, GIVEN_UP)], rules, scratch)


@njit(cache=True, nogil=True)
def _find_choices(
    known: Grid, pose: Rows, plan: PlannerMemory, given_up: Cells, rules: PlannerRules, scratch: Scratch
) -> None:
    """Find the frontiers, and the goal if the map shows a path to it."""
    state, choices = plan.state[0], len(plan.frontiers)
    has_goal = not math.isnan(state.goal_x)
    room = plan.frontiers[: choices - 1 if has_goal else choices]
    n = find_frontiers(known, pose.seen_x, pose.seen_y, rules.frontiers, given_up, scratch, room)
    for k in range(n, choices):
        row = plan.frontiers[k]
        row.middle, row.goal, row.cells, row.way = 0, NO_CHOICE, 0, 0
    if has_goal:
        found = scratch.ways
        goal = nearest_reachable_cell(found, state.goal_x, state.goal_y)
        cols = known.shape[1]
        if (
            goal >= 0
            and math.hypot(goal % cols + 0.5 - state.goal_x, goal // cols + 0.5 - state.goal_y) < state.goal_px
        ):
            row = plan.frontiers[choices - 1]
            row.middle, row.goal, row.cells, row.way = goal, goal, 1, found.ways[goal]


@njit(cache=True, nogil=True)
def travel_pool_by_sector(bound: BoundPool, choices: Floats, wanted: Grid, first: int, end: int) -> None:
    """Travel in environments that scan sectors without noise; the other kernels are like this one.

    Parameters
    ----------
    bound, wanted, first, end
        Arguments of ``step_pool_by_sector``.
    choices
        (N, 2), the actions in the form of ``start_travel``.
    """
    act_in_pool(bound, choices, wanted, first, end, _travel, move_nothing, scan_sector_into_map, False)


@njit(cache=True, nogil=True)
def travel_pool_by_rays(bound: BoundPool, choices: Floats, wanted: Grid, first: int, end: int) -> None:
    """Travel in environments that scan along rays without noise."""
    act_in_pool(bound, choices, wanted, first, end, _travel, move_nothing, scan_rays_into_map, False)


@njit(cache=True, nogil=True)
def travel_pool_in_full(bound: BoundPool, choices: Floats, wanted: Grid, first: int, end: int) -> None:
    """Travel in environments with the scans and the noise of the parameters."""
    act_in_pool(bound, choices, wanted, first, end, _travel, move_nothing, scan_fully_into_map, True)


@njit(cache=True, nogil=True)
def travel_pool_with_people(bound: BoundPool, choices: Floats, wanted: Grid, first: int, end: int) -> None:
    """Do the same as ``travel_pool_in_full`` while people and bodies on trajectories move."""
    act_in_pool(bound, choices, wanted, first, end, _travel, move_obstacles, scan_fully_into_map, True)


@njit(inline="always")
def _travel(
    episode: Episode, choice: Floats, params: StepParams, scratch: Scratch, move: Move, look: Look, full: bool
) -> None:
    """Take steps until the action ends; an episode that has not begun begins with a first scan, which is not a step."""
    plan, rules, found = episode.plans, params.plan, scratch.ways
    state, pose, readings = plan.state[0], episode.pose, episode.readings
    before_px = readings.path_length
    begins = episode.counts.steps < 0
    if begins:
        state.lost = 0
    else:
        start_travel(episode.known, pose, plan, choice, rules, found)
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
        update_travel(episode.known, pose, episode.counts, plan, rules.travel)
        if state.outcome != GOING:
            break
    if full:  # once an action
        measure_ranges(episode, params)
    state.gone_px = readings.path_length - before_px
    update_choices(episode.known, pose, plan, rules, scratch)
