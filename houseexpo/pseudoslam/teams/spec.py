"""Check the arguments of teams' environments, single and vector, and make their specification, spaces and starts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import check_whole_number
from houseexpo.pseudoslam.envs.reset_options import Pose, parse_pose
from houseexpo.pseudoslam.envs.spec import Actions, EnvOptions, EnvSpec, Kind, check_options, make_env_spec
from houseexpo.pseudoslam.teams.discs import ROBOTS_MOST
from houseexpo.pseudoslam.teams.radio import Radio
from houseexpo.pseudoslam.teams.tasks import TeamTask
from houseexpo.pseudoslam.worlds.maps import Plans


def make_team_spec(  # noqa: PLR0917  # the arguments of an environment
    task: TeamTask,
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
    if observation == "graph":
        raise ConfigError("observation: expected map, dict or scales for a team, found 'graph'")
    check_options(kind, more, task.options())
    spec = make_env_spec(task.single, dataset, config, actions, observation, **more)
    if robots > 1 and spec.config.trajectories:
        raise ConfigError("trajectories: a team meets robots, people and obstacles; leave trajectories out")
    if robots > 1 and spec.config.known_map and not task.knows_map:
        raise ConfigError(f"known_map: a team cannot know the map in the task {task.name!r}; leave it out")
    return spec


def make_observation_space(task: TeamTask, spec: EnvSpec, robots: int) -> spaces.Space[Any]:
    """Return the space of a robot's observations: those of one robot, and the task's parts."""
    found, more = spec.observation_space(), task.spaces(spec, robots)
    if not more:
        return found
    parts = dict(found.spaces) if isinstance(found, spaces.Dict) else {"map": found}
    return spaces.Dict(parts | more)


def check_starts(poses: object, robots: int) -> list[Pose | None]:
    """Return the starts of the first robots; raise ConfigError if they are not a list of poses."""
    if poses is None:
        return []
    given = list(poses) if isinstance(poses, Iterable) else [poses]
    if len(given) == 3 and all(isinstance(part, (int, float, np.number)) for part in given):
        given = [given]
    if len(given) > robots:
        raise ConfigError(f"options['pose']: expected at most one for each of {robots} robots, found {len(given)}")
    return [parse_pose(pose) for pose in given]
