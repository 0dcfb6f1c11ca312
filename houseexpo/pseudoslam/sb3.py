"""Wrap PseudoSLAM's vector environments in the interface of Stable-Baselines3 (``VecEnv``).

>>> from houseexpo.pseudoslam.sb3 import SB3VecEnv  # doctest: +SKIP
>>> env = gymnasium.make_vec("PseudoSLAM/Exploration-v0", 16, autoreset_mode="SameStep", dataset="plans/demo")
... # doctest: +SKIP
>>> PPO("CnnPolicy", VecMonitor(SB3VecEnv(env))).learn(100_000)  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.pseudoslam.envs.reset_options import OPTIONS, check_reset_options
from houseexpo.pseudoslam.envs.vector import FOR_ALL, PseudoSlamVectorEnv

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise MissingDependencyError(
        "houseexpo.pseudoslam.sb3 needs Stable-Baselines3, which is not installed: pip install stable-baselines3"
    ) from error

Indices = int | Iterable[int] | None


class SB3VecEnv(VecEnv):  # type: ignore[misc]  # it comes without types where it is not installed
    """A PseudoSLAM vector environment with the interface of Stable-Baselines3.

    There is one info dictionary for each environment. At the end of an episode, it is that of the last step, with
    ``terminal_observation`` and ``TimeLimit.truncated``, while the observation is the first one of the next episode.

    Parameters
    ----------
    env
        A vector environment made with ``autoreset_mode="SameStep"``, which is how Stable-Baselines3 resets, and without
        wrappers of gymnasium, which would be ignored. ConfigError is raised otherwise.
    """

    def __init__(self, env: PseudoSlamVectorEnv) -> None:
        inner = env.unwrapped
        if not isinstance(inner, PseudoSlamVectorEnv) or inner.metadata["autoreset_mode"] != AutoresetMode.SAME_STEP:
            raise ConfigError(
                'env: expected a PseudoSLAM vector environment with autoreset_mode="SameStep", '
                f"found {env!r} with {env.metadata.get('autoreset_mode')}"
            )
        if env is not inner:
            raise ConfigError(
                f"env: expected a PseudoSLAM vector environment without wrappers, found {env!r}; Stable-Baselines3 has "
                "its own (VecMonitor, VecNormalize, VecFrameStack): put them round the SB3VecEnv"
            )
        self.env = inner
        self._actions: npt.NDArray[Any]
        super().__init__(inner.num_envs, inner.single_observation_space, inner.single_action_space)

    def reset(self) -> Any:
        """Start episodes in all environments, with the seeds of ``seed()`` and the options of ``set_options()``."""
        each = [check_reset_options(given) for given in self._options]
        options = {key: [given.get(key) for given in each] for key in OPTIONS if any(key in given for given in each)}
        observation, infos = self.env.reset(seed=list(self._seeds), options=options)
        self.reset_infos = _split_infos(infos, self.num_envs)
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Store the actions for ``step_wait``, which takes the step."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, npt.NDArray[np.float32], npt.NDArray[np.bool_], list[dict[str, Any]]]:
        """Take a step; return observations, rewards, which episodes ended, and infos."""
        observation, rewards, terminated, truncated, infos = self.env.step(self._actions)
        ended = terminated | truncated
        last, finals = infos.pop("final_obs", None), infos.pop("final_info", {})
        each, final = _split_infos(infos, self.num_envs), _split_infos(finals, self.num_envs)
        for i in np.flatnonzero(ended).tolist():
            limited = bool(truncated[i] and not terminated[i])
            each[i] = {**final[i], "terminal_observation": last[i], "TimeLimit.truncated": limited}
        return observation, rewards.astype(np.float32), ended, each

    def close(self) -> None:
        """End the threads."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Return an attribute for each environment; all share the same one."""
        return [getattr(self.env, attr_name)] * len(self._indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Set a shared attribute (the environments' ``set_attr``); raise ConfigError for only some environments."""
        if sorted(self._indices(indices)) != list(range(self.num_envs)):
            raise ConfigError(
                f"{attr_name}: all environments share this attribute; set it for all of them (indices=None)"
            )
        self.env.set_attr(attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Indices = None, **kwargs: Any) -> list[Any]:
        """Call a method of the vector environment that takes an environment's number first, such as ``state``.

        "render" gives pictures. Raise ConfigError for a method that is only for all environments together.
        """
        if method_name in {*FOR_ALL, "render"}:
            pictures = self.env.call(method_name)
            return [pictures[i] for i in self._indices(indices)]
        method = getattr(self.env, method_name)
        return [method(i, *args, **kwargs) for i in self._indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Indices = None) -> list[bool]:  # noqa: ARG002  # SB3's
        """Return False for each environment, since they have no wrappers."""
        return [False] * len(self._indices(indices))

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """Return a picture of each environment."""
        return self.env.render() or [None] * self.num_envs

    def _indices(self, indices: Indices) -> list[int]:
        if indices is None:
            return list(range(self.num_envs))
        return [indices] if isinstance(indices, int) else list(indices)


def _split_infos(infos: dict[str, Any], number: int) -> list[dict[str, Any]]:
    """Return a dictionary for each environment from the arrays for all."""
    keys = [key for key in infos if not key.startswith("_")]
    columns = [infos[key] if infos[key].ndim > 1 else infos[key].tolist() for key in keys]
    return [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)] or [{} for _ in range(number)]
