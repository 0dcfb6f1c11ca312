"""Define spaces and observations for actions that are travels of many steps: to a frontier, map point or graph node."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.kernels.planning.planner_types import (
    NO_CHOICE,
    OUTCOMES,
    STRAIGHT,
    Graph,
    PlannerMemory,
    PlannerRules,
    new_graph,
    new_planner_memory,
)
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.planning import planner_rules
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.world import World

PlannerActions = Literal["frontier", "waypoint", "neighbour"]
Parts = dict[str, npt.NDArray[Any]]
FEATURES = 5
"""Features of a frontier: metres ahead, to the left, of the path to it and of its length, and 1; all 0 for none."""
_LONGER_THAN_ANY_WAY_M = 100_000.0  # longer than any path that a robot takes on a grid of 1e8 cells
_OUTCOMES = np.array(OUTCOMES, object)


@dataclass(frozen=True)
class PlannerSpec:
    """The actions of an environment in which each action is a travel on the robot's own map.

    The robot follows the shortest path through places where, according to its map, it can stand, within its limits of
    turn and step, and scans as it goes. It stops when it arrives, when an obstacle blocks it, when the frontier is
    seen, when the task is fulfilled, and after ``planning.max_steps`` steps; it takes at least one step. The time limit
    of an episode counts steps.

    Parameters
    ----------
    actions
        "frontier": an index in the order of ``kernels.planning.frontiers``. The observation has "frontiers" (K, 5)
        float32 (see ``FEATURES``) and "action_mask" (K,) int8, 1 for those that exist. With a goal, the last entry is
        the goal, once the map shows a path to it. An entry that does not exist means a turn to the left in place; if
        there is none, the mask allows the first. "waypoint": (ahead, left) in [-1, 1], as shares of
        ``planning.reach_m``. A point that is in a wall, unknown or out of reach is moved to the nearest place that the
        robot can reach; ``info["moved_m"]`` is that distance. "neighbour": an index of one of the neighbours of the
        graph's first node; the observation also has "action_mask".
    has_graph
        Whether the observation has a graph (``kernels.planning.graph``): "nodes" (M, 5) float32, which are metres ahead
        and to the left, metres of visible frontiers, 1 if the robot has been there, and 1 for the robot's own node,
        which is the first; "node_mask" (M,) int8, 1 for nodes that exist; "edges" (M, k) int64, the neighbours of each
        node, nearest first; and "edge_mask" (M, k) int8, 1 for edges that exist. All other values are 0.
    """

    actions: PlannerActions
    planning: PlanningConfig
    config: SimulatorConfig
    has_graph: bool = False

    @property
    def choices(self) -> int:
        """The number of frontiers to choose from, including the goal; 0 for other actions."""
        return self.planning.frontiers + (self.config.goal is not None) if self.actions == "frontier" else 0

    @property
    def numbers(self) -> int:
        """The number of actions; 0 for waypoints."""
        return self.planning.neighbours if self.actions == "neighbour" else self.choices

    @cached_property
    def _reach_px(self) -> float:
        reach_m = self.planning.reach_m
        return self.config.side_px / 2 if reach_m is None else reach_m * self.config.pixels_per_metre

    def rules(self) -> PlannerRules:
        """Return the parameters that are the same in all environments."""
        return planner_rules(self.config, self.planning, self.actions)

    def action_space(self) -> spaces.Space[Any]:
        """Return the space of one environment's actions."""
        return spaces.Discrete(self.numbers) if self.numbers else spaces.Box(-1.0, 1.0, (2,), np.float32)

    def spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return the spaces of the planner's parts of the observation."""
        found: dict[str, spaces.Space[Any]] = {}
        if self.choices:
            found["frontiers"] = _features(self.choices, _LONGER_THAN_ANY_WAY_M, _LONGER_THAN_ANY_WAY_M)
        if self.has_graph:
            nodes, neighbours = self.planning.nodes, self.planning.neighbours
            found["nodes"] = _features(nodes, _LONGER_THAN_ANY_WAY_M, 1.0)
            found["node_mask"] = spaces.MultiBinary(nodes)
            found["edges"] = spaces.Box(0, nodes - 1, (nodes, neighbours), np.int64)
            found["edge_mask"] = spaces.MultiBinary((nodes, neighbours))
        if self.numbers:
            found["action_mask"] = spaces.MultiBinary(self.numbers)
        return found

    def kernel_actions(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Return the kernel's form (N, 2) of actions (N,) or (N, 2); raise ConfigError for an invalid action."""
        return self._number_actions(values) if self.numbers else self._waypoint_actions(values)

    def _number_actions(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        flat = values.ravel()
        strange = (flat < 0) | (flat >= self.numbers) if flat.dtype.kind in "iu" else np.ones(flat.shape, bool)
        if strange.any():
            raise ConfigError(
                f"action: expected the number of a {self.actions}, 0 to {self.numbers - 1}, "
                f"found {flat[strange].item(0)!r}"
            )
        found = np.zeros((len(flat), 2))
        found[:, 0] = flat
        return found

    def _waypoint_actions(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        strange = ~((values >= -1) & (values <= 1)) if values.dtype.kind in "iuf" else np.ones(values.shape, bool)
        if strange.any():
            raise ConfigError(
                f"action: expected a waypoint (ahead, left), numbers from -1 to 1, found {values[strange].item(0)!r}"
            )
        found: npt.NDArray[np.float64] = values.reshape(-1, 2).astype(np.float64) * self._reach_px
        return found

    def graph(self) -> Graph:
        """Return the graph for a new episode."""
        planning = self.planning
        return new_graph(planning.nodes, planning.neighbours) if self.has_graph else new_graph(0, 0)

    def plans(self, state: State, world: World, task: Task) -> PlannerMemory:
        """Return the plans for a new episode."""
        plans, config = new_planner_memory(self.choices), self.config
        plans.state["enough"] = task.enough_cells(state.observable_cells)
        plans.state["time"], plans.state["cols"] = config.max_steps, state.occupied.shape[1]
        goal = (math.nan, math.nan, math.nan)
        if state.goal_m is not None and config.goal is not None:
            x, y = world.frame.pixels_from_points(state.goal_m).tolist()
            goal = x, y, config.goal.radius_m * config.pixels_per_metre
        for name, value in zip(("goal_x", "goal_y", "goal_px"), goal, strict=True):
            plans.state[name] = value
        return plans

    def observe(self, pool: Episode, metrics: Metrics) -> Parts:
        """Return the planner's parts of the observations of a pool of episodes."""
        found: Parts = {}
        cell_m = metrics.cell_m
        if self.choices:
            table = pool.plans.frontiers
            valid = table["goal"] != NO_CHOICE
            more = table["way"] * (cell_m / STRAIGHT), table["cells"] * cell_m, valid
            found["frontiers"] = _features_of(table["middle"], valid, pool, metrics, more)
        if self.has_graph:
            nodes, edges = pool.graph.nodes, pool.graph.edges
            valid = nodes["cell"] >= 0
            more = nodes["utility"] * cell_m, nodes["visited"], np.arange(nodes.shape[1])[None] == 0
            found["nodes"] = _features_of(nodes["cell"], valid, pool, metrics, more)
            found["node_mask"] = valid.view(np.int8)
            found["edges"] = np.maximum(edges, 0).astype(np.int64)
            found["edge_mask"] = (edges >= 0).view(np.int8)
        if self.numbers:
            found["action_mask"] = self.masks(pool).view(np.int8)
        return found

    def masks(self, pool: Episode) -> npt.NDArray[np.bool_]:
        """Return the mask of allowed actions (N, K)."""
        masks: npt.NDArray[np.bool_]
        masks = (
            pool.graph.edges[:, 0] >= 0 if self.actions == "neighbour" else pool.plans.frontiers["goal"] != NO_CHOICE
        )
        masks[:, 0] |= ~masks.any(axis=1)
        return masks

    def report(self, pool: Episode, cell_m: float) -> Parts:
        """Return the entries of ``info`` on the last actions, as new arrays."""
        state = pool.plans.state[:, 0]
        found: Parts = {
            "outcome": _OUTCOMES[state["outcome"]],
            "primitive_steps": state["steps"].copy(),
            "travelled_m": state["gone_px"] * cell_m,
        }
        return found if self.numbers else {**found, "moved_m": state["moved_px"] * cell_m}


def _features(number: int, third: float, fourth: float) -> spaces.Box:
    """Return the space of the features of a number of places, with the upper limits of the third and the fourth."""
    low = np.tile(np.array([-_LONGER_THAN_ANY_WAY_M, -_LONGER_THAN_ANY_WAY_M, 0, 0, 0], np.float32), (number, 1))
    return spaces.Box(
        low,
        np.tile(np.array([_LONGER_THAN_ANY_WAY_M, _LONGER_THAN_ANY_WAY_M, third, fourth, 1], np.float32), (number, 1)),
    )


def _features_of(
    cells: npt.NDArray[Any],
    valid: npt.NDArray[np.bool_],
    pool: Episode,
    metrics: Metrics,
    more: tuple[npt.NDArray[Any], ...],
) -> npt.NDArray[np.float32]:
    """Return features (N, K, 5) float32 of cells (N, K): metres ahead and to the left, and ``more``; 0 if not valid."""
    cols, cell_m = pool.plans.state["cols"], metrics.cell_m
    x, y, heading = (part[:, None] for part in metrics.pose_px[:, 3:].T)
    right, up = (cells % cols + 0.5 - x) * cell_m, (y - cells // cols - 0.5) * cell_m
    cos, sin = np.cos(heading), np.sin(heading)
    places = right * cos + up * sin, up * cos - right * sin
    features = np.stack(np.broadcast_arrays(*places, *more), axis=2)
    features[~valid] = 0.0
    found: npt.NDArray[np.float32] = features.astype(np.float32)
    return found


def make_planner_spec(
    actions: str, observation: str, planning: PlanningConfig | None, config: SimulatorConfig, task: Task
) -> PlannerSpec | None:
    """Return the planner's specification, None if actions are single steps; raise ConfigError if it is invalid."""
    if planning is not None and not isinstance(planning, PlanningConfig):
        raise ConfigError(f"planning: expected a PlanningConfig or None, found {planning!r}")
    names = get_args(PlannerActions)
    if actions not in names:
        for given, what in ((planning is not None, "planning"), (observation == "graph", "observation='graph'")):
            if given:
                raise ConfigError(
                    f"{what}: expected actions to be one of {', '.join(names)}; found actions={actions!r}"
                )
        return None
    if actions == "neighbour" and observation != "graph":
        raise ConfigError(f"actions='neighbour': expected observation='graph', found {observation!r}")
    if not task.rewards_add_up:
        raise ConfigError(
            f"actions={actions!r}: one such action is many steps, and the rewards of {type(task).__name__} as it is "
            "configured do not add up over steps; use single steps, or another task or reward"
        )
    if config.goal_region:
        raise ConfigError(
            f"actions={actions!r}: expected a goal that is a place, found goal.kind={config.goal_region.kind!r}"
        )
    name: Any = actions
    return PlannerSpec(name, planning or PlanningConfig(), config, observation == "graph")
