"""Many explorations as compiled code, for training and evaluation (``kernels.explore``)."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.explore import ERRAND, Course, Errand, ExplorerRules, explore
from houseexpo.pseudoslam.kernels.planning.outlook import LOOKED_AT, OUTLOOKS
from houseexpo.pseudoslam.kernels.planning.plan import FRONTIER
from houseexpo.pseudoslam.kernels.types import Floats
from houseexpo.pseudoslam.plan_rules import (
    ENOUGH,
    MAX_BUMPS,
    MAX_FRONTIERS,
    explorer_frontiers,
    first_looks,
    outlook_rules,
)
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_params import scratch_of, step_params_of, with_room

SEEN = 0.9
"""Coverage up to which distances and steps are counted."""
_FAR_M, _LONG = 150.0, 1000
"""Metres and steps charged for a house when time is up, in proportion to the part that is not explored."""
_GIVEN_UP = 256


@dataclass
class Walk:
    """The state of an exploration."""

    state: State
    errand: Errand
    course: Course

    def copy(self) -> Walk:
        """Return an independent copy; constant parts are shared."""
        changed = {name: getattr(self.state.episode, name).copy() for name in ("known", "pose", "counts", "readings")}
        state = State(self.state.episode._replace(**changed), self.state.observable_cells)
        errand, course = copy.deepcopy(self.errand), copy.deepcopy(self.course)
        return Walk(state, errand, course)

    @property
    def steps(self) -> int:
        """Number of steps so far."""
        return int(self.state.counts.steps)

    @property
    def coverage(self) -> float:
        """The explored share of the observable cells, 0 to 1."""
        return float(self.state.counts.covered) / self.state.observable_cells


class Explorations:
    """Explores houses with a limited number of steps; each thread needs its own object.

    Parameters
    ----------
    config
        The robot, its sensor, which must scan sectors without noise, and the resolution.
    most_steps
        The largest number of steps.
    """

    def __init__(self, config: SimulatorConfig, most_steps: int) -> None:
        if config.laser.rule != "sector" or config.noise.any or config.people.number or config.trajectories:
            raise ConfigError("explorations: expected a sensor without errors that looks at sectors, and nobody else")
        ppm = float(config.pixels_per_metre)
        self.config, self.most_steps = config, most_steps
        self._params, self._scratch = step_params_of(config), scratch_of(config)
        self._rules = ExplorerRules(
            float(config.robot.step_m * ppm), math.radians(config.robot.turn_deg), ENOUGH, MAX_BUMPS,
            explorer_frontiers(config), outlook_rules(config),
        )  # fmt: skip

    def begin(self, plan: FloorPlan, rng: np.random.Generator) -> Walk:
        """Return a new exploration."""
        simulator = Simulator.of(plan, self.config)
        self._scratch = with_room(self._scratch, simulator.world.occupied.size)
        state = simulator.start(rng)
        errand = Errand(
            np.array([(first_looks(self.config), 0, -1, 0)], ERRAND), np.zeros(_GIVEN_UP, np.int32),
            np.zeros(MAX_FRONTIERS, FRONTIER), np.zeros((LOOKED_AT, len(OUTLOOKS))), np.zeros(LOOKED_AT),
        )  # fmt: skip
        course = Course(np.zeros(self.most_steps + 1, np.int64), np.zeros(self.most_steps + 1))
        course.covered[0] = state.counts.covered
        return Walk(state, errand, course)

    def go(self, walk: Walk, weights: Floats, seen: float = SEEN) -> int:
        """Continue until this share is explored; see ``kernels.explore.explore``."""
        enough = math.ceil(seen * walk.state.observable_cells)
        return int(
            explore(
                walk.state.pool, walk.state.sizes, walk.errand, weights, self._rules, self._params, self._scratch,
                enough, walk.course,
            )
        )  # fmt: skip

    def way(self, plan: FloorPlan, rng: np.random.Generator, *each: Floats) -> Floats:
        """Return the metres and the steps to 90% (n, 2), for each of n weights from the same start.

        If 90% is not reached, the rest is charged for.
        """
        begun, found = self.begin(plan, rng), np.zeros((len(each), 2))
        for n, weights in enumerate(each):
            walk = begun.copy()
            self.go(walk, weights)
            left = max(SEEN - walk.coverage, 0.0)
            gone_m = walk.course.gone_px[walk.steps] / self.config.pixels_per_metre
            found[n] = gone_m + _FAR_M * left, walk.steps + _LONG * left
        return found
