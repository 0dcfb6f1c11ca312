"""Wrap N teams of R robots as a native vector environment of PufferLib 3, with its own interface and buffers.

>>> import pufferlib.vector  # doctest: +SKIP
>>> from houseexpo.pseudoslam.teams.puffer import PseudoSlamTeamPufferEnv  # doctest: +SKIP
>>> given = {"num_envs": 16, "robots": 4, "dataset": "plans/demo"}
>>> env = pufferlib.vector.make(PseudoSlamTeamPufferEnv, env_kwargs=given)  # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.pseudoslam.teams.making import parallel_vector_env
from houseexpo.pseudoslam.teams.tasks import TeamTask

try:
    import pufferlib
except ImportError as error:
    raise MissingDependencyError(
        "houseexpo.pseudoslam.teams.puffer needs PufferLib 3: run make puffer (docs/pseudoslam/clients.md)"
    ) from error

Buffers = dict[str, npt.NDArray[Any]]


class PseudoSlamTeamPufferEnv(pufferlib.PufferEnv):  # type: ignore[misc]  # as in envs.puffer
    """N teams of R robots as one native environment of PufferLib, with N * R agents: the robots of team after team.

    An episode ends for all robots of a team in the same step, which also starts the team's next episode. The infos then
    contain a dictionary with ``episode_return``, the mean over the team's robots, ``episode_length`` and the team's
    measures (``Team.report``); those that have not happened are left out.

    Parameters
    ----------
    task
        The task of a team, as for ``parallel_vector_env``.
    num_envs, robots
        The numbers of teams, N, and of robots in each, R.
    buf, seed
        Arguments that PufferLib passes if it makes several environments. Teams draw their seeds from ``seed``.
    given
        More arguments of ``parallel_vector_env``, such as ``dataset``, ``radio``, ``config``, ``threads``.

    Raises
    ------
    ConfigError
        As ``parallel_vector_env``, or the observation is not a single array.
    """

    def __init__(
        self,
        task: str | TeamTask = "exploration",
        *,
        num_envs: int = 1,
        robots: int = 2,
        buf: Buffers | None = None,
        seed: int | None = None,
        **given: Any,
    ) -> None:
        self.envs = parallel_vector_env(task, num_envs=num_envs, robots=robots, **given)
        seen, moves = self.envs.single_observation_space, self.envs.single_action_space
        if not isinstance(seen, gymnasium.spaces.Box):
            raise ConfigError(
                f"observation: expected a single array for PufferLib, found several: {seen}; use 'map' or 'scales', "
                "and a task that adds nothing to it, such as exploration"
            )
        self.single_observation_space, self.single_action_space = _of_one(seen), _of_one(moves)
        self.num_agents, self._seed, self._shape = num_envs * robots, seed, (num_envs, robots)
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, np.int64)
        super().__init__(buf)

    def reset(self, seed: int | None = None) -> tuple[npt.NDArray[Any], list[dict[str, float]]]:
        """Start episodes of all teams; the same seed gives the same episodes."""
        seed, self._seed = self._seed if seed is None else seed, None
        seeds = None if seed is None else np.random.SeedSequence(seed).generate_state(self._shape[0]).tolist()
        self._show(self.envs.reset(seed=seeds)[0])
        self._returns[:], self._lengths[:] = 0.0, 0
        self.rewards[:], self.terminals[:], self.truncations[:] = 0.0, False, False
        return self.observations, []

    def step(self, actions: npt.NDArray[Any]) -> tuple[Any, ...]:
        """Take a step; return the buffers of observations, rewards, terminals and truncations, and the infos."""
        taken = np.asarray(actions).reshape(*self._shape, *np.shape(actions)[1:])
        seen, rewards, terminated, truncated, infos = self.envs.step(taken)
        robots = self._shape[1]
        self.rewards[:] = rewards.ravel()
        self.terminals[:], self.truncations[:] = terminated.repeat(robots), truncated.repeat(robots)
        self._returns += rewards.mean(axis=1)
        self._lengths += 1
        ended = terminated | truncated
        said = [self._episode_summary(i, infos["team"]) for i in np.flatnonzero(ended).tolist()]
        if ended.any():
            self._returns[ended], self._lengths[ended] = 0.0, 0
            seen, _ = self.envs.reset(options={"reset_mask": ended})
        self._show(seen)
        return self.observations, self.rewards, self.terminals, self.truncations, said

    def _show(self, seen: Any) -> None:
        self.observations[:] = seen.reshape(self.observations.shape)

    def _episode_summary(self, i: int, team: dict[str, npt.NDArray[Any]]) -> dict[str, float]:
        """Return the numbers on the end of team ``i``'s episode."""
        numbers = {name: float(values[i]) for name, values in team.items() if not np.isnan(values[i])}
        return {"episode_return": float(self._returns[i]), "episode_length": float(self._lengths[i]), **numbers}

    def notify(self) -> None:
        """Do nothing; PufferLib calls this in workers to allow changes."""

    def close(self) -> None:
        """End the threads."""
        self.envs.close()


def _of_one(space: gymnasium.Space[Any]) -> gymnasium.Space[Any]:
    """Return the space of one robot, of the space of all robots of a team."""
    if isinstance(space, gymnasium.spaces.MultiDiscrete):
        return gymnasium.spaces.Discrete(int(space.nvec[0]))
    assert isinstance(space, gymnasium.spaces.Box)  # noqa: S101  # a team has no other actions
    return gymnasium.spaces.Box(space.low[0], space.high[0], space.low.shape[1:], space.low.dtype.type)
