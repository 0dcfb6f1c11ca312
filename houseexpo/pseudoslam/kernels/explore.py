"""Choose the actions of explorers of frontiers: one action at a time, or until a whole house is explored.

``agents.explorers`` calls the rules for a policy's next action; ``explore`` calls them in a compiled loop, for training
with many explorations. Both take the same steps.

R1  First the robot turns until it has looked in all directions.
R2  It chooses again when the frontier is known or given up. It then descends the distances to the frontier's goal.
R3  If it cannot get closer, it turns to the frontier; a frontier that is still unknown after that is given up. So is
    one on the way to which the robot is blocked repeatedly.
R4  It is done when no frontier is left.
R5  An explorer that counts metres and not turns looks round first: where it has gone a step, it turns to the unknown
    cells in sight that its laser has not swept there (``find_unseen_in_sight``), by the smaller turn that sees all.
R6  A robot that turns while it goes takes the last turn before a step, or a part of it, during the step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.episode import Episode, StepParams, slice_episode
from houseexpo.pseudoslam.kernels.mapping import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontier_features import FeatureRules, compute_features, score_frontiers
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.paths import NO_TURN, choose_turns, find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import FRONTIER, FrontierRules
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.step import move_nothing, scan_sector_into_map, step
from houseexpo.pseudoslam.kernels.types import (
    Cells,
    Counts,
    Floats,
    Grid,
    PathScratch,
    Rows,
    Scratch,
    as_int64,
    make_row_dtype,
)

EXPLORER = make_row_dtype(looks=int, lost=int, target=int, bumps=int, turns=int, goes=int, rest=int)
"""Remaining turns of the first look around; the number of cells given up; the target cell, -1 for none; how often the
robot was blocked on the way there; the turns before the next step, positive to the left, and 1 if one is planned; the
turn during a step. Turns are counted in parts, see ``DescentRules``."""
ENDED, NOTHING = range(2)
"""Why ``explore`` returned: enough is seen or time is up; or there is no frontier."""
FORWARD, LEFT, RIGHT = range(3)
"""The discrete actions."""
NO_ACTION = -1
_GIVEN_UP = 1024
"""The number of cells that an explorer can give up."""


class DescentRules(NamedTuple):
    """The parameters of a robot that descends distances by discrete actions."""

    step_px: float
    turn_rad: float
    radius_px: float
    enough: float
    parts: int
    """Arguments of ``choose_turns``."""


class ExplorerRules(NamedTuple):
    """The parameters of the explorer's steps and choices, the same for all houses."""

    descent: DescentRules
    most_bumps: int
    frontiers: FrontierRules
    features: FeatureRules


class ExplorerMemory(NamedTuple):
    """The memory of an explorer."""

    state: Rows
    """(1,) ``EXPLORER``."""
    given_up: Cells
    """(n,), cells that remained unknown after the robot looked at them."""
    frontiers: Rows
    """(n,) ``FRONTIER``, working memory."""


class ExplorationCurve(NamedTuple):
    """The course of an exploration: counted cells seen and pixels travelled, (steps + 1,) each, including the start."""

    covered: Counts
    gone_px: Floats


def new_memory(looks: int, frontiers: int) -> ExplorerMemory:
    """Return the memory of an explorer that first turns ``looks`` times, with room for a number of frontiers."""
    state = np.array([(looks, 0, -1, 0, 0, 0, 0)], EXPLORER)
    return ExplorerMemory(state, np.zeros(_GIVEN_UP, np.int32), np.zeros(frontiers, FRONTIER))


