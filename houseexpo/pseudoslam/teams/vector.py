"""Provide many teams as one gymnasium vector environment, whose arrays have an axis for the robots of a team."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Unpack

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from houseexpo.configuration import check_whole_number
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.reset_options import (
    Pose,
    Seeds,
    parse_plan_ids,
    parse_pose,
    parse_reset_mask,
    parse_seeds,
)
from houseexpo.pseudoslam.envs.spec import (
    Actions,
    EnvOptions,
    EnvSpec,
    Kind,
    Observation,
    check_options,
    check_vector_arguments,
    make_env_spec,
)
from houseexpo.pseudoslam.envs.vector import with_masks
from houseexpo.pseudoslam.kernels.step import STEP
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.teams.pools import TeamPools
from houseexpo.pseudoslam.teams.tasks import Radio, TeamExploration
from houseexpo.pseudoslam.teams.team import ROBOTS_MOST, Team, compute_report
from houseexpo.pseudoslam.worlds.maps import Plans

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


class TeamVectorEnv(VectorEnv[Observation, npt.NDArray[Any], npt.NDArray[Any]]):
    """N teams of R robots: see ``houseexpo.pseudoslam.parallel_vector_env``."""

    def __init__(
        self,
        task: TeamExploration,
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
        self.env_spec = _make_spec(task, dataset, config, robots, radio, actions, observation, more, type(self))
        self.task, self.radio, self.config = task, radio, self.env_spec.config
        self.num_envs, self.robots = num_envs, robots
        self.single_action_space = batch_space(self.env_spec.action_space(), robots)
        self.single_observation_space = batch_space(self.env_spec.observation_space(), robots)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._pools = TeamPools(self.env_spec, radio, num_envs, robots, threads)
        self._pictures = self.env_spec.pictures(num_envs * robots)
        self._rngs: dict[int, np.random.Generator] = {}
        self._plan_ids = np.full(num_envs, None, object)
        self._ended = np.ones(num_envs, bool)
        self._begun = np.zeros(num_envs, bool)
        self._before: Metrics

    def team(self, i: int) -> Team:
        """Return the robots of environment ``i``; its arrays are views, which the next step changes."""
        if not self._begun[i]:
            raise gymnasium.error.ResetNeeded(f"environment {i}: call reset() first")
        return self._pools.bind(i)

    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]`` (N,).

        ``reset(seed=s)`` corresponds to the seeds s to s + N - 1 of ``parallel_env``, and a list gives each environment
        its own. ``options`` may have "plan_id", an id for all or a list of N, and "pose", a list of N lists of starts.
        """
        given = dict(options or {})
        if unknown := sorted(given.keys() - {"reset_mask", "plan_id", "pose"}):
            raise ConfigError(f"options: unknown key {unknown[0]!r}; known: 'plan_id', 'pose', 'reset_mask'")
        seeds, which = parse_seeds(seed, self.num_envs), parse_reset_mask(given.get("reset_mask"), self.num_envs)
        plan_ids, poses = parse_plan_ids(given.get("plan_id"), self.num_envs), given.get("pose")
        poses = [None] * self.num_envs if poses is None else list(poses)
        if len(poses) != self.num_envs:
            raise ConfigError(f"options['pose']: expected {self.num_envs} lists of starts, found {len(poses)}")
        if which.all() and any(one is not None for one in seeds):
            self.env_spec.choice.start_over()
        self._begun = self._begun & ~which
        if self._begun.any():  # earlier observations belong to the caller
            self._pools.batch.renew_views(copy=True)
        for i in np.flatnonzero(which).tolist():
            if seeds[i] is not None or i not in self._rngs:
                self._rngs[i] = seeding.np_random(seeds[i])[0]
            self._start(i, plan_ids[i], _check_starts(poses[i], self.robots))
        self._begun |= which
        if not self._begun.all():
            missing = np.flatnonzero(~self._begun).tolist()
            raise gymnasium.error.ResetNeeded(f"environments {missing}: they have not begun; reset them too")
        self._ended = self._ended & ~which
        now = self._before = self._pools.metrics()
        return self._observations(now), with_masks(self._infos(now, self._successes(now)), which)

    def _start(self, i: int, plan_id: str | None = None, starts: list[Pose | None] | None = None) -> None:
        """Put the start of an episode at place ``i``."""
        rng, choice = self._rngs[i], self.env_spec.choice
        world = choice.draw(rng, plan_id)
        team = Team(self.env_spec, world, self.robots, self.radio, rng, starts or (), self._pools.around)
        self._pools.put(i, team)
        self._plan_ids[i] = world.plan_id

    def step(self, actions: npt.ArrayLike) -> tuple[Observation, Floats, Bools, Bools, dict[str, Any]]:
        """Take an action of each robot, (N, R) or (N, R, 2).

        Return the observations, rewards (N, R), terminated (N,), truncated (N,) and infos. A team whose episode has
        ended ignores its actions, starts the next episode, and has rewards of 0.
        """
        observed, rewards, terminated, truncated, infos = self.advance(actions)
        return observed, rewards, terminated, truncated, with_masks(infos, np.ones(self.num_envs, bool))

    def advance(
        self, actions: npt.ArrayLike, *, fresh: bool = True
    ) -> tuple[Observation, Floats, Bools, Bools, dict[str, Any]]:
        """Do what ``step`` does, without masks in the infos; unless ``fresh``, the next step overwrites the maps."""
        if not self._begun.all():
            raise gymnasium.error.ResetNeeded(
                f"environments {np.flatnonzero(~self._begun).tolist()}: call reset() first"
            )
        teams, robots = self.num_envs, self.robots
        try:
            given = np.asarray(actions)
            found = f"shape {given.shape}"
        except ValueError:
            given, found = np.empty(0), "lists of different lengths"
        if given.shape[:2] != (teams, robots):
            raise ConfigError(f"actions: expected an array of shape ({teams}, {robots}, ...), found {found}")
        motions, ahead = self.env_spec.motions(given.reshape(teams * robots, *given.shape[2:]), teams * robots)
        active, starting = ~self._ended, self._ended.nonzero()[0].tolist()
        motions.reshape(teams, -1)[starting] = 0.0
        seen, now = self._pools.step(motions, active, fresh=fresh)
        rewards = self.task.rewards(self._before, seen, ahead.reshape(teams, robots))
        rewards[~active] = 0.0
        for i in starting:
            self._start(i)
        if starting:
            now = self._pools.metrics()
        success = self._successes(now)
        terminated, truncated = success & active, now.truncated()[::robots] & active
        self._ended, self._before = terminated | truncated, now
        return self._observations(now), rewards, terminated, truncated, self._infos(now, success)

    def _successes(self, now: Metrics) -> Bools:
        pools = self._pools
        return self.task.successes(pools.together["covered"] / pools.observable, now)

    def _observations(self, now: Metrics) -> Observation:
        """Return new arrays (N, R, ...)."""
        batch, pictures = self._pools.batch, self._pictures
        if pictures:
            wanted = np.full(self.num_envs * self.robots, STEP, np.uint8)
            pictures.draw(batch.arrays, batch.sizes, wanted, self._pools.constants, batch.share, fresh=True)
        found = self.env_spec.observe(batch.arrays, now, pictures, batch.sizes)
        if not isinstance(found, dict):
            return self._by_team(found)
        return {key: self._by_team(part.copy() if key == "global_map" else part) for key, part in found.items()}

    def _by_team(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return an array (N * R, ...) as (N, R, ...)."""
        return array.reshape(self.num_envs, self.robots, *array.shape[1:])

    def _infos(self, now: Metrics, success: Bools) -> dict[str, Any]:
        """Return the entries of the robots' ``info`` (N, R, ...), and "team", whose entries are (N,)."""
        pools, ppm = self._pools, self.config.pixels_per_metre
        report = self.env_spec.report(pools.batch.arrays, now, success.repeat(self.robots))
        infos: dict[str, Any] = {key: self._by_team(part) for key, part in report.items()}
        ways_m = self._by_team(now.readings["path_length"]) / ppm
        team: dict[str, Any] = compute_report(pools.together, ways_m, infos["collisions"], pools.observable, ppm)
        infos["hears"] = pools.contact.heard.copy()
        if self.env_spec.text_info:
            infos["plan_id"] = self._plan_ids.copy()
        infos["team"] = team
        return infos

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002  # gymnasium's signature
        """End the threads."""
        self._pools.close()


def _make_spec(  # noqa: PLR0917  # the arguments of an environment
    task: TeamExploration,
    dataset: Plans,
    config: SimulatorConfig | str | None,
    robots: int,
    radio: Radio,
    actions: Actions | None,
    observation: Kind,
    more: EnvOptions,
    kind: type,
) -> EnvSpec:
    """Return the specification of one robot's environment; raise ConfigError if an argument is invalid for a team.

    ``kind`` is the class that takes the arguments.
    """
    check_whole_number(robots, "robots", at_least=1, at_most=ROBOTS_MOST)
    if not isinstance(radio, Radio):
        raise ConfigError(f"radio: expected a Radio or the name of its model, found {radio!r}")
    if actions not in {None, "discrete", "continuous"}:
        raise ConfigError(f"actions: expected discrete or continuous for a team, found {actions!r}")
    check_options(kind, more, task.options())
    spec = make_env_spec(task.single, dataset, config, actions, observation, **more)
    if robots > 1 and spec.config.trajectories:
        raise ConfigError("trajectories: a team meets robots, people and obstacles; leave trajectories out")
    if robots > 1 and spec.config.known_map:
        raise ConfigError("known_map: a team that explores cannot know the map; leave it out")
    return spec


def _check_starts(poses: object, robots: int) -> list[Pose | None]:
    """Return the starts of the first robots; raise ConfigError if they are not a list of poses."""
    if poses is None:
        return []
    given = list(poses) if isinstance(poses, Iterable) else [poses]
    if len(given) == 3 and all(isinstance(part, (int, float, np.number)) for part in given):
        given = [given]
    if len(given) > robots:
        raise ConfigError(f"options['pose']: expected at most one for each of {robots} robots, found {len(given)}")
    return [parse_pose(pose) for pose in given]
