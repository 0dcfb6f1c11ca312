"""What an environment plans: the frontiers that it may choose from, where an action leads, and what came of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.types import Cells, Offsets, Rows, row_type

FRONTIER = row_type(middle=int, goal=int, cells=int, way=int)
"""A cluster: flat indices of its middle and its goal, how many cells it has, the way to the goal (``KnownWays``)."""
PLAN = row_type(
    outcome=int, target=int, path=int, at=int, steps=int, lost=int, gone_px=float, moved_px=float,
    cols=int, enough=int, time=int, goal_x=float, goal_y=float, goal_px=float,
)  # fmt: skip
"""Of the last action: how it ended (``OUTCOMES``), the cell that it was to see, -1: none, the cells of its way, the one
it was at, its steps; how many cells were given up so far; how far it went, and how far a waypoint was moved.

Of the episode: the columns of its grid; how many covered cells fulfil the task, and how many steps it has; the goal and
how near to it is there, pixels: not a number where there is none."""
GOING, ARRIVED, SEEN, BLOCKED, LIMIT, DONE, NOTHING = range(7)
OUTCOMES = "going", "arrived", "seen", "blocked", "limit", "done", "nothing"
"""How a travel stands: it goes on; it is at its end; what it came to see is seen; something is in the way; it has taken
as many steps as one may; the task is fulfilled; there was nowhere to go."""
STRAIGHT, ACROSS = 70, 99
"""Ways from a cell to its neighbours: 70 are one cell's side."""
GIVEN_UP = 64
"""Cells that were given up last are remembered."""
NO_CHOICE = -1
"""In ``FRONTIER.goal``: there is no such frontier."""


NODE = row_type(cell=int, way=int, utility=int, visited=int)
"""A place of the graph: its flat index, -1 where there is none; the way there; the frontiers' cells in sight; 1 where
the robot has been."""
GRAPH = row_type(nodes=int, visits=int)
"""How many nodes there are, and how many blocks the robot has been in."""
VISITED = 1024
"""Blocks that the robot has been in last are remembered."""
BY_FRONTIER, BY_WAYPOINT, BY_NEIGHBOUR = range(3)
"""What an action names: a frontier, a point, or a neighbour of the graph's first node."""


class FrontierRules(NamedTuple):
    """What frontiers are found by; the same for all maps."""

    radius_px: float
    """The robot's."""
    range_px: float
    """The laser's."""
    large: int
    """Cells of a cluster that comes first (R5)."""
    least: int
    """Smaller clusters are left out."""
    spare_px: float
    """How far round a cell that was given up others are left out."""
    reach: int
    """How many rows and columns a cluster reaches from its first cell (R2)."""
    near: Offsets
    """(n, 2) rows down and columns to the right, nearest first: where a goal is looked for (R3)."""


class TravelRules(NamedTuple):
    """The robot and its steps."""

    radius_px: float
    step_px: float
    turn_rad: float
    settled_px: int
    """How near to a frontier's middle no other may be left, in rows and in columns."""
    aim_cells: int
    """Cells of the way ahead among which it looks for its aim."""
    most_steps: int
    """Of one travel."""


class GraphRules(NamedTuple):
    """How a graph is drawn."""

    block_px: int
    """Cells along the side of a node's block."""
    range_px: float
    """The laser's."""
    spare_px: float
    """As ``FrontierRules``'s."""


class PlanRules(NamedTuple):
    """What is the same for all environments."""

    kind: int
    """What actions name."""
    frontiers: FrontierRules
    travel: TravelRules
    graph: GraphRules


class Plans(NamedTuple):
    """The plans of one environment. In a pool the arrays have one axis more in front."""

    frontiers: Rows
    """(K,) ``FRONTIER``, to choose from: ranked; with a goal, the last is the goal. (0,) for other actions."""
    given_up: Cells
    """(GIVEN_UP,) the cells that stayed unknown though they were looked at, in turns."""
    state: Rows
    """(1,) ``PLAN``; (0,) where actions are single steps."""


class Graph(NamedTuple):
    """The graph of one environment, at most M nodes with k neighbours. In a pool arrays have one axis more in front."""

    nodes: Rows
    """(M,) ``NODE``; the first is the robot's. (0,) where nobody asks."""
    edges: npt.NDArray[np.int32]
    """(M, k) each node's neighbours, nearest first; -1 where there are no more."""
    visited: Cells
    """(VISITED,) the blocks that the robot has been in, in turns."""
    state: Rows
    """(1,) ``GRAPH``."""


def new_graph(nodes: int, neighbours: int) -> Graph:
    """Return the graph of an environment that has not begun."""
    graph = Graph(
        np.zeros(nodes, NODE),
        np.full((nodes, neighbours), -1, np.int32),
        np.zeros(VISITED if nodes else 0, np.int32),
        np.zeros(1 if nodes else 0, GRAPH),
    )
    graph.nodes["cell"] = -1
    return graph


def new_plans(choices: int) -> Plans:
    """Return the plans of an environment that has not begun."""
    plans = Plans(np.zeros(choices, FRONTIER), np.zeros(GIVEN_UP, np.int32), np.zeros(1, PLAN))
    plans.frontiers["goal"] = NO_CHOICE
    return plans


def no_plans() -> Plans:
    """Return the plans of an environment whose actions are single steps."""
    return Plans(np.zeros(0, FRONTIER), np.zeros(0, np.int32), np.zeros(0, PLAN))


def no_rules() -> PlanRules:
    """Return rules for environments that plan nothing."""
    return PlanRules(
        BY_WAYPOINT,
        FrontierRules(0.0, 0.0, 1, 1, 0.0, 1, np.zeros((0, 2), np.int16)),
        TravelRules(0.0, 0.0, 0.0, 0, 0, 0),
        GraphRules(1, 0.0, 0.0),
    )


@njit(inline="always")
def plans_of(pool: Plans, i: int) -> Plans:
    """Return environment ``i``'s part of a pool, views."""
    return Plans(pool.frontiers[i], pool.given_up[i], pool.state[i])


@njit(inline="always")
def graph_of(pool: Graph, i: int) -> Graph:
    """Return environment ``i``'s part of a pool, views."""
    return Graph(pool.nodes[i], pool.edges[i], pool.visited[i], pool.state[i])
