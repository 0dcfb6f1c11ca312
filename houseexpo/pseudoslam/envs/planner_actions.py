"""Define the space and the observations of actions that are travels of many steps, to a frontier."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

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
    PlannerMemory,
    PlannerRules,
    new_planner_memory,
)
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.planning import planner_rules
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.tasks import Task
from houseexpo.pseudoslam.worlds.world import World

Parts = dict[str, npt.NDArray[Any]]
FEATURES = 5
"""Features of a frontier: metres ahead, to the left, of the path to it and of its length, and 1; all 0 for none."""
_LONGER_THAN_ANY_WAY_M = 100_000.0  # longer than any path that a robot takes on a grid of 1e8 cells
_OUTCOMES = np.array(OUTCOMES, object)


@dataclass(frozen=True)
class PlannerSpec:
    """The actions of an environment in which each action is a travel on the robot's own map, to a frontier.

    The robot follows the shortest path through places where, according to its map, it can stand, within its limits of
    turn and step, and scans as it goes. It stops when it arrives, when an obstacle blocks it, when the frontier is
    seen, when the task is fulfilled, and after ``planning.max_steps`` steps; it takes at least one step. The time limit
    of an episode counts steps.

    An action is an index in the order of ``kernels.planning.frontiers``. The observation has "frontiers" (K, 5) float32
    (see ``FEATURES``) and "action_mask" (K,) int8, 1 for those that exist. With a goal, the last entry is the goal,
    once the map shows a path to it. An entry that does not exist means a turn to the left in place; if there is none,
    the mask allows the first.
    """

    planning: PlanningConfig
    config: SimulatorConfig

    @property
    def choices(self) -> int:
        """The number of frontiers to choose from, including the goal."""
        return self.planning.frontiers + (self.config.goal is not None)

    def rules(self) -> PlannerRules:
        """Return the parameters that are the same in all environments."""
        return planner_rules(self.config, self.planning)

    def action_space(self) -> spaces.Discrete:
        """Return the space of one environment's actions."""
        return spaces.Discrete(self.choices)

    def spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return the spaces of the planner's parts of the observation."""
        far = _LONGER_THAN_ANY_WAY_M
        low = np.tile(np.array([-far, -far, 0, 0, 0], np.float32), (self.choices, 1))
        high = np.tile(np.array([far, far, far, far, 1], np.float32), (self.choices, 1))
        return {"frontiers": spaces.Box(low, high), "action_mask": spaces.MultiBinary(self.choices)}

    def kernel_actions(self, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Return the kernel's form (N, 2) of actions (N,); raise ConfigError for an invalid action."""
        flat = values.ravel()
        strange = (flat < 0) | (flat >= self.choices) if flat.dtype.kind in "iu" else np.ones(flat.shape, bool)
        if strange.any():
            raise ConfigError(
                f"action: expected the number of a frontier, 0 to {self.choices - 1}, found {flat[strange].item(0)!r}"
            )
        found = np.zeros((len(flat), 2))
        found[:, 0] = flat
        return found

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
        table, cols, cell_m = pool.plans.frontiers, pool.plans.state["cols"], metrics.cell_m
        x, y, heading = (part[:, None] for part in metrics.pose_px[:, 3:].T)
        cells, valid = table["middle"], table["goal"] != NO_CHOICE
        right, up = (cells % cols + 0.5 - x) * cell_m, (y - cells // cols - 0.5) * cell_m
        cos, sin = np.cos(heading), np.sin(heading)
        places = right * cos + up * sin, up * cos - right * sin
        features = np.stack((*places, table["way"] * (cell_m / STRAIGHT), table["cells"] * cell_m, valid), axis=2)
        features[~valid] = 0.0
        return {"frontiers": features.astype(np.float32), "action_mask": self.masks(pool).view(np.int8)}

    def masks(self, pool: Episode) -> npt.NDArray[np.bool_]:
        """Return the mask of allowed actions (N, K)."""
        masks: npt.NDArray[np.bool_] = pool.plans.frontiers["goal"] != NO_CHOICE
        masks[:, 0] |= ~masks.any(axis=1)
        return masks

    def report(self, pool: Episode, cell_m: float) -> Parts:
        """Return the entries of ``info`` on the last actions, as new arrays."""
        state = pool.plans.state[:, 0]
        return {
            "outcome": _OUTCOMES[state["outcome"]],
            "primitive_steps": state["steps"].copy(),
            "travelled_m": state["gone_px"] * cell_m,
        }


def make_planner_spec(
    actions: str, planning: PlanningConfig | None, config: SimulatorConfig, task: Task
) -> PlannerSpec | None:
    """Return the planner's specification, None if actions are single steps; raise ConfigError if it is invalid."""
    if planning is not None and not isinstance(planning, PlanningConfig):
        raise ConfigError(f"planning: expected a PlanningConfig or None, found {planning!r}")
    if actions != "frontier":
        if planning is not None:
            raise ConfigError(f"planning: expected actions='frontier', found actions={actions!r}")
        return None
    if not task.rewards_add_up:
        raise ConfigError(
            f"actions={actions!r}: one such action is many steps, and the rewards of {type(task).__name__} as it is "
            "configured do not add up over steps; use single steps, or another task or reward"
        )
    if config.goal_region:
        raise ConfigError(
            f"actions={actions!r}: expected a goal that is a place, found goal.kind={config.goal_region.kind!r}"
        )
    return PlannerSpec(planning or PlanningConfig(), config)
