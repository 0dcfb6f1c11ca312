"""Let a policy of the benchmark drive a robot of a fleet by velocities, as it drives in an episode of the benchmark.

R1  The policy is that of an episode of the track ``quality`` from the robot's start: its first map, its seed, its
    observations and its steps are those of ``houseexpo benchmark run``, as long as nothing else moves the robot.
R2  A step is driven as velocities: the turn, then the way, each at the speed of a step in ``step_s``; a step on which
    the robot stays where it is takes ``step_s`` too.
R3  Where the robot is not where the step should have brought it (a person stood in the way, somebody drove it or put it
    elsewhere), or obstacles have moved, it first looks from where it is, which counts as a step.
R4  While somebody else drives, it looks each ``step_s``, so that its map grows; its next decision is made afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.pseudoslam.agents.loading import NamedPolicy, describe_exception, describe_no_policy
from houseexpo.pseudoslam.agents.protocol import Interface, make_knowledge
from houseexpo.pseudoslam.benchmark.episodes import start_policy
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.io.poses import Pose, wrap_angle
from houseexpo.pseudoslam.ros.fleet import Fleet, Velocity
from houseexpo.pseudoslam.simulator import OccupancyGrid
from houseexpo.pseudoslam.worlds.maps import House
from houseexpo.words import count_noun

TRACK: Final = find_track("quality")
_SAME_POSE: Final = 1e-6
"""Metres and radians; a step that is driven in parts ends some 1e-14 m from where it ends in one, at walls 1e-9 m."""


def check_interface(policy: NamedPolicy) -> None:
    """Raise ConfigError if a policy cannot drive a robot that explores by velocities."""
    wanted = policy.interface
    if wanted.tasks and TRACK.task not in wanted.tasks:
        tasks = ", ".join(wanted.tasks)
        raise ConfigError(f"policy {policy.name!r}: expected one that explores, found one for {tasks}")
    if wanted.actions not in {"discrete", "continuous"}:
        raise ConfigError(
            f"policy {policy.name!r}: expected one whose actions are turns and ways ('discrete' or 'continuous'), "
            f"found {wanted.actions!r}, which a planner carries out; `houseexpo record --policy` shows such a policy"
        )


def first_pose(house: House, config: SimulatorConfig, seed: int) -> Pose:
    """Return the start of an episode of the benchmark with a seed: x, y in the plan's metres, and the heading."""
    env = _environment(house, config, Interface())
    env.reset(seed=seed)
    return env.simulator.pose(env.state)


def _environment(house: House, config: SimulatorConfig, interface: Interface) -> PseudoSlamEnv:
    alone = replace(config, people=PeopleConfig(), obstacles=ObstaclesConfig())  # those of the fleet are met there
    houses: Any = [house]
    return replace(TRACK, config=alone).environment(houses, interface)


