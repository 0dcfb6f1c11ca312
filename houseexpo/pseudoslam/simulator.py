"""Simulate one robot that moves in a world, scans it and builds a map. This does not depend on gymnasium."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import FURTHEST_M, Differential, SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import StepParams
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.types import Scratch
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_kernels import (
    make_scratch,
    make_step_params,
    step_episode,
    take_first_scan,
)
from houseexpo.pseudoslam.worlds.cache import world_for
from houseexpo.pseudoslam.worlds.maps import House
from houseexpo.pseudoslam.worlds.reset import make_initial_state
from houseexpo.pseudoslam.worlds.world import World

Action = Literal["forward", "left", "right"]
ACTIONS: tuple[Action, ...] = get_args(Action)


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A map in the form of ROS: ``data`` (rows, cols) int8, -1 unknown, 0 free, 100 occupied, row 0 at the lowest y.

    ``resolution`` is in metres per cell; ``origin`` is the lower-left corner of the first cell, (x, y) in the plan's
    metres.
    """

    data: npt.NDArray[np.int8]
    resolution: float
    origin: tuple[float, float]


class Simulator:
    """A simulator of one robot in one world.

    ``start(rng)`` draws all random values of an episode, including the key of its noise. After that,
    ``step(state, action)`` depends only on its arguments, so that equal seeds give equal bytes. Each thread needs its
    own simulator, since it contains working memory.

    Examples
    --------
    >>> from houseexpo import FloorPlan
    >>> plan = FloorPlan("square", [(0, 0), (0, 4), (4, 4), (4, 0)], 1, {})
    >>> simulator = Simulator.of(plan, SimulatorConfig())
    >>> state = simulator.start(np.random.default_rng(0))
    >>> for action in ["left"] * 36:
    ...     simulator.step(state, action)
    >>> simulator.coverage(state)
    1.0
    """

    def __init__(
        self, world: World, config: SimulatorConfig, params: StepParams | None = None, scratch: Scratch | None = None
    ) -> None:
        self.world, self.config = world, config
        self.params = params or make_step_params(config)
        self._scratch = scratch or make_scratch(config)
        self._ppm = config.pixels_per_metre
        self._moves = action_motions(config)

    @classmethod
    def of(cls, plan: House, config: SimulatorConfig) -> Simulator:
        """Return the simulator of a plan or a map; raise ConfigError or PlanError like ``world_for``."""
        return cls(world_for(plan, config), config)

    def start(self, rng: np.random.Generator) -> State:
        """Return the state at the start of an episode, after the first scan.

        Raises
        ------
        ConfigError
            ``start``, ``goal``, ``obstacles``, ``people`` or ``trajectories`` of the configuration are not possible in
            this house.
        """
        state = make_initial_state(self.world, self.config, self.params, self._scratch, rng)
        take_first_scan(state, self.params, self._scratch)
        return state

    def step(self, state: State, action: Action) -> None:
        """Apply one action to a state, in place; raise ConfigError if there is no such action."""
        if action not in self._moves:
            raise ConfigError(f"action: expected one of {', '.join(ACTIONS)}; found {action!r}")
        self.move(state, *self._moves[action])

    def move(self, state: State, turn_rad: float, forward_m: float) -> None:
        """Turn the robot and then move it straight on, in place; exact without ``noise.slip`` and if nothing blocks it.

        A blocked robot stops at the obstacle, and ``state.blocked`` is true until the next step.
        """
        if self.config.robot.drive:
            motion = self.config.robot.motion
            raise ConfigError(f"action: a robot with the motion {motion!r} takes commands; call drive() instead")
        if not (abs(turn_rad) <= 2 * math.pi and abs(forward_m) <= FURTHEST_M):
            raise ConfigError(
                f"action: expected at most a full turn and {FURTHEST_M:g} m, "
                f"found a turn of {turn_rad!r} and {forward_m!r} m"
            )
        step_episode(state, np.array([[float(turn_rad), float(forward_m * self._ppm)]]), self.params, self._scratch)

    def drive(self, state: State, speed_m_s: float, turning: float) -> None:
        """Let a robot with a drive follow a command for ``config.step_s``; changes the state.

        A robot that something blocks stops there, its speed is 0, and ``state.blocked`` is true until the next step. A
        differential drive goes on turning.

        Parameters
        ----------
        speed_m_s
            Speed, negative for backward.
        turning
            Speed of turning to the left, radians per second, or a car's steering angle, radians.

        Raises
        ------
        ConfigError
            The robot has no drive, or the command exceeds its limits.
        """
        drive = self.config.robot.drive
        if drive is None:
            raise ConfigError("drive: expected a robot with a drive, found none; set robot.drive, or use move()")
        if not (abs(speed_m_s) <= drive.max_speed_m_s and abs(turning) <= drive.most_turning):
            unit = "rad/s" if isinstance(drive, Differential) else "rad"
            raise ConfigError(
                f"drive: expected at most {drive.max_speed_m_s:g} m/s and {drive.most_turning:g} {unit}, "
                f"found {speed_m_s!r} and {turning!r}"
            )
        command = np.array([[speed_m_s * self._ppm, turning, math.inf]])
        step_episode(state, command, self.params, self._scratch)

    def velocity(self, state: State) -> tuple[float, float]:
        """Return a drive's velocity: m/s, and rad/s or the steering angle in radians."""
        readings = state.episode.readings[0]
        return float(readings.speed) / self._ppm, float(readings.turning)

    def pose(self, state: State) -> tuple[float, float, float]:
        """Return the pose: (x, y) in the plan's metres, and the heading in radians, counter-clockwise from x."""
        return self._in_metres(state.pose_px)

    def believed_pose(self, state: State) -> tuple[float, float, float]:
        """Return the pose according to odometry, in the units of ``pose``; without odometry noise they are equal."""
        return self._in_metres(state.believed_px)

    def _in_metres(self, pose_px: npt.NDArray[np.float64]) -> tuple[float, float, float]:
        across, down, heading = pose_px.tolist()
        return *self.world.frame.point_from_pixel(across, down), heading

    def explored_m2(self, state: State) -> float:
        """Return the known area of the map, including obstacles, m2."""
        return float(state.counts.known) / self._ppm**2

    def coverage(self, state: State) -> float:
        """Return the known share of the free cells that the robot can see from the places it can reach, 0 to 1."""
        return float(state.counts.covered) / max(state.observable_cells, 1)

    def map(self, state: State) -> OccupancyGrid:
        """Return the map in the form of ROS."""
        values = np.full(256, -1, np.int8)
        values[[UNKNOWN, FREE, OBSTACLE]] = -1, 0, 100
        frame = self.world.frame
        return OccupancyGrid(values[state.known[::-1]], frame.cell_m, frame.origin_m)


def action_motions(config: SimulatorConfig) -> dict[str, tuple[float, float]]:
    """Return for each action its turn in radians and its distance forward in metres."""
    turn = math.radians(config.robot.turn_deg)
    return {"forward": (0.0, config.robot.step_m), "left": (turn, 0.0), "right": (-turn, 0.0)}
