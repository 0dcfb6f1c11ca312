"""Carry out planners' actions (travel to a frontier, graph node or waypoint), then find the next choices; for a pool.

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
from houseexpo.pseudoslam.kernels.planning.graph import build_graph, record_visit
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
    BY_FRONTIER,
    BY_NEIGHBOUR,
    DONE,
    GIVEN_UP,
    GOING,
    LIMIT,
    NO_CHOICE,
    NOTHING,
    SEEN,
    Graph,
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
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, PathScratch, Rows, Scratch, as_int64


@njit(cache=True, nogil=True)
def start_travel(
    known: Grid, pose: Rows, plan: PlannerMemory, graph: Graph, choice: Floats, rules: PlannerRules, found: PathScratch
) -> None:
    """Find the path of an action, in ``found``, and set ``plan.state``.

    Parameters
    ----------
    choice
        (2,), the number of a frontier or a neighbour, and 0; or a waypoint, pixels ahead and to the left.
    """
    state, x, y = plan.state[0], pose.seen_x, pose.seen_y
    state.outcome, state.target, state.path, state.at, state.steps, state.moved_px = NOTHING, -1, 0, 0, 0, 0.0
    radius = rules.frontiers.radius_px
    if rules.kind == BY_FRONTIER:
        chosen = plan.frontiers[int(choice[0])]
        goal = chosen.goal
        if goal == NO_CHOICE:
            return
        if known.ravel()[chosen.middle] == UNKNOWN:
            state.target = chosen.middle
        find_distances(known, x, y, radius, goal, found)
    elif rules.kind == BY_NEIGHBOUR:
        neighbour = graph.edges[0, int(choice[0])]
        if neighbour < 0:
            return
        goal = graph.nodes[neighbour].cell
        find_distances(known, x, y, radius, goal, found)
    else:
        find_distances(known, x, y, radius, as_int64(-1), found)
        cos, sin = math.cos(pose.seen_heading), math.sin(pose.seen_heading)
        to_x, to_y = x + choice[0] * cos - choice[1] * sin, y - choice[0] * sin - choice[1] * cos
        goal = nearest_reachable_cell(found, to_x, to_y)
        if goal < 0:
            return
        row, col = goal // known.shape[1], goal % known.shape[1]
        if math.floor(to_x) != col or math.floor(to_y) != row:
            state.moved_px = math.hypot(col + 0.5 - to_x, row + 0.5 - to_y)
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
def update_choices(
    known: Grid, pose: Rows, plan: PlannerMemory, graph: Graph, rules: PlannerRules, scratch: Scratch
) -> None:
    """Find the next frontiers to choose from, and update the graph; give up a frontier that remained unknown."""
    state = plan.state[0]
    in_vain = state.outcome == ARRIVED or (state.outcome == BLOCKED and state.gone_px == 0.0)
    if in_vain and state.target >= 0 and known.ravel()[state.target] == UNKNOWN:
        plan.given_up[state.lost % GIVEN_UP] = state.target
        state.lost += 1
    given_up = plan.given_up[: min(state.lost, GIVEN_UP)]
    if len(plan.frontiers) > 0:
        _find_choices(known, pose, plan, given_up, rules, scratch)
    if len(graph.nodes) > 0:
        if len(plan.frontiers) == 0:
            find_distances(known, pose.seen_x, pose.seen_y, rules.frontiers.radius_px, as_int64(-1), scratch.ways)
        record_visit(graph, pose.seen_x, pose.seen_y, known.shape[1], rules.graph)
        build_graph(known, graph, rules.graph, given_up, scratch.ways)


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
    plan, graph, rules, found = episode.plans, episode.graph, params.plan, scratch.ways
    state, pose, readings = plan.state[0], episode.pose, episode.readings
    before_px = readings.path_length
    begins = episode.counts.steps < 0
    if begins:
        state.lost = 0
        if len(graph.state) > 0:
            graph.state[0].visits = 0
    else:
        start_travel(episode.known, pose, plan, graph, choice, rules, found)
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
    update_choices(episode.known, pose, plan, graph, rules, scratch)
