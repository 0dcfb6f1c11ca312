"""Define the interface of policies, which are created for each episode and choose actions from what the robot knows.

A *factory* ``factory(robot, seed)``, a class or a function, returns a policy. A *policy* is a function
``policy(observation, info)`` of the environment's observation and a ``Knowledge``. It returns an action of the
environment, or None when it is done. A factory may have an attribute ``interface``, which declares its observations and
actions, and an attribute ``training``, which names the family of policies that differ only in the seed of their
training. A policy may have an attribute ``decided``, which is False if its last action only continued an earlier
decision.

A policy sees the robot's own map, but no ground truth: neither the house's id, nor its walls, nor the explored share.
Only a policy whose interface has ``sees_truth`` is given the world, and results state this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NotRequired, Protocol, TypeAlias, TypedDict, get_args

import gymnasium
import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_one_of
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.envs.spec import Actions, Kind
from houseexpo.pseudoslam.kernels.mapping import UNKNOWN
from houseexpo.pseudoslam.render.sight import measure_sight
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.world import World


class Knowledge(TypedDict):
    """The knowledge of the robot, as copies that the policy may keep and change."""

    map: npt.NDArray[np.uint8]
    """The map (rows, cols): 0 unknown, 127 free, 255 obstacle; row 0 at the highest y."""
    pose_px: npt.NDArray[np.float64]
    """The pose by odometry (3,): x across and y down in cells of the map, heading in radians, counter-clockwise."""
    collided: bool
    """Whether an obstacle blocked the last action."""
    steps: int
    """Number of steps so far."""
    path_m: float
    """Distance travelled so far."""
    goal_px: NotRequired[npt.NDArray[np.float64]]
    """The goal on the map (2,), if it is a place."""
    moving_px: NotRequired[npt.NDArray[np.float64]]
    """(n, 5), what moves and a beam hits, as a robot that tracks it knows it, if anything can move in the task: x, y
    and radius in cells of the map, and the velocity of people, x across and y down, in cells per second."""
    goal_name: NotRequired[str]
    """The goal's kind of room or furniture, if it is one."""
    goal_map: NotRequired[npt.NDArray[np.uint8]]
    """(rows, cols), 1 for known cells that belong to such a room or piece: what a robot that recognises them sees."""
    room_map: NotRequired[npt.NDArray[np.uint8]]
    """With ``goal_name``: (rows, cols), 1 plus the place in ``LABELS`` of the room of each known cell, otherwise 0."""


@dataclass(frozen=True)
class Interface:
    """The observations and actions that a policy needs.

    Parameters
    ----------
    actions, observation
        Arguments of the environment.
    view
        The view around the robot in observations; None for the task's. The sensor and the map are always the task's.
    sees_truth
        Whether the policy needs ``Robot.world``.
    tasks
        The tasks of the benchmark that the policy can do; empty for all.
    action_mask
        Whether the observation also has the mask of motions ("action_mask"), an argument of the environment.
    """

    actions: Actions = "discrete"
    observation: Kind = "map"
    view: ObservationConfig | None = None
    sees_truth: bool = False
    tasks: tuple[str, ...] = ()
    action_mask: bool = False

    def __post_init__(self) -> None:
        for name, kinds in (("actions", Actions), ("observation", Kind)):
            check_one_of(getattr(self, name), f"interface.{name}", get_args(kinds))


@dataclass(frozen=True)
class Training:
    """The training of a policy; results of one ``family`` with several seeds are one row of a table."""

    family: str
    seed: int


@dataclass(frozen=True)
class Robot:
    """The argument of a factory: the configuration, the spaces and, with ``sees_truth``, the world."""

    config: SimulatorConfig
    action_space: gymnasium.Space[Any] | None = None
    observation_space: gymnasium.Space[Any] | None = None
    world: World | None = None


class Policy(Protocol):
    """A policy, which chooses the actions of an episode."""

    def __call__(self, observation: Any, info: Knowledge, /) -> Any:
        """Return an action of the environment, or None when the policy is done."""


PolicyFactory: TypeAlias = Callable[[Robot, int], Policy]


def check_goal(robot: Robot, *, place: bool) -> None:
    """Raise ConfigError unless the task's goal is a place or, otherwise, a kind of room or furniture."""
    found = robot.config.goal_place if place else robot.config.goal_region
    if found is None:
        wanted, kind = ("a place", "place") if place else ("a kind of room or furniture", "room or object")
        here = robot.config.goal.kind if robot.config.goal else "none"
        raise ConfigError(f"goal: this policy expects {wanted} (goal.kind {kind}), found {here}")


def read_interface(factory: PolicyFactory) -> Interface:
    """Return the interface of a factory's policies; raise ConfigError if its attribute is of another type."""
    found = getattr(factory, "interface", Interface())
    if not isinstance(found, Interface):
        raise ConfigError(f"policy: expected its attribute 'interface' to be an Interface, found {found!r}")
    return found


def read_training(factory: PolicyFactory) -> Training | None:
    """Return the training of a factory's policies, or None without training; raise ConfigError for another type."""
    found = getattr(factory, "training", None)
    if found is not None and not isinstance(found, Training):
        raise ConfigError(f"policy: expected its attribute 'training' to be a Training, found {found!r}")
    return found


def make_robot(env: PseudoSlamEnv, interface: Interface) -> Robot:
    """Return the argument of a factory at the start of an episode."""
    world = env.simulator.world if interface.sees_truth else None
    return Robot(env.config, env.action_space, env.observation_space, world)


def make_knowledge(simulator: Simulator, state: State) -> Knowledge:
    """Return the current knowledge of the robot."""
    known: Knowledge = {
        "map": state.known.copy(),
        "pose_px": state.believed_px.copy(),
        "collided": state.blocked,
        "steps": int(state.counts.steps),
        "path_m": float(state.episode.readings[0].path_length) / simulator.config.pixels_per_metre,
    }
    if simulator.config.people.number or simulator.config.trajectories:
        known["moving_px"] = measure_sight(simulator, state, 0).bodies[:, 1:]
    if simulator.config.goal_region:
        known["goal_name"] = simulator.config.goal_region.names[state.goal_number]
        seen = state.known != UNKNOWN
        known["goal_map"] = simulator.world.regions[known["goal_name"]].marked * seen
        known["room_map"] = simulator.world.labels * seen
    elif state.goal_m is not None:
        known["goal_px"] = np.array(simulator.world.frame.pixel_from_point(*state.goal_m))
    return known
