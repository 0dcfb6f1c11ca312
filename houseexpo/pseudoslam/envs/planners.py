"""Actions that planners use, as environments take them: a frontier out of a list, or a point of the map."""

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
from houseexpo.pseudoslam.config.planning import PlanningConfig
from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.kernels.planning.plan import (
    NO_CHOICE,
    OUTCOMES,
    STRAIGHT,
    Graph,
    PlanRules,
    Plans,
    new_graph,
    new_plans,
)
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.plan_rules import plan_rules
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.world import World

PlannerActions = Literal["frontier", "waypoint", "neighbour"]
Parts = dict[str, npt.NDArray[Any]]
FEATURES = 5
"""Of a frontier: metres ahead and to the left, of the way there, and along it; 1 where there is one, else all are 0."""
_FAR_M = 100_000.0  # no way on a grid of 1e8 cells is longer, or nobody goes it
_OUTCOMES = np.array(OUTCOMES, object)


@dataclass(frozen=True)
class PlannerSpec:
    """What an environment's actions are where each is a travel along the robot's own map.

    The robot goes by the shortest way over places where it may stand for what it knows, within its limits of turn and
    step, and looks as it goes. It stops where it arrives, where something is in its way, where the frontier is seen,
    where the task is fulfilled, and after ``planning.max_steps`` steps; one step is taken at least. An episode's time
    counts steps.

    Parameters
    ----------
    actions
        "frontier": a number, in the order of ``kernels.planning.frontiers``. The observation has "frontiers" (K, 5)
        float32, see ``FEATURES``, and "action_mask" (K,) int8, 1 where there is one. With a goal, the last is the goal,
        once the map shows a way to it. One that there is not means a turn to the left on the spot; where there is none
        at all, the mask allows the first. "waypoint": (ahead, left) in [-1, 1], as shares of ``planning.reach_m``. Of a
        point in a wall, in the unknown or out of reach, the nearest place is meant where the robot may stand and get
        to; ``info["moved_m"]`` says how far off that is. "neighbour": a number, one of the neighbours of the graph's
        first node; the observation has "action_mask", too.
    has_graph
        Whether the observation has a graph (``kernels.planning.graph``): "nodes" (M, 5) float32, metres ahead and to
        the left, metres of frontiers in sight, 1 where the robot has been, 1 for the robot's own, which is the first;
        "node_mask" (M,) int8, 1 where there is one; "edges" (M, k) int64, each node's neighbours, nearest first, and
        "edge_mask" (M, k) int8, 1 where there is one. What there is not is 0.
    """

    actions: PlannerActions
    planning: PlanningConfig
    config: SimulatorConfig
    has_graph: bool = False

    @property
    def choices(self) -> int:
        """How many frontiers there are to choose from, the goal included; 0 for other actions."""
        return self.planning.frontiers + (self.config.goal is not None) if self.actions == "frontier" else 0

    @property
    def numbers(self) -> int:
        """How many actions there are; 0 for waypoints."""
        return self.planning.neighbours if self.actions == "neighbour" else self.choices

    @cached_property
    def _reach_px(self) -> float:
        reach_m = self.planning.reach_m
        return self.config.side_px / 2 if reach_m is None else reach_m * self.config.pixels_per_metre

    def rules(self) -> PlanRules:
        """Return what is the same in all environments."""
        return plan_rules(self.config, self.planning, self.actions)

    def action_space(self) -> spaces.Space[Any]:
        """Return the space of one environment's actions."""
        return spaces.Discrete(self.numbers) if self.numbers else spaces.Box(-1.0, 1.0, (2,), np.float32)

    def spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return the spaces of what is observed beside the rest."""
        found: dict[str, spaces.Space[Any]] = {}
        if self.choices:
            found["frontiers"] = _features(self.choices, _FAR_M, _FAR_M)
        if self.has_graph:
            nodes, neighbours = self.planning.nodes, self.planning.neighbours
            found["nodes"] = _features(nodes, _FAR_M, 1.0)
            found["node_mask"] = spaces.MultiBinary(nodes)
            found["edges"] = spaces.Box(0, nodes - 1, (nodes, neighbours), np.int64)
            found["edge_mask"] = spaces.MultiBinary((nodes, neighbours))
        if self.numbers:
            found["action_mask"] = spaces.MultiBinary(self.numbers)
        return found

    def meant(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Return (N, 2) what the kernel takes for actions (N,) or (N, 2); ConfigError where there is no such action."""
        return self._numbered(values) if self.numbers else self._waypoints(values)

    def _numbered(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        flat = values.ravel()
        strange = (flat < 0) | (flat >= self.numbers) if flat.dtype.kind in "iu" else np.ones(flat.shape, bool)
        if strange.any():
            raise ConfigError(
                f"action: expected a {self.actions}'s number, 0 to {self.numbers - 1}, found {flat[strange].item(0)!r}"
            )
        found = np.zeros((len(flat), 2))
        found[:, 0] = flat
        return found

    def _waypoints(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        strange = ~((values >= -1) & (values <= 1)) if values.dtype.kind in "iuf" else np.ones(values.shape, bool)
        if strange.any():
            raise ConfigError(
                f"action: expected a waypoint (ahead, left), numbers from -1 to 1, found {values[strange].item(0)!r}"
            )
        found: npt.NDArray[np.float64] = values.reshape(-1, 2).astype(np.float64) * self._reach_px
        return found

    def graph(self) -> Graph:
        """Return the graph of an episode that begins."""
        planning = self.planning
        return new_graph(planning.nodes, planning.neighbours) if self.has_graph else new_graph(0, 0)

    def plans(self, state: State, world: World, task: Task) -> Plans:
        """Return the plans of an episode that begins."""
        plans, config = new_plans(self.choices), self.config
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
        """Return what is observed of a pool of episodes beside the rest."""
        found: Parts = {}
        cell_m = metrics.cell_m
        if self.choices:
            table = pool.plans.frontiers
            valid = table["goal"] != NO_CHOICE
            more = table["way"] * (cell_m / STRAIGHT), table["cells"] * cell_m, valid
            found["frontiers"] = _seen(table["middle"], valid, pool, metrics, more)
        if self.has_graph:
            nodes, edges = pool.graph.nodes, pool.graph.edges
            valid = nodes["cell"] >= 0
            more = nodes["utility"] * cell_m, nodes["visited"], np.arange(nodes.shape[1])[None] == 0
            found["nodes"] = _seen(nodes["cell"], valid, pool, metrics, more)
            found["node_mask"] = valid.view(np.int8)
            found["edges"] = np.maximum(edges, 0).astype(np.int64)
            found["edge_mask"] = (edges >= 0).view(np.int8)
        if self.numbers:
            found["action_mask"] = self.masks(pool).view(np.int8)
        return found

    def masks(self, pool: Episode) -> npt.NDArray[np.bool_]:
        """Return (N, K) which actions are allowed."""
        masks: npt.NDArray[np.bool_]
        masks = (
            pool.graph.edges[:, 0] >= 0 if self.actions == "neighbour" else pool.plans.frontiers["goal"] != NO_CHOICE
        )
        masks[:, 0] |= ~masks.any(axis=1)
        return masks

    def report(self, pool: Episode, cell_m: float) -> Parts:
        """Return what ``info`` says of the last actions: arrays of the caller's own."""
        state = pool.plans.state[:, 0]
        found: Parts = {
            "outcome": _OUTCOMES[state["outcome"]],
            "primitive_steps": state["steps"].copy(),
            "travelled_m": state["gone_px"] * cell_m,
        }
        return found if self.numbers else {**found, "moved_m": state["moved_px"] * cell_m}


def _features(number: int, third: float, fourth: float) -> spaces.Box:
    """Return the space of features of so many places: metres ahead and to the left, up to these, and up to 1."""
    low = np.tile(np.array([-_FAR_M, -_FAR_M, 0, 0, 0], np.float32), (number, 1))
    return spaces.Box(low, np.tile(np.array([_FAR_M, _FAR_M, third, fourth, 1], np.float32), (number, 1)))


def _seen(
    cells: npt.NDArray[Any],
    valid: npt.NDArray[np.bool_],
    pool: Episode,
    metrics: Metrics,
    more: tuple[npt.NDArray[Any], ...],
) -> npt.NDArray[np.float32]:
    """Return (N, K, 5) float32: metres ahead and to the left of cells (N, K), and more; 0 where they are not valid."""
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
    """Return how a planner acts; None where actions are single steps. ConfigError where that cannot be."""
    if planning is not None and not isinstance(planning, PlanningConfig):
        raise ConfigError(f"planning: expected a PlanningConfig or None, found {planning!r}")
    names = get_args(PlannerActions)
    if actions not in names:
        for given, what in ((planning is not None, "planning"), (observation == "graph", "observation='graph'")):
            if given:
                raise ConfigError(f"{what}: it goes with actions {', '.join(names)}; found actions={actions!r}")
        return None
    if actions == "neighbour" and observation != "graph":
        raise ConfigError(f"actions='neighbour': expected observation='graph', found {observation!r}")
    if not task.rewards_add_up:
        raise ConfigError(
            f"actions={actions!r}: one such action is many steps, and the rewards of {type(task).__name__} as it is "
            "configured do not add up over steps; use single steps, or another task or reward"
        )
    name: Any = actions
    return PlannerSpec(name, planning or PlanningConfig(), config, observation == "graph")
