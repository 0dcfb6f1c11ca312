"""Turn a policy's name or file into a function from observation to action, for an existing environment; for movies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, TypeAlias

import gymnasium
import numpy as np

from houseexpo.errors import ConfigError, HouseExpoError, PolicyError
from houseexpo.pseudoslam.agents.loading import NamedPolicy, describe_exception, describe_no_policy, load_policy
from houseexpo.pseudoslam.agents.protocol import Interface, make_knowledge, make_robot
from houseexpo.pseudoslam.agents.protocol import Policy as EpisodePolicy
from houseexpo.pseudoslam.agents.simple import LEFT
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.state import State

Policy: TypeAlias = Callable[[Any], Any]
"""A function that takes an observation and returns an action of the environment."""

_WAITING: Final = {"discrete": LEFT, "continuous": np.array([0.0, 1.0])}
"""The actions of a policy that is done: turn in place. If there is nowhere to go, 0 also means a turn."""
_DICT_ONLY: Final = ("global_map", "pose", "ranges")
"""The entries of the observation "dict" in addition to those of "map"."""


def load_interface(name: str, task: str) -> Interface:
    """Return a policy's observations and actions; raise ConfigError if it does not exist or is for other tasks."""
    if name == "random":
        return Interface()
    wanted = load_policy(name).interface
    if wanted.tasks and task not in wanted.tasks:
        raise ConfigError(
            f"policy {name!r}: expected a task that it was made for ({', '.join(wanted.tasks)}), found {task}"
        )
    return wanted


def make_policy(name: str, env: gymnasium.Env[Any, Any], seed: int | None = None) -> Policy:
    """Return a policy for an environment, by its name or file (``loading.load_policy``).

    The policy is created again for each episode, and when it is done. "random" works with the actions of any
    environment. A policy for the observation "map" also works in an environment that shows more. If the policy raises
    an exception that is not one of houseexpo, calls raise PolicyError.

    Raises
    ------
    ConfigError
        There is no such policy, or the environment has other actions or observations than the policy needs.
    """
    if name == "random":
        env.action_space.seed(seed)
        return lambda _: env.action_space.sample()
    policy, inner = load_policy(name), unwrap_env(env)
    wanted = policy.interface
    if inner.actions != wanted.actions:
        raise ConfigError(
            f"policy {name!r}: expected an environment with {wanted.actions} actions, found {inner.actions} actions"
        )
    if wanted.observation not in {"map", inner.observation}:
        raise ConfigError(
            f"policy {name!r}: expected an environment that shows {wanted.observation!r}, found {inner.observation!r}"
        )
    return _Everlasting(inner, policy, int(np.random.default_rng(seed).integers(2**31)))


class _Everlasting:
    """A policy that is created again for each episode, and when it is done."""

    def __init__(self, env: PseudoSlamEnv, policy: NamedPolicy, seed: int) -> None:
        self._env, self._policy, self._seed = env, policy, seed
        self._shows_more = policy.interface.observation == "map" and env.observation == "dict"
        self._state: State | None = None
        self._now: EpisodePolicy

    def __call__(self, observation: Any) -> Any:
        shown = _map_of(observation) if self._shows_more else observation
        try:
            return self._next_action(shown)
        except HouseExpoError:
            raise
        except (Exception, SystemExit) as error:
            raise PolicyError(f"{self._where()}: it raised {describe_exception(error, __file__)}") from error

    def _where(self) -> str:
        plan, step = self._env.simulator.world.plan_id, int(self._env.state.counts.steps)
        return f"policy {self._policy.name!r}: plan {plan!r}, step {step}"

    def _next_action(self, shown: Any) -> Any:
        if self._state is not self._env.state:
            self._state = self._env.state
            self._begin()
        action = self._now(shown, make_knowledge(self._env.simulator, self._env.state))
        if action is None:
            self._begin()
            action = self._now(shown, make_knowledge(self._env.simulator, self._env.state))
        return _WAITING.get(self._env.actions, 0) if action is None else action

    def _begin(self) -> None:
        robot = make_robot(self._env, self._policy.interface)
        if self._shows_more:
            robot = replace(robot, observation_space=_map_of(robot.observation_space))
        self._now = self._policy.factory(robot, self._seed)
        if not callable(self._now):
            raise PolicyError(f"{self._where()}: {describe_no_policy(self._policy, self._now)}")


def _map_of(shown: Any) -> Any:
    """Return the part of an observation "dict", or of its space, that "map" has."""
    parts = {key: shown[key] for key in shown if key not in _DICT_ONLY}
    if len(parts) == 1:
        return parts["map"]
    return gymnasium.spaces.Dict(parts) if isinstance(shown, gymnasium.spaces.Dict) else parts


def unwrap_env(env: gymnasium.Env[Any, Any]) -> PseudoSlamEnv:
    """Return the environment inside its wrappers; raise ConfigError if it is not one of ours."""
    found = env.unwrapped
    if not isinstance(found, PseudoSlamEnv):
        raise ConfigError(f"env: expected an environment of PseudoSLAM, found {env}")
    return found
