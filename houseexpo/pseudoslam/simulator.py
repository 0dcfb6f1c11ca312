"""The simulator: a robot that moves in a world, looks, and draws its map. It knows no gymnasium."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.plan import FloorPlan
from houseexpo.pseudoslam.config import SimulatorConfig, StartConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.motion import disc_is_free
from houseexpo.pseudoslam.kernels.step import COLLISIONS, COVERED, KNOWN, STEPS, transition
from houseexpo.pseudoslam.laser import Laser
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.world import World, make_world

Action = Literal["forward", "left", "right"]
ACTIONS: tuple[Action, ...] = get_args(Action)

_BETWEEN_M, _BETWEEN_RAD = 0.3, math.radians(10.0)  # a robot looks at least so often on its way


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A map as ROS publishes it: ``data`` (rows, cols) int8, -1 unknown, 0 free, 100 occupied, row 0 at the lowest y.

    ``resolution`` is metres a cell, ``origin`` the plan's (x, y) of the lower-left corner of the first cell.
    """

    data: npt.NDArray[np.int8]
    resolution: float
    origin: tuple[float, float]


class Simulator:
    """One robot in one world.

    ``start(rng)`` and ``step(state, action, rng)`` depend on nothing but their arguments, the world and the
    configuration: equal seeds give equal bytes. One object serves one thread, for it keeps scratch memory.

    Examples
    --------
    >>> plan = FloorPlan("square", [(0, 0), (0, 4), (4, 4), (4, 0)], 1, {})
    >>> simulator = Simulator.of(plan, SimulatorConfig())
    >>> rng = np.random.default_rng(0)
    >>> state = simulator.start(rng)
    >>> for action in ["left"] * 36:
    ...     simulator.step(state, action, rng)
    >>> simulator.coverage(state)
    1.0
    """

    def __init__(self, world: World, config: SimulatorConfig) -> None:
        self.world, self.config = world, config
        self._laser = Laser(config)
        self._ppm = config.pixels_per_metre
        self._radius_px = config.robot.radius_m * self._ppm
        self._moves: dict[str, tuple[float, float]] = {
            "forward": (0.0, config.robot.step_m),
            "left": (math.radians(config.robot.turn_deg), 0.0),
            "right": (-math.radians(config.robot.turn_deg), 0.0),
        }

    @classmethod
    def of(cls, plan: FloorPlan, config: SimulatorConfig) -> Simulator:
        """Return the simulator of a plan; ConfigError and PlanError as ``make_world`` raises them."""
        robot, laser = config.robot, config.laser
        return cls(make_world(plan, config.pixels_per_metre, robot.radius_m, laser.range_m), config)

    def start(self, rng: np.random.Generator) -> State:
        """Return the state at the start of an episode, after a first look round.

        Raises
        ------
        ConfigError
            Where ``start`` names a pose at which the robot does not fit, or from which it cannot reach the rest.
        """
        known = np.zeros(self.world.solid.shape, np.uint8)
        counts = np.zeros(4, np.int64)
        if self.config.known_map:
            known = np.where(self.world.solid != 0, OBSTACLE, FREE).astype(np.uint8)
            counts[KNOWN], counts[COVERED] = known.size, self.world.countable_cells
        pose = self._random_pose(rng) if self.config.start.random else self._given_pose(self.config.start)
        side = self.config.side_px
        state = State(pose, known, np.empty((side, side), np.uint8), counts)
        self._transit(state, 0.0, 0.0, rng)
        return state

    def step(self, state: State, action: Action, rng: np.random.Generator) -> None:
        """Change a state by one action; ConfigError where there is no such action."""
        if action not in self._moves:
            raise ConfigError(f"action: expected one of {', '.join(ACTIONS)}; found {action!r}")
        self.move(state, *self._moves[action], rng)

    def move(self, state: State, turn_rad: float, forward_m: float, rng: np.random.Generator) -> None:
        """Change a state by a turn and then a way straight on, each executed exactly unless something is in the way.

        Then the robot stops where it touches, and ``state.blocked`` says so until the next step.
        """
        if not (math.isfinite(turn_rad) and math.isfinite(forward_m)):
            raise ConfigError(f"action: expected finite numbers, found a turn of {turn_rad!r} and {forward_m!r} m")
        state.blocked = self._transit(state, turn_rad, forward_m, rng)
        state.counts[STEPS] += 1
        state.counts[COLLISIONS] += state.blocked

    def _transit(self, state: State, turn_rad: float, forward_m: float, rng: np.random.Generator) -> bool:
        scans = math.ceil(abs(turn_rad) / _BETWEEN_RAD) + math.ceil(abs(forward_m) / _BETWEEN_M) + 1
        shifts, error = self._laser.draw(scans, rng)
        return transition(
            self.world.solid, self.world.countable, state.known, state.pose_px, state.counts, state.view,
            turn_rad, forward_m * self._ppm, self._radius_px, _BETWEEN_M * self._ppm, _BETWEEN_RAD,
            *self._laser.fan, self.config.noise.any, shifts, error, *self._laser.scratch,
        )  # fmt: skip

    def _random_pose(self, rng: np.random.Generator) -> npt.NDArray[np.float64]:
        """Anywhere in a standing cell; in its middle where the robot would touch something else."""
        cells = np.flatnonzero(self.world.stand)
        row, col = divmod(int(cells[rng.integers(len(cells))]), self.world.stand.shape[1])
        right, down, heading = rng.random(3)
        if not disc_is_free(self.world.solid, col + right, row + down, self._radius_px):
            right, down = 0.5, 0.5
        return np.array([col + right, row + down, (2.0 * heading - 1.0) * math.pi])

    def _given_pose(self, start: StartConfig) -> npt.NDArray[np.float64]:
        x_m, y_m = start.x_m, start.y_m
        frame = self.world.frame
        if start.origin == "centre":
            centre = frame.points_from_pixels([frame.shape[1] / 2, frame.shape[0] / 2])
            x_m, y_m = x_m + float(centre[0]), y_m + float(centre[1])
        x, y = frame.pixels_from_points([x_m, y_m]).tolist()
        row, col = math.floor(y), math.floor(x)
        if not bool(frame.contains([row, col])) or not disc_is_free(self.world.solid, x, y, self._radius_px):
            raise ConfigError(
                f"start: a robot of radius {self.config.robot.radius_m:g} m does not fit at ({x_m:g}, {y_m:g}) m "
                f"in plan {self.world.plan_id!r}; start at random, or at another pose"
            )
        if not self.world.stand[row - 1 : row + 2, col - 1 : col + 2].any():
            raise ConfigError(
                f"start: a robot of radius {self.config.robot.radius_m:g} m cannot leave the place at "
                f"({x_m:g}, {y_m:g}) m for the biggest part of plan {self.world.plan_id!r}; start at random, or there"
            )
        return np.array([x, y, math.radians(start.heading_deg)])

    def pose(self, state: State) -> tuple[float, float, float]:
        """Return (x, y) in the plan's metres and the heading in radians, counter-clockwise from x."""
        x, y = self.world.frame.points_from_pixels(state.pose_px[:2]).tolist()
        return x, y, float(state.pose_px[2])

    def explored_m2(self, state: State) -> float:
        """Return the area of the map that is known, obstacles included."""
        return float(state.counts[KNOWN]) / self._ppm**2

    def coverage(self, state: State) -> float:
        """Return how much is known of the free cells that the robot can see from where it can go, 0 to 1."""
        return float(state.counts[COVERED]) / self.world.countable_cells

    def map(self, state: State) -> OccupancyGrid:
        """Return the map as ROS publishes it."""
        values = np.full(256, -1, np.int8)
        values[[UNKNOWN, FREE, OBSTACLE]] = -1, 0, 100
        frame = self.world.frame
        return OccupancyGrid(values[state.known[::-1]], frame.cell_m, frame.origin_m)
