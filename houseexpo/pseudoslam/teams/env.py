"""Provide the environment of a team of robots in one house, a PettingZoo ``ParallelEnv``."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.spec import MAPS, Actions, EnvOptions, Kind, Observation
from houseexpo.pseudoslam.kernels.step import STEP
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.teams.radio import Radio
from houseexpo.pseudoslam.teams.spec import check_starts, make_observation_space, make_team_spec
from houseexpo.pseudoslam.teams.tasks import TeamEpisode, TeamTask
from houseexpo.pseudoslam.teams.team import Team, make_team_kernels
from houseexpo.pseudoslam.worlds.maps import Plans


class TeamEnv(ParallelEnv):  # type: ignore[misc]  # an untyped library
    """Robots that do a task in a house together: see ``houseexpo.pseudoslam.parallel_env``."""

    def __init__(
        self,
        task: TeamTask,
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
        self.metadata = {
            "name": f"pseudoslam_{task.name}_v0", "render_modes": [], "is_parallelizable": True
        }  # fmt: skip
        self.task, self.radio = task, radio
        self._env_spec = make_team_spec(task, dataset, config, robots, radio, actions, observation, more, type(self))
        self.config = self._env_spec.config
        self.render_mode = None
        self.possible_agents = [f"robot_{k}" for k in range(robots)]
        self.agents: list[str] = []
        self.action_spaces = {agent: self._env_spec.action_space() for agent in self.possible_agents}
        self.observation_spaces = {
            agent: make_observation_space(task, self._env_spec, robots) for agent in self.possible_agents
        }
        self._pictures = self._env_spec.pictures(robots)
        self._around = make_team_kernels(self._env_spec, self._env_spec.params(), radio)
        self._rng: np.random.Generator | None = None
        self._team: Team | None = None
        self._episode: TeamEpisode
        self._before: Metrics

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of a robot's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of a robot's actions."""
        return self.action_spaces[agent]

    @property
    def team(self) -> Team:
        """The robots of this episode; raises ResetNeeded before the first reset."""
        if self._team is None:
            raise ResetNeeded("call reset() before anything else")
        return self._team

    @property
    def episode(self) -> TeamEpisode:
        """What the task keeps of this episode; raises ResetNeeded before the first reset."""
        if self._team is None:
            raise ResetNeeded("call reset() before anything else")
        return self._episode

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode; return the observations and the infos of the robots.

        ``options={"plan_id": ..., "pose": [...]}`` sets the plan, and the starts of the first robots: x, y in the
        plan's metres and heading in radians, or None for a random one. PettingZoo asks environments to bear with
        options that they do not know.
        """
        given = dict(options or {})
        starts = check_starts(given.get("pose"), len(self.possible_agents))
        if seed is not None or self._rng is None:
            self._rng, _ = seeding.np_random(seed)
        if seed is not None:
            self._env_spec.choice.start_over()
        self._team, self.agents = None, []
        world = self._env_spec.choice.draw(self._rng, given.get("plan_id"))
        self._team = Team(self._env_spec, world, len(self.possible_agents), self.radio, self._rng, starts, self._around)
        house = self._env_spec.choice.house(world.plan_id) if self.task.house_matters else None
        self._episode = self.task.begin(self._team, house)
        self.agents = list(self.possible_agents)
        now = self._before = self._team.metrics()
        return self._observations(now), self._infos(now, success=self._episode.success(now))

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Take an action of each robot; return observations, rewards, terminated, truncated and infos.

        An episode ends for all robots at the same time.
        """
        team = self.team
        if not self.agents:
            return {}, {}, {}, {}, {}
        missing = [agent for agent in self.agents if agent not in actions]
        if missing or len(actions) != len(self.agents):
            raise ConfigError(f"actions: expected one for each of {', '.join(self.agents)}; found {sorted(actions)}")
        found = [self._env_spec.motions(actions[agent]) for agent in self.agents]
        moves = np.concatenate([motion for motion, _ in found])
        ahead = np.concatenate([forward for _, forward in found])
        seen = team.step(moves)
        rewards = self._episode.step(self._before, seen, ahead)
        now = self._before = team.metrics()
        terminated, truncated = self._episode.success(now), bool(now.truncated()[0])
        agents = self.agents
        answer = (
            self._observations(now),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict.fromkeys(agents, terminated),
            dict.fromkeys(agents, truncated),
            self._infos(now, success=terminated),
        )
        if terminated or truncated:
            self.agents = []
        return answer

    def _observations(self, now: Metrics) -> dict[str, Observation]:
        team, robots = self.team, len(self.team)
        if self._pictures:
            wanted = np.full(robots, STEP, np.uint8)
            self._pictures.draw(team.pool, team.sizes, wanted, team.constants, lambda draw: draw(0, robots))
        found = self._env_spec.observe(team.pool, now, self._pictures, team.sizes)
        more = self._episode.observe()
        if more or isinstance(found, dict):
            parts = found if isinstance(found, dict) else {"map": found}
            parts = {key: part.copy() if key in MAPS else part for key, part in parts.items()} | more
            return {a: {key: part[k] for key, part in parts.items()} for k, a in enumerate(self.possible_agents)}
        copied = found.copy()
        return {self.possible_agents[k]: copied[k] for k in range(robots)}

    def _infos(self, now: Metrics, *, success: bool) -> dict[str, dict[str, Any]]:
        team = self.team
        report = self._env_spec.report(team.pool, now, np.full(len(team), success))
        named = {"plan_id": team.world.plan_id} if self._env_spec.text_info else {}
        shared = {**named, "team": team.report() | self._episode.report()}
        return {
            agent: {
                **{key: value[k] if value.ndim > 1 else value[k].item() for key, value in report.items()},
                "hears": team.heard[k].copy(),
                **shared,
            }
            for k, agent in enumerate(self.possible_agents)
        }