@njit(cache=True, nogil=True)
def explore(
    pool: Episode, sizes: Counts, memory: ExplorerMemory, features: Floats, weights: Floats, rules: ExplorerRules,
    params: StepParams, scratch: Scratch, enough: int, course: ExplorationCurve,
) -> int:  # fmt: skip
    """Explore until enough is seen or ``course`` is full; return why it ended.

    Parameters
    ----------
    pool, sizes
        One episode that scans sectors without noise; its view is not drawn.
    features
        (LOOKED_AT, numbers), working memory.
    weights
        (numbers,), the weights for the scores of frontiers.
    enough
        The number of counted cells to see.
    """
    episode = slice_episode(pool, sizes, 0)
    known, pose, counts, state, found = episode.known, episode.pose, episode.counts, memory.state[0], scratch.ways
    scores = np.empty(len(features))
    while counts.covered < enough and counts.steps < len(course.covered) - 1:
        act = first_look_action(memory, counts.blocked)
        for _ in range(len(memory.frontiers)):
            if act != NO_ACTION:
                break
            if must_choose_again(known, memory, rules.most_bumps):
                n = find_frontiers(
                    known, pose.seen_x, pose.seen_y, rules.frontiers, memory.given_up[: state.lost], scratch,
                    memory.frontiers,
                )  # fmt: skip
                if n == 0:
                    return NOTHING  # R4
                looked = compute_features(
                    known, pose.seen_x, pose.seen_y, pose.seen_heading, counts.steps, memory.frontiers, n,
                    rules.features, found, features,
                )  # fmt: skip
                chosen = score_frontiers(features, looked, weights, scores)
                set_target(known, pose.seen_x, pose.seen_y, memory, chosen, rules.frontiers.radius_px, found)
            act = next_action(known, pose.seen_x, pose.seen_y, pose.seen_heading, memory, rules.descent, found)
        if act == NO_ACTION:
            return NOTHING
        turns = 1.0 if act == LEFT else -1.0 if act == RIGHT else state.rest / rules.descent.parts
        turn, forward = turns * rules.descent.turn_rad, rules.descent.step_px if act == FORWARD else 0.0
        step(episode, turn, forward, params, scratch, move_nothing, scan_sector_into_map, False)
        course.covered[counts.steps] = counts.covered
        course.gone_px[counts.steps] = episode.readings.path_length
    return ENDED


@njit(cache=True, nogil=True)
def first_look_action(memory: ExplorerMemory, blocked: int) -> int:
    """Return a turn of the first look around (R1), or ``NO_ACTION`` after it; count collisions then."""
    state = memory.state[0]
    if state.looks > 0:
        state.looks -= 1
        return LEFT
    state.bumps += blocked
    return NO_ACTION


@njit(cache=True, nogil=True)
def must_choose_again(known: Grid, memory: ExplorerMemory, most_bumps: int) -> bool:
    """Return whether to choose again (R2); give up a frontier to which the robot is blocked (R3)."""
    state = memory.state[0]
    if state.turns != 0:
        return False
    if state.bumps > most_bumps:
        _give_up(memory)
        state.target, state.bumps = -1, 0
    return bool(state.target < 0 or known.ravel()[state.target] != UNKNOWN)


