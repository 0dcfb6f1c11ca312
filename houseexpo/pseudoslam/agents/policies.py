"""Policies that need no learning: at random, straight on until something is in the way, and an explorer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Literal, TypeAlias, get_args

import gymnasium
import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.frontier import frontier_walk
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.simulator import ACTIONS, Action
from houseexpo.pseudoslam.state import State

Policy: TypeAlias = Callable[[Any], Any]
"""Takes an observation, returns an action of the environment."""
PolicyName = Literal["random", "bounce", "frontier"]

_MAX_TURNS = 18


def policy_of(name: str, env: gymnasium.Env[Any, Any], seed: int | None = None) -> Policy:
    """Return a policy for an environment with discrete actions (any, for "random").

    - "random": any action.
    - "bounce": forward; where that was blocked, some turns to one side.
    - "frontier": ``frontier_walk``, again from the start of each episode, and again where it finds nothing more.

    Raises
    ------
    ConfigError
        Where there is no policy of that name, or it does not know the environment's actions.
    """
    if name not in get_args(PolicyName):
        raise ConfigError(f"policy: expected one of {', '.join(get_args(PolicyName))}; found {name!r}")
    if name == "random":
        env.action_space.seed(seed)
        return lambda _: env.action_space.sample()
    if not isinstance(env.action_space, gymnasium.spaces.Discrete):
        raise ConfigError(f"policy {name!r}: expected an environment with discrete actions, found {env.action_space}")
    if name == "bounce":
        return _Walker(env, lambda e: _bouncing(e.state, np.random.default_rng(seed)))
    return _Walker(env, lambda e: frontier_walk(e.simulator, e.state))


class _Walker:
    """Takes actions from a walk that is begun anew with each episode, and where it ends."""

    def __init__(self, env: gymnasium.Env[Any, Any], new_walk: Callable[[PseudoSlamEnv], Iterator[Action]]) -> None:
        self._env, self._new_walk = known_env(env), new_walk
        self._state: State | None = None
        self._walk: Iterator[Action] = iter(())

    def __call__(self, _: Any) -> int:
        if self._state is not self._env.state:
            self._state, self._walk = self._env.state, self._new_walk(self._env)
        action = next(self._walk, None)
        if action is None:
            self._walk = self._new_walk(self._env)
            action = next(self._walk, "left")
        return ACTIONS.index(action)


def known_env(env: gymnasium.Env[Any, Any]) -> PseudoSlamEnv:
    """Return the environment within its wrappers; ConfigError where it is not one of ours."""
    found = env.unwrapped
    if not isinstance(found, PseudoSlamEnv):
        raise ConfigError(f"env: expected an environment of PseudoSLAM, found {env}")
    return found


def _bouncing(state: State, rng: np.random.Generator) -> Iterator[Action]:
    while True:
        yield "forward"
        if state.blocked:
            side: Action = "left" if rng.random() < 0.5 else "right"
            for _ in range(int(rng.integers(1, _MAX_TURNS))):
                yield side
