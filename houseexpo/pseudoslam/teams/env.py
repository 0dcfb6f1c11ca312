"""Provide the environment of a team of robots in one house, a PettingZoo ``ParallelEnv``: one team of ``vector``."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.spec import Actions, EnvOptions, Kind, Observation, check_options
from houseexpo.pseudoslam.teams.tasks import Radio, TeamExploration
from houseexpo.pseudoslam.teams.team import Team, plain_report
from houseexpo.pseudoslam.teams.vector import TeamVectorEnv
from houseexpo.pseudoslam.worlds.maps import Plans


class TeamEnv(ParallelEnv):  # type: ignore[misc]  # an untyped library
    """Robots that do a task in a house together: see ``houseexpo.pseudoslam.parallel_env``."""

    def __init__(
        self,
        task: TeamExploration,
        /,
        dataset: Plans,
        config: SimulatorConfig | str | None = None,
        *,
        robots: int,
        radio: Radio,
        actions: Actions | None = None,
        observation: Kind = "map",
        **more: Unpack[EnvOptions],
    ) -> None:
        check_options(type(self), more, task.options())
        given: dict[str, Any] = {"robots": robots, "radio": radio, "actions": actions, "observation": observation}
        self._envs = TeamVectorEnv(task, dataset, config, threads=1, **given, **more)
        self.metadata = {
            "name": "pseudoslam_exploration_v0", "render_modes": [], "is_parallelizable": True
        }  # fmt: skip
        self.task, self.radio, self.config, self.render_mode = task, radio, self._envs.config, None
        self.possible_agents = [f"robot_{k}" for k in range(robots)]
        self.agents: list[str] = []
        spec = self._envs.env_spec
        self.action_spaces = {agent: spec.action_space() for agent in self.possible_agents}
        self.observation_spaces = {agent: spec.observation_space() for agent in self.possible_agents}

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of a robot's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of a robot's actions."""
        return self.action_spaces[agent]

    @property
    def team(self) -> Team:
        """The robots of this episode; raises ResetNeeded before the first reset."""
        return self._envs.team(0)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode; return the observations and the infos of the robots.

        ``options={"plan_id": ..., "pose": [...]}`` sets the plan, and the starts of the first robots: x, y in the
        plan's metres and heading in radians, or None for a random one. PettingZoo asks environments to bear with
        options that they do not know.
        """
        given, self.agents = dict(options or {}), []
        observed, infos = self._envs.reset(
            seed=seed, options={"plan_id": given.get("plan_id"), "pose": [given.get("pose")]}
        )
        self.agents = list(self.possible_agents)
        return self._by_agent(observed), self._infos({k: part for k, part in infos.items() if not k.startswith("_")})

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Take an action of each robot; return observations, rewards, terminated, truncated and infos.

        An episode ends for all robots at the same time.
        """
        agents = self.agents
        if not agents and self.team:
            return {}, {}, {}, {}, {}
        missing = [agent for agent in agents if agent not in actions]
        if missing or len(actions) != len(agents):
            raise ConfigError(f"actions: expected one for each of {', '.join(agents)}; found {sorted(actions)}")
        taken = [[actions[agent] for agent in agents]]
        observed, rewards, terminated, truncated, infos = self._envs.advance(taken, fresh=False)
        if terminated[0] or truncated[0]:
            self.agents = []
        return (
            self._by_agent(observed),
            dict(zip(agents, rewards[0].tolist(), strict=True)),
            dict.fromkeys(agents, bool(terminated[0])),
            dict.fromkeys(agents, bool(truncated[0])),
            self._infos(infos),
        )

    def _by_agent(self, observed: Observation) -> dict[str, Observation]:
        if isinstance(observed, dict):
            own = {key: part[0].copy() for key, part in observed.items()}
            return {a: {key: part[k] for key, part in own.items()} for k, a in enumerate(self.possible_agents)}
        maps = observed[0].copy()
        return {agent: maps[k] for k, agent in enumerate(self.possible_agents)}

    def _infos(self, found: dict[str, Any]) -> dict[str, dict[str, Any]]:
        shared: dict[str, Any] = {"team": plain_report(found["team"])}
        if "plan_id" in found:
            shared["plan_id"] = found["plan_id"][0]
        own = {key: part[0] for key, part in found.items() if key not in shared}
        return {
            agent: {key: np.array(part[k]) if part.ndim > 1 else part[k].item() for key, part in own.items()} | shared
            for k, agent in enumerate(self.possible_agents)
        }
