"""The environment of a team, a PettingZoo ``ParallelEnv``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Literal, Unpack, get_args

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import number, one_of, whole
from houseexpo.pseudoslam.envs.reset_options import Pose, pose_of
from houseexpo.pseudoslam.envs.spec import MAPS, Actions, EnvOptions, Kind, Observation, check_options, make_env_spec
from houseexpo.pseudoslam.kernels.step import STEP
from houseexpo.pseudoslam.metrics import Bools, EpisodeConstants, Metrics
from houseexpo.pseudoslam.tasks import Exploration, ExplorationReward
from houseexpo.pseudoslam.teams.discs import ROBOTS_MOST
from houseexpo.pseudoslam.teams.radio import Radio
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import Plans

_WANTED = np.full(1, STEP, np.uint8)
Until = Literal["team", "robot", "report"]


class TeamEnv(ParallelEnv):  # type: ignore[misc]  # an untyped library
    """Robots that explore a house together: see ``houseexpo.pseudoslam.parallel_env``."""

    metadata = {"name": "pseudoslam_exploration_v0", "render_modes": [], "is_parallelizable": True}  # noqa: RUF012

    def __init__(
        self,
        dataset: Plans,
        config: SimulatorConfig | str | None = None,
        *,
        robots: int,
        radio: Radio,
        until: Until = "team",
        report_m: float = 1.0,
        success_coverage: float | None = 0.95,
        reward: ExplorationReward = "area",
        actions: Actions | None = None,
        observation: Kind = "map",
        **more: Unpack[EnvOptions],
    ) -> None:
        whole(robots, "robots", at_least=1, at_most=ROBOTS_MOST)
        one_of(until, "until", get_args(Until))
        number(report_m, "report_m", above=0.0)
        if not isinstance(radio, Radio):
            raise ConfigError(f"radio: expected a Radio or the name of its model, found {radio!r}")
        if actions not in {None, "discrete", "continuous"}:
            raise ConfigError(f"actions: expected discrete or continuous for a team, found {actions!r}")
        if observation == "graph":
            raise ConfigError("observation: expected map, dict or scales for a team, found 'graph'")
        check_options(type(self), more)
        self.task = Exploration(success_coverage, reward)
        self._env_spec = make_env_spec(self.task, dataset, config, actions, observation, **more)
        self.config, self.radio, self.until, self.report_m = self._env_spec.config, radio, until, report_m
        if robots > 1 and self.config.trajectories:
            raise ConfigError("trajectories: a team meets robots, people and obstacles; leave trajectories out")
        if robots > 1 and self.config.known_map:
            raise ConfigError("known_map: a team explores, so it cannot know the map; leave it out")
        self.render_mode = None
        self.possible_agents = [f"robot_{k}" for k in range(robots)]
        self.agents: list[str] = []
        self.action_spaces = {agent: self._env_spec.action_space() for agent in self.possible_agents}
        self.observation_spaces = {agent: self._env_spec.observation_space() for agent in self.possible_agents}
        self._pictures = self._env_spec.pictures(robots)
        one_each = (self._env_spec.pictures(1) for _ in range(robots))
        self._own_pictures = [pictures for pictures in one_each if pictures]
        self._rng: np.random.Generator | None = None
        self._team: Team | None = None
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

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode; return the observations and the infos of the robots.

        ``options={"plan_id": ..., "pose": [...]}`` sets the plan, and the starts of the first robots: x, y in the
        plan's metres and heading in radians, or None for a random one. PettingZoo asks environments to bear with
        options that they do not know.
        """
        given = dict(options or {})
        starts = _starts(given.get("pose"), len(self.possible_agents))
        if seed is not None or self._rng is None:
            self._rng, _ = seeding.np_random(seed)
        if seed is not None:
            self._env_spec.choice.start_over()
        self._team, self.agents = None, []
        world = self._env_spec.choice.draw(self._rng, given.get("plan_id"))
        self._team = Team(self._env_spec, world, len(self.possible_agents), self.radio, self._rng, starts)
        self.agents = list(self.possible_agents)
        now = self._before = self._team.metrics()
        return self._observations(now), self._infos(now, self.task.success(now))

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
        rewards = self.task.rewards(self._before, seen, ahead, self.task.success(seen))
        now = self._before = team.metrics()
        success = self._success(now)
        terminated, truncated = bool(success.any()), bool(now.truncated()[0])
        agents = self.agents
        answer = (
            self._observations(now),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict.fromkeys(agents, terminated),
            dict.fromkeys(agents, truncated),
            self._infos(now, success),
        )
        if terminated or truncated:
            self.agents = []
        return answer

    def _success(self, now: Metrics) -> Bools:
        """Return for each robot whether the team's task is fulfilled."""
        team, least = self.team, self.task.success_coverage
        if least is None:
            return np.zeros(len(team), bool)
        if self.until == "team":
            return np.full(len(team), team.coverage >= least)
        found: Bools = now.coverage >= least
        if self.until == "report":
            starts = np.column_stack([now.readings["start_x"], now.readings["start_y"]])
            away = np.hypot(*(now.pose_px[:, :2] - starts[0]).T)
            found = found & (away <= self.report_m * self.config.pixels_per_metre)
        return np.full(len(team), found.any())

    def _observations(self, now: Metrics) -> dict[str, Observation]:
        team, robots = self.team, len(self.team)
        if self._pictures:
            for k, (state, pictures) in enumerate(zip(team.states, self._own_pictures, strict=True)):
                constants = EpisodeConstants.of(team.constants.rows[k : k + 1])
                pictures.draw(state.pool, state.sizes, _WANTED, constants, lambda draw: draw(0, 1))
                self._pictures.shown[k] = pictures.shown[0]
        found = self._env_spec.observe(team.pool, now, self._pictures)
        if isinstance(found, dict):
            parts = {key: part.copy() if key in MAPS else part for key, part in found.items()}
            return {a: {key: part[k] for key, part in parts.items()} for k, a in enumerate(self.possible_agents)}
        copied = found.copy()
        return {self.possible_agents[k]: copied[k] for k in range(robots)}

    def _infos(self, now: Metrics, success: Bools) -> dict[str, dict[str, Any]]:
        team = self.team
        report = self._env_spec.report(team.pool, now, success)
        shared = {"plan_id": team.world.plan_id, "team": team.report()}
        return {
            agent: {
                **{key: value[k] if value.ndim > 1 else value[k].item() for key, value in report.items()},
                "hears": team.heard[k].copy(),
                **shared,
            }
            for k, agent in enumerate(self.possible_agents)
        }


def _starts(poses: object, robots: int) -> Sequence[Pose | None]:
    """Return the starts of the first robots; raise ConfigError if they are not a list of poses."""
    if poses is None:
        return []
    given = list(poses) if isinstance(poses, Iterable) else [poses]
    if len(given) == 3 and all(isinstance(part, (int, float, np.number)) for part in given):
        given = [given]
    if len(given) > robots:
        raise ConfigError(f"options['pose']: expected at most one for each of {robots} robots, found {len(given)}")
    return [pose_of(pose) for pose in given]
