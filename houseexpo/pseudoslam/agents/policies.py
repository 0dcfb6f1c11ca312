"""Policies for an environment that one has: for films, and for driving it from a script."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeAlias

import gymnasium
import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.forward import LEFT
from houseexpo.pseudoslam.agents.loading import NamedPolicy, load_policy
from houseexpo.pseudoslam.agents.protocol import Policy as EpisodePolicy
from houseexpo.pseudoslam.agents.protocol import knowledge_of, robot_of
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.state import State

Policy: TypeAlias = Callable[[Any], Any]
"""Takes an observation, returns an action of the environment."""

_EARLIER: Final = {"bounce": "forward"}
"""Names that policies had before."""


def policy_of(name: str, env: gymnasium.Env[Any, Any], seed: int | None = None) -> Policy:
    """Return a policy for an environment, by its name or file (``loading.load_policy``).

    It is made anew with each episode, and where it is done. "random" takes any environment's actions.

    Raises
    ------
    ConfigError
        Where there is no such policy, or it does not know the environment's actions.
    """
    if name == "random":
        env.action_space.seed(seed)
        return lambda _: env.action_space.sample()
    policy = load_policy(_EARLIER.get(name, name))
    wanted = gymnasium.spaces.Discrete if policy.interface.actions == "discrete" else gymnasium.spaces.Box
    if not isinstance(env.action_space, wanted):
        actions = policy.interface.actions
        raise ConfigError(f"policy {name!r}: expected an environment with {actions} actions, found {env.action_space}")
    return _Everlasting(env, policy, int(np.random.default_rng(seed).integers(2**31)))


class _Everlasting:
    """Makes a policy with each episode, and again where it is done."""

    def __init__(self, env: gymnasium.Env[Any, Any], policy: NamedPolicy, seed: int) -> None:
        self._env, self._policy, self._seed = known_env(env), policy, seed
        self._state: State | None = None
        self._now: EpisodePolicy

    def __call__(self, observation: Any) -> Any:
        if self._state is not self._env.state:
            self._state = self._env.state
            self._begin()
        action = self._now(observation, knowledge_of(self._env.simulator, self._env.state))
        if action is None:
            self._begin()
            action = self._now(observation, knowledge_of(self._env.simulator, self._env.state))
        return LEFT if action is None else action

    def _begin(self) -> None:
        self._now = self._policy.factory(robot_of(self._env, self._policy.interface), self._seed)


def known_env(env: gymnasium.Env[Any, Any]) -> PseudoSlamEnv:
    """Return the environment within its wrappers; ConfigError where it is not one of ours."""
    found = env.unwrapped
    if not isinstance(found, PseudoSlamEnv):
        raise ConfigError(f"env: expected an environment of PseudoSLAM, found {env}")
    return found
