"""Wrap N robots with a task as a native vector environment of PufferLib 3, which has its own interface and buffers.

>>> import pufferlib.vector  # doctest: +SKIP
>>> from houseexpo.pseudoslam.envs.puffer import PseudoSlamPufferEnv  # doctest: +SKIP
>>> env = pufferlib.vector.make(PseudoSlamPufferEnv, env_kwargs={"num_envs": 64, "dataset": "plans/demo"})
... # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any, Final

import gymnasium
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv

try:
    import pufferlib
except ImportError as error:
    raise MissingDependencyError(
        "houseexpo.pseudoslam.envs.puffer needs PufferLib 3: run make puffer (docs/pseudoslam/clients.md)"
    ) from error

Buffers = dict[str, npt.NDArray[Any]]
_TASKS: Final = ("Exploration", "ObstacleAvoidance", "Navigation")
_OURS: Final = {"autoreset_mode", "copy", "layout"}


class PseudoSlamPufferEnv(pufferlib.PufferEnv):  # type: ignore[misc]  # it comes without types where it is not installed
    """N robots as one native environment of PufferLib; each is an agent that is reset when its episode ends.

    The compiled step draws maps directly into PufferLib's buffer, so that nothing is copied and the next step
    overwrites ``observations``. At the end of an episode, the infos contain a dictionary with ``episode_return``,
    ``episode_length`` and the task's numbers.

    Parameters
    ----------
    task
        "Exploration", "ObstacleAvoidance" or "Navigation".
    num_envs
        The number of robots, N.
    buf, seed
        Arguments that PufferLib passes if it makes several environments. Robots draw their seeds from ``seed``.
    given
        Arguments of the vector environment, such as ``dataset``, ``config``, ``actions``, ``threads``. With PufferLib's
        Multiprocessing, set ``threads=1``.

    Raises
    ------
    ConfigError
        The observation is not a single array, or ``autoreset_mode``, ``copy`` or ``layout`` is given, which PufferLib
        determines.
    """

    def __init__(
        self,
        task: str = "Exploration",
        *,
        num_envs: int = 1,
        buf: Buffers | None = None,
        seed: int | None = None,
        **given: Any,
    ) -> None:
        if task not in _TASKS:
            raise ConfigError(f"task: expected one of {', '.join(_TASKS)}, found {task!r}")
        if refused := sorted(_OURS & given.keys()):
            raise ConfigError(
                f"{refused[0]}: PufferLib determines this argument, found {given[refused[0]]!r}; leave it out"
            )
        made = gymnasium.make_vec(f"PseudoSLAM/{task}-v0", num_envs, autoreset_mode="SameStep", copy=False, **given)
        self.envs: PseudoSlamVectorEnv = made.unwrapped  # type: ignore[assignment]  # it is that one
        self.single_observation_space = self.envs.single_observation_space
        self.single_action_space = self.envs.single_action_space
        if not isinstance(self.single_observation_space, gymnasium.spaces.Box):
            raise ConfigError(
                "observation: expected a single array for PufferLib, found several: "
                f"{self.single_observation_space}; use 'scales', or 'map' without a goal or a drive"
            )
        self.num_agents, self._seed = num_envs, seed
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, np.int64)
        super().__init__(buf)
        self.envs.draw_into(self.observations)

    def reset(self, seed: int | None = None) -> tuple[npt.NDArray[Any], list[dict[str, float]]]:
        """Start episodes in all environments; the same seed gives the same episodes."""
        seed, self._seed = self._seed if seed is None else seed, None
        seeds = None if seed is None else np.random.SeedSequence(seed).generate_state(self.num_agents).tolist()
        self.envs.reset(seed=seeds)
        self._returns[:], self._lengths[:] = 0.0, 0
        self.rewards[:], self.terminals[:], self.truncations[:] = 0.0, False, False
        return self.observations, []

    def step(self, actions: npt.NDArray[Any]) -> tuple[Any, ...]:
        """Take a step; return the buffers of observations, rewards, terminals and truncations, and the infos."""
        _, rewards, self.terminals[:], self.truncations[:], infos = self.envs.step(actions)
        self.rewards[:] = rewards
        self._returns += rewards
        self._lengths += 1
        ended = np.flatnonzero(self.terminals | self.truncations)
        said = [self._episode_summary(i, infos["final_info"]) for i in ended.tolist()]
        self._returns[ended], self._lengths[ended] = 0.0, 0
        return self.observations, self.rewards, self.terminals, self.truncations, said

    def _episode_summary(self, i: int, final: dict[str, npt.NDArray[Any]]) -> dict[str, float]:
        """Return the numbers on the end of environment ``i``'s episode."""
        numbers = {
            name: float(values[i])
            for name, values in final.items()
            if not name.startswith("_") and values.ndim == 1 and values.dtype.kind in "biuf"
        }
        return {"episode_return": float(self._returns[i]), "episode_length": float(self._lengths[i]), **numbers}

    def render(self) -> list[npt.NDArray[np.uint8] | None] | None:
        """Return a picture of each environment, None without ``render_mode="rgb_array"``."""
        return self.envs.render()

    def notify(self) -> None:
        """Do nothing; PufferLib calls this in workers to allow changes."""

    def close(self) -> None:
        """End the threads."""
        self.envs.close()