@njit(cache=True, nogil=True)
def set_target(
    known: Grid, x: float, y: float, memory: ExplorerMemory, chosen: int, radius_px: float, found: PathScratch
) -> None:
    """Make one of the memory's frontiers the target, and compute the distances to its goal, up to the robot."""
    state, goal, cols = memory.state[0], memory.frontiers[chosen].goal, known.shape[1]
    state.target, state.bumps, state.turns, state.goes = memory.frontiers[chosen].middle, 0, 0, 0
    here = math.floor(y) * cols + math.floor(x)
    until = as_int64(here) if found.ways[here] >= 0 else as_int64(-1)
    find_distances(known, goal % cols + 0.5, goal // cols + 0.5, radius_px, until, found)


@njit(cache=True, nogil=True)
def next_action(
    known: Grid, x: float, y: float, heading: float, memory: ExplorerMemory, rules: DescentRules, found: PathScratch
) -> int:
    """Return the next action towards the target, or ``NO_ACTION`` if the robot has looked at it in vain (R3)."""
    act = descent_action(known, x, y, heading, memory.state, rules, found)
    return act if act != NO_ACTION else look_at_target(known, x, y, heading, memory, rules.turn_rad)


@njit(cache=True, nogil=True)
def look_at_target(known: Grid, x: float, y: float, heading: float, memory: ExplorerMemory, turn_rad: float) -> int:
    """Return a turn to the target, or ``NO_ACTION`` if it is known, or is given up because it was looked at (R3)."""
    state = memory.state[0]
    row, col = state.target // known.shape[1], state.target % known.shape[1]
    is_unknown = known[row, col] == UNKNOWN
    off = math.atan2(y - row - 0.5, col + 0.5 - x) - heading
    off -= 2.0 * math.pi * np.rint(off / (2.0 * math.pi))
    turns = np.rint(off / turn_rad)
    if is_unknown and turns != 0.0:
        return LEFT if turns > 0.0 else RIGHT
    if is_unknown:
        _give_up(memory)
    state.target = -1
    return NO_ACTION


@njit(cache=True, nogil=True)
def descent_action(
    known: Grid, x: float, y: float, heading: float, states: Rows, rules: DescentRules, found: PathScratch
) -> int:
    """Return the next action down the distances ``found``, or ``NO_ACTION`` if no step reduces them.

    ``states`` is (1,) ``EXPLORER``, of which ``turns``, ``goes`` and ``rest`` are used.
    """
    state = states[0]
    if state.goes == 0:
        turns = choose_turns(
            known, x, y, heading, rules.turn_rad, rules.step_px, rules.radius_px, rules.enough, rules.parts, found
        )
        if turns == NO_TURN:
            return NO_ACTION
        state.turns, state.goes = turns, 1
    if abs(state.turns) > (rules.parts if rules.parts > 1 else 0):
        act = LEFT if state.turns > 0 else RIGHT
        state.turns -= rules.parts if state.turns > 0 else -rules.parts
        return act
    state.rest, state.turns, state.goes = state.turns, 0, 0  # R6
    return FORWARD


@njit(cache=True, nogil=True)
def find_unseen_in_sight(
    known: Grid, x: float, y: float, heading: float, half_fov: float, range_px: float, swept: tuple[float, float],
    scratch: Scratch,
) -> tuple[int, float, float]:  # fmt: skip
    """Return the number of unknown cells in sight outside of a sector, and the turns to the left and right for all.

    A cell is in sight if it is the first one that is not free on some line from the robot, as an obstacle is in
    ``sector_scan``. In the robot's row and column it may count twice.

    Parameters
    ----------
    known
        (rows, cols), the map.
    half_fov
        Half the angle of the laser's fan, radians.
    swept
        The sector, from its right edge to its left edge, radians; it is the whole circle if they are a full turn apart.
    """
    cols, circle = known.shape[1], 2.0 * math.pi
    closed = known ^ np.uint8(FREE)
    _, n_hit = sector_scan(closed, x, y, 0.0, math.pi, range_px, scratch.runs, scratch.hit, scratch.slopes)
    n, left, right = 0, 0.0, 0.0
    for i in range(n_hit):
        row, col = scratch.hit[i] // cols, scratch.hit[i] % cols
        if known[row, col] != UNKNOWN:
            continue
        angle = math.atan2(y - row - 0.5, col + 0.5 - x)
        if (angle - swept[0]) % circle <= swept[1] - swept[0]:
            continue
        n += 1
        left = max(left, (angle - heading - half_fov) % circle)
        right = max(right, (heading - half_fov - angle) % circle)
    return n, left, right


@njit(cache=True, nogil=True)
def _give_up(memory: ExplorerMemory) -> None:
    """Remember a frontier's middle as one that remains unknown, if there is space."""
    state = memory.state[0]
    if state.lost < len(memory.given_up):
        memory.given_up[state.lost] = state.target
        state.lost += 1
