"""Define what a planner keeps for an environment (frontiers, last action), and the parameters of planning."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from houseexpo.pseudoslam.kernels.types import Cells, Offsets, Rows, make_row_dtype

FRONTIER = make_row_dtype(middle=int, goal=int, cells=int, way=int)
"""A cluster: flat indices of its middle and its goal, its cells, the distance to the goal (``PathScratch.ways``)."""
PLAN = make_row_dtype(
    outcome=int, target=int, path=int, at=int, steps=int, lost=int, gone_px=float,
    cols=int, enough=int, time=int, goal_x=float, goal_y=float, goal_px=float,
)  # fmt: skip
"""Of the last action: its outcome (``OUTCOMES``), the cell to see (-1 for none), the number of cells of its path, the
current one, its number of steps; the number of cells given up so far; the distance travelled.

Of the episode: the columns of its grid; the number of known cells that fulfils the task, and the number of steps; the
goal and its radius in pixels, NaN for none."""
GOING, ARRIVED, SEEN, BLOCKED, LIMIT, DONE, NOTHING = range(7)
OUTCOMES = "going", "arrived", "seen", "blocked", "limit", "done", "nothing"
"""The states of a travel: it continues; it has arrived; its target was seen; it is blocked; it has reached the limit of
steps; the task is fulfilled; there was nowhere to go."""
STRAIGHT, ACROSS = 70, 99
"""Distances from a cell to its neighbours; 70 is the side of a cell."""
GIVEN_UP = 64
"""The number of cells given up that are remembered, the latest ones."""
NO_CHOICE = -1
"""The value of ``FRONTIER.goal`` for a frontier that does not exist."""


class FrontierRules(NamedTuple):
    """The parameters for finding frontiers, the same for all maps."""

    radius_px: float
    """The robot's."""
    range_px: float
    """The laser's."""
    large: int
    """Number of cells of a large cluster, which comes first (R5)."""
    least: int
    """Smaller clusters are left out."""
    spare_px: float
    """Distance within which cells around one that was given up are ignored."""
    reach: int
    """Largest number of rows and columns of a cluster from its first cell (R2)."""
    near: Offsets
    """(n, 2), offsets in rows down and columns to the right, nearest first, at which to look for a goal (R3)."""


class TravelRules(NamedTuple):
    """The parameters of the robot and its steps in a travel."""

    radius_px: float
    step_px: float
    turn_rad: float
    settled_px: int
    """Distance in rows and columns around a frontier's middle within which no other frontier cell may be left."""
    aim_cells: int
    """Number of cells ahead on the path among which the robot chooses its aim."""
    most_steps: int
    """Largest number of steps of one travel."""


class PlannerRules(NamedTuple):
    """The parameters of planning, the same for all environments."""

    frontiers: FrontierRules
    travel: TravelRules


class PlannerMemory(NamedTuple):
    """The plans of one environment. In a pool, arrays have an additional first axis."""

    frontiers: Rows
    """(K,) ``FRONTIER`` to choose from, ranked; with a goal, the last is the goal; (0,) if actions are single steps."""
    given_up: Cells
    """(GIVEN_UP,), the cells that remained unknown after the robot looked at them, as a ring buffer."""
    state: Rows
    """(1,) ``PLAN``; (0,) if actions are single steps."""


def new_planner_memory(choices: int) -> PlannerMemory:
    """Return the plans of an environment that has not begun."""
    plans = PlannerMemory(np.zeros(choices, FRONTIER), np.zeros(GIVEN_UP, np.int32), np.zeros(1, PLAN))
    plans.frontiers["goal"] = NO_CHOICE
    return plans


def no_planner_memory() -> PlannerMemory:
    """Return the plans of an environment whose actions are single steps."""
    return PlannerMemory(np.zeros(0, FRONTIER), np.zeros(0, np.int32), np.zeros(0, PLAN))


def no_planner_rules() -> PlannerRules:
    """Return parameters for environments without planning."""
    return PlannerRules(
        FrontierRules(0.0, 0.0, 1, 1, 0.0, 1, np.zeros((0, 2), np.int16)),
        TravelRules(0.0, 0.0, 0.0, 0, 0, 0),
    )