class PolicyDriver:
    """A policy that drives a robot of a fleet.

    Parameters
    ----------
    policy
        One that ``check_interface`` accepts.
    robot
        The robot's number in the fleet.
    seed
        The seed of the episode.
    step_s
        The time of a step, seconds.
    say
        Called with a sentence when the policy is done.

    Raises
    ------
    PolicyError
        Here and in ``velocity``: the policy failed.
    """

    def __init__(
        self,
        policy: NamedPolicy,
        fleet: Fleet,
        robot: int,
        *,
        seed: int,
        step_s: float,
        say: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._named, self._fleet, self._robot, self._step_s, self._say = policy, fleet, robot, step_s, say
        self._env = _environment(fleet.plan, replace(fleet.config, step_s=step_s), policy.interface)
        self._observation, self._info = self._env.reset(seed=seed)
        if not self._is_there():
            self._observation, self._info = self._env.reset(seed=seed, options={"pose": fleet.pose(robot)})
        self._policy = self._ask(lambda: start_policy(policy, self._env))
        if not callable(self._policy):
            raise PolicyError(f"{self._where()}: {describe_no_policy(policy, self._policy)}")
        self._velocities: list[Velocity] = []
        self._waited_ticks = 0
        self.is_done = False

    @property
    def coverage(self) -> float:
        """The share of the house that is seen, 0 to 1."""
        return float(self._info["coverage"])

    def map(self) -> OccupancyGrid:
        """Return the map that the policy sees."""
        return self._env.simulator.map(self._env.state)

    def velocity(self) -> Velocity:
        """Return the robot's velocity for the next tick."""
        self._waited_ticks = 0
        if not self._velocities and not self.is_done:
            self._decide()
        return self._velocities.pop(0) if self._velocities else Velocity()

    def give_way(self) -> None:
        """Take note of a tick in which somebody else drives (R4)."""
        self._velocities.clear()
        self._waited_ticks += 1
        if self._waited_ticks >= round(self._step_s / self._fleet.tick_s):
            self._waited_ticks = 0
            self._look()

    def _is_there(self) -> bool:
        """Return whether the robot is where its episode has it."""
        x, y, heading = self._env.simulator.pose(self._env.state)
        at = self._fleet.pose(self._robot)
        return math.hypot(at[0] - x, at[1] - y) < _SAME_POSE and abs(wrap_angle(at[2] - heading)) < _SAME_POSE

    def _look(self) -> None:
        occupied = self._fleet.occupied(self._robot)  # R3
        if not (self._is_there() and np.array_equal(occupied, self._env.state.occupied)):
            self._observation, self._info = self._env.look_from(self._fleet.pose(self._robot), occupied)

    def _decide(self) -> None:
        self._look()
        action = self._ask(
            lambda: self._policy(self._observation, make_knowledge(self._env.simulator, self._env.state))
        )
        if action is None:
            self._end()
            return
        try:
            self._observation, _, terminated, truncated, self._info = self._env.step(action)
        except ConfigError as error:
            raise PolicyError(f"{self._where()}: {error}") from None
        self._velocities = self._drive(self._fleet.pose(self._robot), self._env.simulator.pose(self._env.state))
        if terminated or truncated:
            self._end()

    def _drive(self, before: Pose, after: Pose) -> list[Velocity]:
        """Return the velocities, one for each tick, of a step from a pose to another (R2)."""
        tick_s, robot = self._fleet.tick_s, self._env.config.robot
        turn = wrap_angle(after[2] - before[2])
        way = (after[0] - before[0]) * math.cos(after[2]) + (after[1] - before[1]) * math.sin(after[2])
        turning = self._ticks(abs(turn) / math.radians(robot.turn_deg))
        going = self._ticks(abs(way) / robot.step_m)
        turns = [Velocity(turn_rad_s=turn / (max(turning, 1) * tick_s))] * turning
        ways = [Velocity(ahead_m_s=way / (max(going, 1) * tick_s))] * going
        return turns + ways or [Velocity()] * self._ticks(1.0)

    def _ticks(self, steps: float) -> int:
        """Return the ticks that a share of a step takes."""
        return math.ceil(steps * self._step_s / self._fleet.tick_s - _SAME_POSE)

    def _end(self) -> None:
        self.is_done = True
        state = self._env.state
        path_m = float(state.episode.readings[0].path_length) / self._env.config.pixels_per_metre
        self._say(
            f"robot {self._robot + 1}: policy {self._named.name!r} is done: {self.coverage:.1%} seen in "
            f"{count_noun(int(state.counts.steps), 'step')}, {path_m:.1f} m, "
            f"{count_noun(int(self._info['collisions']), 'collision')}"
        )

    def _ask(self, question: Callable[[], Any]) -> Any:
        try:
            return question()
        except (Exception, SystemExit) as error:
            raise PolicyError(f"{self._where()}: it raised {describe_exception(error, __file__)}") from error

    def _where(self) -> str:
        return f"policy {self._named.name!r}: plan {self._fleet.plan.id!r}, step {int(self._env.state.counts.steps)}"
