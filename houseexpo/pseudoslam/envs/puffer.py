"""Vector environments for PufferLib 3, which has an interface and buffers of its own.

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
        "houseexpo.pseudoslam.envs.puffer needs PufferLib 3: run make puffer (docs/pseudoslam/training.md)"
    ) from error

Buffers = dict[str, npt.NDArray[Any]]
_TASKS: Final = ("Exploration", "ObstacleAvoidance", "Navigation")
_OURS: Final = {"autoreset_mode", "copy", "layout"}


class PseudoSlamPufferEnv(pufferlib.PufferEnv):  # type: ignore[misc]  # it comes without types where it is not installed
    """N robots as one native environment of PufferLib: an agent each, which is reset when its episode ends.

    Maps are drawn into PufferLib's buffer by the compiled call itself: nothing is copied, and ``observations`` is
    overwritten by the next step. An ended episode leaves a dictionary in the infos: ``episode_return``,
    ``episode_length``, and what the task says of the end as a number.

    Parameters
    ----------
    task
        "Exploration", "ObstacleAvoidance" or "Navigation".
    num_envs
        N.
    buf, seed
        PufferLib's, which it hands over where it makes several of these. Robots draw their seeds from ``seed``.
    given
        What the vector environment takes, ``dataset``, ``config``, ``actions``, ``threads``, ...; ConfigError where
        what is observed is no single array, and for ``autoreset_mode``, ``copy`` and ``layout``, which are PufferLib's
        to say. With its Multiprocessing, ``threads=1`` for each.
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
            raise ConfigError(f"{refused[0]}: expected PufferLib to decide, found {given[refused[0]]!r}; leave it out")
        made = gymnasium.make_vec(f"PseudoSLAM/{task}-v0", num_envs, autoreset_mode="SameStep", copy=False, **given)
        self.envs: PseudoSlamVectorEnv = made.unwrapped  # type: ignore[assignment]  # it is that one
        self.single_observation_space = self.envs.single_observation_space
        self.single_action_space = self.envs.single_action_space
        if not isinstance(self.single_observation_space, gymnasium.spaces.Box):
            raise ConfigError(
                "observation: expected a single array for PufferLib, found several: "
                f"{self.single_observation_space}; use 'map' or 'scales', and no goal or graph"
            )
        self.num_agents, self._seed = num_envs, seed
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, np.int64)
        super().__init__(buf)
        self.envs.draw_into(self.observations)

    def reset(self, seed: int | None = None) -> tuple[npt.NDArray[Any], list[dict[str, float]]]:
        """Start episodes everywhere; the same seed gives the same episodes."""
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
        said = [self._said(i, infos["final_info"]) for i in ended.tolist()]
        self._returns[ended], self._lengths[ended] = 0.0, 0
        return self.observations, self.rewards, self.terminals, self.truncations, said

    def _said(self, i: int, final: dict[str, npt.NDArray[Any]]) -> dict[str, float]:
        """Return what came of environment ``i``'s episode, as numbers."""
        numbers = {
            name: float(values[i])
            for name, values in final.items()
            if not name.startswith("_") and values.ndim == 1 and values.dtype.kind in "biuf"
        }
        return {"episode_return": float(self._returns[i]), "episode_length": float(self._lengths[i]), **numbers}

    def render(self) -> list[npt.NDArray[np.uint8] | None] | None:
        """Return a picture of each environment; None without ``render_mode="rgb_array"``."""
        return self.envs.render()

    def notify(self) -> None:
        """Do nothing: PufferLib tells its workers so that something may change."""

    def close(self) -> None:
        """End the threads."""
        self.envs.close()
