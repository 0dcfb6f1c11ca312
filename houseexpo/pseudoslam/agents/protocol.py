"""What a policy is: made anew for each episode, it is shown what the robot knows, and says what to do.

A *factory* makes one: ``factory(robot, seed)``, a class or a function. A *policy* is what it returns: a function
``policy(observation, info)`` from what the environment shows, and a ``Knowledge``, to an action of the environment, or
None where it is done. A factory may have an attribute ``interface`` that says how it wants to see and to act, and
``training``, of which policies it is one that differ by the seed of their training only. A policy may have an attribute
``decided``, False where its last action only went on with what it had decided before.

A policy sees the robot's own map and no truth: not the house's id, not its walls, not the share that is seen. Only one
whose interface says ``sees_truth`` is given the world, and results say so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NotRequired, Protocol, TypeAlias, TypedDict, get_args

import gymnasium
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.checks import one_of
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.envs.spec import Actions, Kind
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.world import World


class Knowledge(TypedDict):
    """What the robot knows: copies, which the policy may keep and write to."""

    map: npt.NDArray[np.uint8]
    """(rows, cols): 0 unknown, 127 free, 255 obstacle; row 0 at the highest y."""
    pose_px: npt.NDArray[np.float64]
    """(3,): where odometry has the robot on the map: x across, y down, heading in radians, counter-clockwise."""
    collided: bool
    """Whether something was in the way of the last action."""
    steps: int
    """Steps so far."""
    path_m: float
    """The way gone so far."""
    goal_px: NotRequired[npt.NDArray[np.float64]]
    """(2,): the goal on the map, where the task has one."""


@dataclass(frozen=True)
class Interface:
    """How a policy wants to see and to act.

    Parameters
    ----------
    actions, observation
        As the environments take them.
    view
        The square round the robot that observations show; None: the task's. The sensor and the map are the task's.
    sees_truth
        Whether ``Robot.world`` is wanted.
    tasks
        The benchmark's tasks that it can do; none named: all.
    """

    actions: Actions = "discrete"
    observation: Kind = "map"
    view: ObservationConfig | None = None
    sees_truth: bool = False
    tasks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, kinds in (("actions", Actions), ("observation", Kind)):
            one_of(getattr(self, name), f"interface.{name}", get_args(kinds))


@dataclass(frozen=True)
class Training:
    """Which training made a policy: results of one ``family`` and several seeds are one row of a table."""

    family: str
    seed: int


@dataclass(frozen=True)
class Robot:
    """What a factory is given: the configuration and the spaces, and the world where it asked for the truth."""

    config: SimulatorConfig
    action_space: gymnasium.Space[Any] | None = None
    observation_space: gymnasium.Space[Any] | None = None
    world: World | None = None


class Policy(Protocol):
    """Says what to do; None: it is done."""

    def __call__(self, observation: Any, info: Knowledge, /) -> Any:
        """Return an action of the environment, or None."""


PolicyFactory: TypeAlias = Callable[[Robot, int], Policy]


def interface_of(factory: PolicyFactory) -> Interface:
    """Return how a factory's policies want to see and to act; ConfigError where it says that in another way."""
    found = getattr(factory, "interface", Interface())
    if not isinstance(found, Interface):
        raise ConfigError(f"policy: expected its attribute 'interface' to be an Interface, found {found!r}")
    return found


def training_of(factory: PolicyFactory) -> Training | None:
    """Return which training made a factory's policies, None where none did; ConfigError where it says so otherwise."""
    found = getattr(factory, "training", None)
    if found is not None and not isinstance(found, Training):
        raise ConfigError(f"policy: expected its attribute 'training' to be a Training, found {found!r}")
    return found


def robot_of(env: PseudoSlamEnv, interface: Interface) -> Robot:
    """Return what a factory is given at the start of an episode."""
    world = env.simulator.world if interface.sees_truth else None
    return Robot(env.config, env.action_space, env.observation_space, world)


def knowledge_of(simulator: Simulator, state: State) -> Knowledge:
    """Return what the robot knows now."""
    known: Knowledge = {
        "map": state.known.copy(),
        "pose_px": state.believed_px.copy(),
        "collided": state.blocked,
        "steps": int(state.counts.steps),
        "path_m": float(state.episode.readings[0].path_length) / simulator.config.pixels_per_metre,
    }
    if state.goal_m is not None:
        known["goal_px"] = np.array(simulator.world.frame.pixel_from_point(*state.goal_m))
    return known
