"""Many teams at once: gymnasium's vector interface, with an axis for the robots of a team."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.reset_options import Pose, Seeds, mask_of, plans_of, seeds_of
from houseexpo.pseudoslam.envs.spec import (
    Actions,
    EnvOptions,
    Kind,
    Observation,
    check_vector_arguments,
)
from houseexpo.pseudoslam.kernels.step import STEP
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.teams.pools import TeamPools, of_team
from houseexpo.pseudoslam.teams.radio import Radio
from houseexpo.pseudoslam.teams.spec import make_team_spec, observation_space_of, starts_of
from houseexpo.pseudoslam.teams.tasks.task import TeamEpisode, TeamTask
from houseexpo.pseudoslam.teams.team import Team, report_of
from houseexpo.pseudoslam.worlds.maps import Plans

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


class TeamVectorEnv(VectorEnv[Observation, npt.NDArray[Any], npt.NDArray[Any]]):
    """N teams of R robots: see ``houseexpo.pseudoslam.parallel_vector_env``."""

    def __init__(
        self,
        task: TeamTask,
        /,
        dataset: Plans,
        config: SimulatorConfig | str | None = None,
        *,
        num_envs: int = 1,
        robots: int,
        radio: Radio,
        actions: Actions | None = None,
        observation: Kind = "map",
        threads: int | None = None,
        **more: Unpack[EnvOptions],
    ) -> None:
        self.metadata = {"autoreset_mode": check_vector_arguments(num_envs, threads, AutoresetMode.NEXT_STEP, None)}
        self.render_mode = None
        self._env_spec = make_team_spec(task, dataset, config, robots, radio, actions, observation, more, type(self))
        self.task, self.radio, self.config = task, radio, self._env_spec.config
        self.num_envs, self.robots = num_envs, robots
        self.single_action_space = batch_space(self._env_spec.action_space(), robots)
        self.single_observation_space = batch_space(observation_space_of(task, self._env_spec, robots), robots)
        self._adds_parts = bool(task.spaces(self._env_spec, robots))
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._pools = TeamPools(self._env_spec, num_envs, robots, threads)
        one_each = (self._env_spec.pictures(num_envs) for _ in range(robots))
        self._pictures = [pictures for pictures in one_each if pictures]
        self._rngs: dict[int, np.random.Generator] = {}
        self._episodes: list[TeamEpisode | None] = [None] * num_envs
        self._plan_ids = np.full(num_envs, None, object)
        self._ended = np.ones(num_envs, bool)
        self._begun = np.zeros(num_envs, bool)
        self._before: list[Metrics] = []

    def team(self, i: int) -> Team:
        """Return the robots of environment ``i``; its arrays are views, which the next step changes."""
        team = self._pools.placed[i]
        if team is None or not self._begun[i]:
            raise gymnasium.error.ResetNeeded(f"environment {i}: call reset() first")
        return team

    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]`` (N,).

        ``reset(seed=s)`` corresponds to the seeds s to s + N - 1 of ``parallel_env``, and a list gives each environment
        its own. ``options`` may have "plan_id", an id for all or a list of N, and "pose", a list of N lists of starts.
        """
        given = dict(options or {})
        if unknown := sorted(given.keys() - {"reset_mask", "plan_id", "pose"}):
            raise ConfigError(f"options: unknown key {unknown[0]!r}; known: 'plan_id', 'pose', 'reset_mask'")
        seeds, which = seeds_of(seed, self.num_envs), mask_of(given.get("reset_mask"), self.num_envs)
        plan_ids, poses = plans_of(given.get("plan_id"), self.num_envs), given.get("pose")
        poses = [None] * self.num_envs if poses is None else list(poses)
        if len(poses) != self.num_envs:
            raise ConfigError(f"options['pose']: expected {self.num_envs} lists of starts, found {len(poses)}")
        if which.all() and any(one is not None for one in seeds):
            self._env_spec.choice.start_over()
        self._begun = self._begun & ~which
        for i in np.flatnonzero(which).tolist():
            if seeds[i] is not None or i not in self._rngs:
                self._rngs[i] = seeding.np_random(seeds[i])[0]
            self._start(i, plan_ids[i], starts_of(poses[i], self.robots))
        self._begun |= which
        if not self._begun.all():
            missing = np.flatnonzero(~self._begun).tolist()
            raise gymnasium.error.ResetNeeded(f"environments {missing}: they have not begun; reset them too")
        self._ended = self._ended & ~which
        now = self._before = self._pools.metrics()
        return self._observations(now), self._infos(now, self._successes(now), which)

    def _start(self, i: int, plan_id: str | None = None, starts: list[Pose | None] | None = None) -> None:
        """Put the start of an episode at place ``i``."""
        rng, choice = self._rngs[i], self._env_spec.choice
        world = choice.draw(rng, plan_id)
        team = Team(self._env_spec, world, self.robots, self.radio, rng, starts or (), self._pools.around)
        self._pools.put(i, team)
        house = choice.house(world.plan_id) if self.task.house_matters else None
        self._episodes[i], self._plan_ids[i] = self.task.begin(team, house), world.plan_id

    def step(self, actions: npt.NDArray[Any]) -> tuple[Observation, Floats, Bools, Bools, dict[str, Any]]:
        """Take an action of each robot, (N, R) or (N, R, 2).

        Return the observations, rewards (N, R), terminated (N,), truncated (N,) and infos. A team whose episode has
        ended ignores its actions, starts the next episode, and has rewards of 0.
        """
        if not self._begun.all():
            raise gymnasium.error.ResetNeeded(
                f"environments {np.flatnonzero(~self._begun).tolist()}: call reset() first"
            )
        teams, robots = self.num_envs, self.robots
        given = np.asarray(actions)
        if given.shape[:2] != (teams, robots):
            raise ConfigError(f"actions: expected an array of shape ({teams}, {robots}, ...), found {given.shape}")
        motions, ahead = self._env_spec.motions(given.reshape(teams * robots, *given.shape[2:]), teams * robots)
        active, moves = ~self._ended, motions.reshape(teams, robots, -1)
        moves[~active] = 0.0
        seen, now = self._pools.step(moves, active)
        rewards = self._rewards(seen, ahead.reshape(teams, robots), active)
        for i in np.flatnonzero(self._ended).tolist():
            self._start(i)
        if self._ended.any():
            now = self._pools.metrics()
        success = self._successes(now)
        terminated, truncated = success & active, now[0].truncated() & active
        self._ended, self._before = terminated | truncated, now
        return self._observations(now), rewards, terminated, truncated, self._infos(now, success, np.ones(teams, bool))

    def _rewards(self, seen: list[Metrics], ahead: Bools, active: Bools) -> Floats:
        rewards = self.task.rewards_by_robot(self._before, seen, ahead)
        if rewards is None:
            rewards = np.zeros((self.num_envs, self.robots))
            for i in np.flatnonzero(active).tolist():
                rewards[i] = self._episode(i).step(of_team(self._before, i), of_team(seen, i), ahead[i])
        rewards[~active] = 0.0
        return rewards

    def _successes(self, now: list[Metrics]) -> Bools:
        pools = self._pools
        found = self.task.successes(pools.together["covered"] / pools.observable, now)
        if found is None:
            found = np.array([self._episode(i).success(of_team(now, i)) for i in range(self.num_envs)])
        return found

    def _episode(self, i: int) -> TeamEpisode:
        episode = self._episodes[i]
        assert episode is not None  # noqa: S101  # only begun episodes are asked for
        return episode

    def _observations(self, now: list[Metrics]) -> Observation:
        """Return new arrays (N, R, ...)."""
        spec, found = self._env_spec, []
        for k, batch in enumerate(self._pools.batches):
            pictures = self._pictures[k] if self._pictures else None
            if pictures:
                wanted = np.full(self.num_envs, STEP, np.uint8)
                pictures.draw(batch.arrays, batch.sizes, wanted, self._pools.constants[k], batch.share)
            found.append(spec.observe(batch.arrays, now[k], pictures, batch.sizes))
        more = [self._episode(i).observe() for i in range(self.num_envs)] if self._adds_parts else []
        if not more and not isinstance(found[0], dict):
            return np.stack([each for each in found if not isinstance(each, dict)], axis=1)
        parts = [each if isinstance(each, dict) else {"map": each} for each in found]
        joined = {key: np.stack([part[key] for part in parts], axis=1) for key in parts[0]}
        return joined | {key: np.stack([part[key] for part in more]) for key in (more[0] if more else {})}

    def _infos(self, now: list[Metrics], success: Bools, which: Bools) -> dict[str, Any]:
        """Return the entries of the robots' ``info`` (N, R, ...), and "team", whose entries are (N,)."""
        pools, ppm = self._pools, self.config.pixels_per_metre
        reports = [
            self._env_spec.report(batch.arrays, each, success) for batch, each in zip(pools.batches, now, strict=True)
        ]
        infos: dict[str, Any] = {key: np.stack([report[key] for report in reports], axis=1) for key in reports[0]}
        ways_m = np.stack([each.readings["path_length"] for each in now], axis=1) / ppm
        team: dict[str, Any] = report_of(pools.together, ways_m, infos["collisions"], pools.observable, ppm)
        own = [self._episode(i).report() for i in range(self.num_envs)] if self.task.measures else []
        for key in own[0] if own else ():
            team[key] = np.array([np.nan if report[key] is None else report[key] for report in own], np.float64)
        infos["hears"] = np.stack([self.team_at(i).heard for i in range(self.num_envs)])
        if self._env_spec.text_info:
            infos["plan_id"] = self._plan_ids.copy()
        infos["team"] = team
        return {**infos, **{f"_{key}": which.copy() for key in infos}}

    def team_at(self, i: int) -> Team:
        """Return the robots of environment ``i``, also while it is being reset."""
        team = self._pools.placed[i]
        assert team is not None  # noqa: S101  # only begun episodes are asked for
        return team

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002  # gymnasium's signature
        """End the threads."""
        self._pools.close()
